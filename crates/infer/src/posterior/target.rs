//! What the sampler needs of a density, the size of a run, and what comes of it.

use nalgebra::DVector;

/// A density to sample, of which up to [`LANES`](tongue_core::statics::lanes::LANES) points are evaluated at once.
pub trait Target {
    /// State of a solved point, from which its neighbours are solved.
    type Place: Clone + Send + Sync;
    type Kept: Clone + Send + Sync;

    /// The logarithm of the density and its derivatives at each point, solved from the place given with it; `None` where the density is
    /// zero.
    fn evaluate(&mut self, points: &[(&DVector<f64>, &Self::Place)]) -> Vec<Option<Point<Self::Place>>>;

    /// A place from which the next point of a trajectory is solved, after steps that led from `before` to `here`.
    fn ahead(here: &Self::Place, _before: &Self::Place) -> Self::Place {
        here.clone()
    }

    /// Whether each point, at which the density is not zero, is allowed as a draw; trajectories to other points are refused.
    fn allowed(&mut self, points: &[(&DVector<f64>, &Point<Self::Place>)]) -> Vec<bool> {
        vec![true; points.len()]
    }

    fn keep(&self, at: &DVector<f64>, point: &Point<Self::Place>) -> Self::Kept;
}

#[derive(Debug, Clone)]
pub struct Point<P> {
    /// Logarithm of the density, up to a constant.
    pub log: f64,
    pub gradient: DVector<f64>,
    pub place: P,
}

/// Size of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    pub chains: usize,
    /// Draws of each chain in each half of the warm-up, which are discarded.
    pub warm_up: usize,
    /// Draws of each chain that are kept.
    pub draws: usize,
    /// Thinning: one of this many draws is kept.
    pub thin: usize,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Chain<K> {
    pub draws: Vec<K>,
    /// Trajectories after the warm-up whose energy error was larger than [`DIVERGED`].
    pub divergences: usize,
    /// Trajectories, after the warm-up, that ended where the density is zero.
    pub zero: usize,
    /// How often, after the warm-up, the chain was sent back from a point that is not allowed.
    pub refused: usize,
    pub acceptance: f64,
    pub evaluations: usize,
}

impl<K> Chain<K> {
    pub(super) const EMPTY: Self =
        Self { draws: Vec::new(), divergences: 0, zero: 0, refused: 0, acceptance: 0.0, evaluations: 0 };
}

/// Energy error beyond which a trajectory counts as diverged (as in Stan).
pub const DIVERGED: f64 = 1000.0;
