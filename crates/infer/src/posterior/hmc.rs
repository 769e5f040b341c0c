//! Hamiltonian Monte Carlo (Neal 2011) on an approximation of a density, with exact acceptance.
//!
//! Trajectories follow an approximation, which costs little. After every few of them the density itself decides: their end `x'` replaces
//! their start `x` with probability `min(1, p(x') q(x) / (p(x) q(x')))`, with the density `p` and the approximation `q` (the surrogate
//! transition of Liu 2001, section 9.4.3; Christen and Fox 2005). So the chains sample the density whatever the approximation is, and a
//! poor one costs effective draws only.
//!
//! A group has as many chains as there are lanes, with the same step and number of steps; each chain has its own momenta and acceptances.
//! The number of a chain fixes its group, so results do not depend on threads. Coordinates are whitened by a given matrix, which is
//! improved from all chains in the first half of the warm-up. In both halves the step is found by dual averaging (Hoffman and Gelman 2014,
//! section 3.2).

use std::f64::consts::FRAC_PI_2;

use nalgebra::DVector;

use tongue_core::parallel;
use tongue_core::random::{normals, seed_of};
use tongue_core::statics::lanes::LANES;

use super::warm_up::DualAveraging;
pub use super::warm_up::Whitened;

/// Numbers of trajectories between two acceptances, in the warm-up and after it.
const IN_WARM_UP: usize = 20;
const TOGETHER: usize = 4;
/// Draws that are tried as the start of a chain, each nearer to the centre than the last; then the centre is tried.
const TOWARDS_CENTRE: i32 = 11;
const MOST_STARTS: i32 = 32;
const MOST_STEPS: usize = 100;
pub(super) const CHAINS: usize = 8;

/// A density to sample and its approximation.
pub trait SampledDensity: Send + Sync {
    type Kept: Clone + Send + Sync;

    /// Logarithm of the approximation, up to a constant, and its derivatives.
    fn approximate(&self, at: &DVector<f64>) -> (f64, DVector<f64>);

    /// Logarithm of the density, up to a constant, and what is kept of a draw, at each of up to [`LANES`] points; `None` where the density
    /// is zero.
    fn evaluate(&mut self, points: &[&DVector<f64>]) -> Vec<Option<(f64, Self::Kept)>>;
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Discarded trajectories of each chain in each half of the warm-up.
    pub warm_up: usize,
    pub draws: usize,
    /// Number of ends that are tried for each draw.
    pub thin: usize,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Chain<K> {
    pub draws: Vec<K>,
    /// Scores of the draws.
    pub scores: Vec<DVector<f64>>,
    /// Trajectories after the warm-up with an energy error above [`DIVERGED`].
    pub divergences: usize,
    /// Ends after the warm-up at which the density is zero.
    pub zero: usize,
    /// Part of the ends after the warm-up that the density accepted.
    pub accepted: f64,
    /// Mean probability of acceptance by the approximation.
    pub acceptance: f64,
    pub evaluations: usize,
}

impl<K> Chain<K> {
    const EMPTY: Self = Self {
        draws: Vec::new(),
        scores: Vec::new(),
        divergences: 0,
        zero: 0,
        accepted: 0.0,
        acceptance: 0.0,
        evaluations: 0,
    };
}

/// Energy error beyond which a trajectory counts as diverged (as in Stan).
pub const DIVERGED: f64 = 1000.0;

/// Runs the chains. Every chain begins at a draw from the whitened normal distribution; where the density is zero, draws nearer to the
/// centre, the centre, and then other draws are tried.
pub fn sample<T: SampledDensity>(
    make: impl Fn() -> T + Sync,
    whitened: &Whitened,
    settings: &Settings,
) -> Vec<Chain<T::Kept>> {
    let groups = in_groups(&make, whitened, settings, None, |group| group);
    let begun = groups.iter().all(ChainGroup::has_begun);
    let visited_points: Vec<_> = groups.iter().flat_map(|g| &g.visited_points).collect();
    let Some(learned) = begun.then(|| whitened.learned(&visited_points)).flatten() else {
        return vec![Chain::EMPTY; CHAINS];
    };
    let sampled = parallel::map(&groups, |group| {
        let mut group = group.in_coordinates(make(), &learned);
        group.warm_up(settings.warm_up);
        group.draw(settings)
    });
    sampled.into_iter().flatten().collect()
}

/// [`sample`] with fixed coordinates, without the second half of the warm-up. `only` selects one group of chains.
pub(super) fn sample_briefly<T: SampledDensity>(
    make: impl Fn() -> T + Sync,
    whitened: &Whitened,
    settings: &Settings,
    only: Option<usize>,
) -> Vec<Chain<T::Kept>> {
    let sampled = in_groups(&make, whitened, settings, only, |group| group.draw(settings));
    sampled.into_iter().flatten().collect()
}

/// Applies `work` to each group of chains, or to one, after its warm-up; a group has as many chains as there are lanes.
fn in_groups<'w, T: SampledDensity, R: Send>(
    make: &(impl Fn() -> T + Sync),
    whitened: &'w Whitened,
    settings: &Settings,
    only: Option<usize>,
    work: impl Fn(ChainGroup<'w, T>) -> R + Sync,
) -> Vec<R> {
    let mut firsts: Vec<usize> = (0..CHAINS).step_by(LANES).collect();
    firsts.retain(|first| only.is_none_or(|group| *first == group * LANES));
    parallel::map(&firsts, |&first| {
        let chains = (CHAINS - first).min(LANES);
        let mut group = ChainGroup::new(make(), whitened, settings, first, chains);
        group.warm_up(settings.warm_up);
        work(group)
    })
}

#[derive(Clone)]
struct TrajectoryPoint {
    z: DVector<f64>,
    x: DVector<f64>,
    /// Logarithm of the approximation, and its derivatives by `z`.
    log: f64,
    slope: DVector<f64>,
    gradient: DVector<f64>,
}

#[derive(Clone)]
struct ChainState<K> {
    point: TrajectoryPoint,
    /// Logarithm of the density at the last accepted point less that of the approximation, and what is kept of it.
    correction: f64,
    kept: K,
}

struct ChainGroup<'a, T: SampledDensity> {
    target: T,
    whitened: &'a Whitened,
    /// State of each chain; fewer than `random` where some could not begin.
    states: Vec<ChainState<T::Kept>>,
    random: Vec<fastrand::Rng>,
    /// Generator of the lengths of trajectories, shared by all chains.
    common: fastrand::Rng,
    evaluations: usize,
    step: DualAveraging,
    /// Points visited in the warm-up after its first third, and the derivatives of the logarithm of the approximation there.
    visited_points: Vec<(DVector<f64>, DVector<f64>)>,
}

impl<'a, T: SampledDensity> ChainGroup<'a, T> {
    fn new(mut target: T, whitened: &'a Whitened, settings: &Settings, first: usize, chains: usize) -> Self {
        let n = whitened.centre.len();
        let generator = |number: usize| fastrand::Rng::with_seed(seed_of(settings.seed, number));
        let mut random: Vec<fastrand::Rng> = (first..first + chains).map(generator).collect();
        let common = generator((1 << 20) + first);
        let mut states: Vec<Option<ChainState<T::Kept>>> = (0..chains).map(|_| None).collect();
        let mut evaluations = 0;
        // Draws are moved towards the centre until all chains have a start with nonzero density; after the centre, whole draws are tried.
        for attempt in 0..MOST_STARTS {
            if states.iter().all(Option::is_some) {
                break;
            }
            let part = match attempt {
                0..TOWARDS_CENTRE => 0.8f64.powi(attempt),
                TOWARDS_CENTRE => 0.0,
                _ => 1.0,
            };
            let draws = random.iter_mut().map(|r| normals(n, r) * part);
            let points: Vec<TrajectoryPoint> =
                draws.map(|z| TrajectoryPoint::new(&target, whitened, z)).collect();
            evaluations += points.len();
            let found = target.evaluate(&points.iter().map(|p| &p.x).collect::<Vec<_>>());
            for ((state, point), found) in states.iter_mut().zip(points).zip(found) {
                if let (None, Some((log, kept))) = (state.as_ref(), found) {
                    *state = Some(ChainState { correction: log - point.log, kept, point });
                }
            }
        }
        let states = states.into_iter().flatten().collect();
        let (step, visited_points) = (DualAveraging::new(), Vec::new());
        Self { target, whitened, states, random, common, evaluations, step, visited_points }
    }

    fn has_begun(&self) -> bool {
        self.states.len() == self.random.len()
    }

    /// The chains in other coordinates.
    fn in_coordinates<'b>(&self, target: T, whitened: &'b Whitened) -> ChainGroup<'b, T> {
        let states = self.states.iter().map(|s| {
            let point = TrajectoryPoint::new(&target, whitened, whitened.scores_of(&s.point.x));
            ChainState { point, ..s.clone() }
        });
        ChainGroup {
            states: states.collect(),
            target,
            whitened,
            random: self.random.clone(),
            common: self.common.clone(),
            evaluations: self.evaluations,
            step: DualAveraging::new(),
            visited_points: Vec::new(),
        }
    }

    /// Runs trajectories and adapts the step to their acceptance.
    fn warm_up(&mut self, count: usize) {
        if !self.has_begun() {
            return;
        }
        for first in (0..count).step_by(IN_WARM_UP) {
            self.corrected(|group| {
                for number in first..count.min(first + IN_WARM_UP) {
                    let ends = group.trajectory(group.step.trial);
                    group.step.learn(ends.iter().map(|e| e.probability).sum::<f64>() / ends.len() as f64);
                    // The first third may still be far from the bulk of the density.
                    if number >= count / 3 {
                        let visited =
                            group.states.iter().map(|s| (s.point.x.clone(), s.point.gradient.clone()));
                        group.visited_points.extend(visited);
                    }
                }
            });
        }
    }

    /// Runs trajectories, whose ends are accepted by the density, else each chain returns to where it was. Several trajectories in a row
    /// are reversible as one is. Tells what became of each end.
    fn corrected(&mut self, run: impl FnOnce(&mut Self)) -> Vec<End> {
        let begun = self.states.clone();
        run(self);
        let moved: Vec<usize> =
            (0..begun.len()).filter(|i| self.states[*i].point.x != begun[*i].point.x).collect();
        let points: Vec<&DVector<f64>> = moved.iter().map(|&i| &self.states[i].point.x).collect();
        self.evaluations += points.len();
        let mut found = self.target.evaluate(&points).into_iter();
        let states = self.states.iter_mut().zip(begun).zip(&mut self.random).enumerate();
        let ends = states.map(|(i, ((state, begun), random))| {
            // Drawn in any case, so that a chain does not depend on the others.
            let uniform = random.f64();
            if !moved.contains(&i) {
                return End::Accepted;
            }
            let Some((log, kept)) = found.next().flatten() else {
                *state = begun;
                return End::Zero;
            };
            let correction = log - state.point.log;
            if uniform.ln() < correction - begun.correction {
                (state.correction, state.kept) = (correction, kept);
                End::Accepted
            } else {
                *state = begun;
                End::Rejected
            }
        });
        ends.collect()
    }

    fn draw(mut self, settings: &Settings) -> Vec<Chain<T::Kept>> {
        let mut chains = vec![Chain::EMPTY; self.random.len()];
        if !self.has_begun() {
            return chains;
        }
        let tried = (settings.draws * settings.thin) as f64;
        for _ in 0..settings.draws {
            for _ in 0..settings.thin {
                let ends = self.corrected(|group| {
                    for _ in 0..TOGETHER {
                        for (chain, end) in chains.iter_mut().zip(group.trajectory(group.step.found)) {
                            chain.divergences += usize::from(end.diverged);
                            chain.acceptance += end.probability / (tried * TOGETHER as f64);
                        }
                    }
                });
                for (chain, end) in chains.iter_mut().zip(ends) {
                    chain.zero += usize::from(end == End::Zero);
                    chain.accepted += f64::from(u8::from(end == End::Accepted)) / tried;
                }
            }
            for (chain, state) in chains.iter_mut().zip(&self.states) {
                chain.draws.push(state.kept.clone());
                chain.scores.push(state.point.x.clone());
            }
        }
        chains.iter_mut().for_each(|c| c.evaluations = self.evaluations / self.states.len());
        chains
    }

    fn trajectory(&mut self, size: f64) -> Vec<TrajectoryEnd> {
        let Self { target, whitened, states, random, common, .. } = self;
        let length = FRAC_PI_2 * (0.7 + 0.6 * common.f64());
        let steps = ((length / size).round() as usize).clamp(1, MOST_STEPS);
        let chains = states.iter_mut().zip(random).map(|(state, random)| {
            let energy = |point: &TrajectoryPoint, p: &DVector<f64>| 0.5 * p.norm_squared() - point.log;
            let mut momentum = normals(whitened.centre.len(), random);
            let before = energy(&state.point, &momentum);
            let mut here = state.point.clone();
            for _ in 0..steps {
                momentum += &here.slope * (0.5 * size);
                here = TrajectoryPoint::new(target, whitened, &here.z + &momentum * size);
                momentum += &here.slope * (0.5 * size);
            }
            let gain = before - energy(&here, &momentum);
            let probability = if gain.is_finite() { gain.min(0.0).exp() } else { 0.0 };
            if random.f64() < probability {
                state.point = here;
            }
            TrajectoryEnd { probability, diverged: gain.is_nan() || gain < -DIVERGED }
        });
        chains.collect()
    }
}

struct TrajectoryEnd {
    probability: f64,
    diverged: bool,
}

/// What became of the end of trajectories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Accepted,
    Rejected,
    /// The density is zero there.
    Zero,
}

impl TrajectoryPoint {
    fn new(target: &impl SampledDensity, whitened: &Whitened, z: DVector<f64>) -> Self {
        let x = whitened.to_scores(&z);
        let (log, gradient) = target.approximate(&x);
        Self { slope: whitened.spread.tr_mul(&gradient), z, x, log, gradient }
    }
}
