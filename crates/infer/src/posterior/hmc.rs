//! Hamiltonian Monte Carlo (Neal 2011) with chains side by side. A group has as many chains as there are lanes, with the same step and
//! number of steps; each chain has its own momenta and acceptances. The number of a chain fixes its group, so results do not depend on
//! threads.
//!
//! Coordinates are whitened by a given matrix, which is improved from all chains in the first half of the warm-up. In both halves the step
//! is found by dual averaging (Hoffman and Gelman 2014, section 3.2).

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use nalgebra::DVector;

use tongue_core::parallel;
use tongue_core::random::{normals, seed_of};
use tongue_core::statics::lanes::LANES;

use super::warm_up::DualAveraging;
pub use super::warm_up::Whitened;

/// Number of trajectories that are checked together in the warm-up, and the least number between two kept draws.
const CHECKED: usize = 2;
/// Draws that are tried as the start of a chain, each nearer to the centre than the last; then the centre is tried.
const TOWARDS_CENTRE: i32 = 11;
const MOST_STARTS: i32 = 32;
const MOST_STEPS: usize = 100;

/// A density to sample, evaluated at up to [`LANES`] points at once.
pub trait SampledDensity: Send + Sync {
    /// State of a solved point, from which neighbours are solved.
    type Solved: Clone + Send + Sync;
    type Kept: Clone + Send + Sync;

    /// Logarithm of the density and its derivatives at each point, solved from its state; `None` where the density is zero.
    fn evaluate(
        &mut self,
        points: &[(&DVector<f64>, &Self::Solved)],
    ) -> Vec<Option<DensityPoint<Self::Solved>>>;

    /// State from which the next point of a trajectory is solved.
    fn ahead(here: &Self::Solved, _before: &Self::Solved) -> Self::Solved {
        here.clone()
    }

    /// Whether each point of nonzero density is allowed as a draw; trajectories to others are rejected.
    fn allowed(&mut self, points: &[(&DVector<f64>, &DensityPoint<Self::Solved>)]) -> Vec<bool> {
        vec![true; points.len()]
    }

    fn keep(&self, at: &DVector<f64>, point: &DensityPoint<Self::Solved>) -> Self::Kept;
}

#[derive(Debug, Clone)]
pub struct DensityPoint<P> {
    /// Logarithm of the density, up to a constant.
    pub log: f64,
    pub gradient: DVector<f64>,
    pub solved: P,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    pub chains: usize,
    /// Discarded draws of each chain in each half of the warm-up.
    pub warm_up: usize,
    pub draws: usize,
    /// One of this many draws is kept.
    pub thin: usize,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Chain<K> {
    pub draws: Vec<K>,
    /// Trajectories after the warm-up with an energy error above [`DIVERGED`].
    pub divergences: usize,
    /// Trajectories after the warm-up that ended at zero density.
    pub zero: usize,
    /// Number of returns from points that are not allowed, after the warm-up.
    pub refused: usize,
    pub acceptance: f64,
    pub evaluations: usize,
}

impl<K> Chain<K> {
    const EMPTY: Self =
        Self { draws: Vec::new(), divergences: 0, zero: 0, refused: 0, acceptance: 0.0, evaluations: 0 };
}

/// Energy error beyond which a trajectory counts as diverged (as in Stan).
pub const DIVERGED: f64 = 1000.0;

/// Runs the chains. Every chain begins at a draw from the whitened normal distribution, solved from the state `from`; where the density is
/// zero, draws nearer to the centre, the centre, and then other draws are tried.
pub fn sample<T: SampledDensity>(
    make: impl Fn() -> T + Sync,
    whitened: &Whitened,
    from: &T::Solved,
    settings: &Settings,
) -> Vec<Chain<T::Kept>> {
    let groups = in_groups(&make, whitened, from, settings, None, |g| g.warmed_up(settings.warm_up));
    let begun = groups.iter().all(ChainGroup::has_begun);
    let visited_points: Vec<_> = groups.iter().flat_map(|g| &g.visited_points).collect();
    let Some(learned) = begun.then(|| whitened.learned(&visited_points)).flatten() else {
        return vec![Chain::EMPTY; settings.chains];
    };
    let sampled =
        parallel::map(&groups, |group| group.in_coordinates(make(), &learned).run(settings, CHECKED));
    sampled.into_iter().flatten().collect()
}

/// [`sample`] with fixed coordinates: without the second half of the warm-up, and with one check of points at the end of the first. `only`
/// selects one group of chains.
pub(super) fn sample_briefly<T: SampledDensity>(
    make: impl Fn() -> T + Sync,
    whitened: &Whitened,
    from: &T::Solved,
    settings: &Settings,
    only: Option<usize>,
) -> Vec<Chain<T::Kept>> {
    let sampled =
        in_groups(&make, whitened, from, settings, only, |group| group.run(settings, settings.warm_up));
    sampled.into_iter().flatten().collect()
}

/// Applies `work` to each group of chains, or to one; a group has as many chains as there are lanes.
fn in_groups<'w, T: SampledDensity, R: Send>(
    make: &(impl Fn() -> T + Sync),
    whitened: &'w Whitened,
    from: &T::Solved,
    settings: &Settings,
    only: Option<usize>,
    work: impl Fn(ChainGroup<'w, T>) -> R + Sync,
) -> Vec<R> {
    let mut firsts: Vec<usize> = (0..settings.chains).step_by(LANES).collect();
    firsts.retain(|first| only.is_none_or(|group| *first == group * LANES));
    parallel::map(&firsts, |&first| {
        let chains = (settings.chains - first).min(LANES);
        work(ChainGroup::new(make(), whitened, from, settings, first, chains))
    })
}

#[derive(Clone)]
struct ChainState<P> {
    z: DVector<f64>,
    x: DVector<f64>,
    point: DensityPoint<P>,
    slope: DVector<f64>,
}

struct ChainGroup<'a, T: SampledDensity> {
    target: T,
    whitened: &'a Whitened,
    /// State of each chain; fewer than `random` where some could not begin.
    states: Vec<ChainState<T::Solved>>,
    random: Vec<fastrand::Rng>,
    /// Generator of the lengths of trajectories, shared by all chains.
    common: fastrand::Rng,
    evaluations: usize,
    step: DualAveraging,
    /// Points visited in [`Self::warmed_up`] after its first third, and the derivatives of the logarithm of the density there.
    visited_points: Vec<(DVector<f64>, DVector<f64>)>,
}

impl<'a, T: SampledDensity> ChainGroup<'a, T> {
    fn new(
        mut target: T,
        whitened: &'a Whitened,
        from: &T::Solved,
        settings: &Settings,
        first: usize,
        chains: usize,
    ) -> Self {
        let n = whitened.centre.len();
        let generator = |number: usize| fastrand::Rng::with_seed(seed_of(settings.seed, number));
        let mut random: Vec<fastrand::Rng> = (first..first + chains).map(generator).collect();
        let common = generator((1 << 20) + first);
        let mut states: Vec<Option<ChainState<T::Solved>>> = (0..chains).map(|_| None).collect();
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
            let z: Vec<DVector<f64>> = random.iter_mut().map(|r| normals(n, r) * part).collect();
            let x: Vec<DVector<f64>> = z.iter().map(|z| whitened.to_scores(z)).collect();
            let points: Vec<_> = x.iter().map(|x| (x, from)).collect();
            evaluations += points.len();
            for ((state, point), (z, x)) in
                states.iter_mut().zip(target.evaluate(&points)).zip(z.into_iter().zip(&x))
            {
                if let (None, Some(point)) = (state.as_ref(), point)
                    && target.allowed(&[(x, &point)])[0]
                {
                    *state = Some(ChainState::new(whitened, z, x.clone(), point));
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
        let moved = |s: &ChainState<T::Solved>| {
            ChainState::new(whitened, whitened.scores_of(&s.x), s.x.clone(), s.point.clone())
        };
        ChainGroup {
            target,
            whitened,
            states: self.states.iter().map(moved).collect(),
            random: self.random.clone(),
            common: self.common.clone(),
            evaluations: self.evaluations,
            step: DualAveraging::new(),
            visited_points: Vec::new(),
        }
    }

    fn warmed_up(mut self, warm_up: usize) -> Self {
        if !self.has_begun() {
            return self;
        }
        for block in blocks(warm_up, CHECKED) {
            self.checked(|group| {
                for draw in block {
                    group.warm();
                    // The first third may still be far from the bulk of the density.
                    if draw >= warm_up / 3 {
                        let visited = group.states.iter().map(|s| (s.x.clone(), s.point.gradient.clone()));
                        group.visited_points.extend(visited);
                    }
                }
            });
        }
        self
    }

    /// Runs one trajectory and adapts the step to its acceptance.
    fn warm(&mut self) {
        let ends = self.trajectory(self.step.trial);
        self.step.learn(ends.iter().map(|e| e.probability).sum::<f64>() / ends.len() as f64);
    }

    /// Runs trajectories and returns chains that end at points that are not allowed to where they were. Several trajectories in a row are
    /// reversible as one is, so the chains sample the density restricted to allowed points. Tells which chains were returned.
    fn checked(&mut self, run: impl FnOnce(&mut Self)) -> Vec<bool> {
        let begun = self.states.clone();
        run(self);
        let moved: Vec<usize> = (0..begun.len()).filter(|i| self.states[*i].x != begun[*i].x).collect();
        let points: Vec<_> = moved.iter().map(|&i| (&self.states[i].x, &self.states[i].point)).collect();
        let allowed = self.target.allowed(&points);
        let mut refused = vec![false; begun.len()];
        moved.iter().zip(allowed).for_each(|(&i, allowed)| refused[i] = !allowed);
        for ((state, begun), _) in self.states.iter_mut().zip(begun).zip(&refused).filter(|(_, r)| **r) {
            *state = begun;
        }
        refused
    }

    /// Warms up, with a check of points after each `checked` trajectories, and draws.
    fn run(mut self, settings: &Settings, checked: usize) -> Vec<Chain<T::Kept>> {
        let count = self.states.len();
        let mut chains = vec![Chain::EMPTY; self.random.len()];
        if !self.has_begun() {
            return chains;
        }
        for block in blocks(settings.warm_up, checked) {
            self.checked(|group| block.for_each(|_| group.warm()));
        }
        // Two checks for each draw reject hardly more than one for each trajectory would.
        let together = settings.thin.div_ceil(2).max(CHECKED);
        for _ in 0..settings.draws {
            for block in blocks(settings.thin, together) {
                let refused = self.checked(|group| {
                    for (chain, end) in block.flat_map(|_| group.trajectory(group.step.found)).enumerate() {
                        let chain = &mut chains[chain % count];
                        chain.divergences += usize::from(end.diverged);
                        chain.zero += usize::from(end.zero);
                        chain.acceptance += end.probability / (settings.draws * settings.thin) as f64;
                    }
                });
                chains.iter_mut().zip(refused).for_each(|(c, refused)| c.refused += usize::from(refused));
            }
            for (chain, state) in chains.iter_mut().zip(&self.states) {
                chain.draws.push(self.target.keep(&state.x, &state.point));
            }
        }
        chains.iter_mut().for_each(|c| c.evaluations = self.evaluations / count);
        chains
    }

    fn trajectory(&mut self, size: f64) -> Vec<TrajectoryEnd> {
        let (n, count) = (self.whitened.centre.len(), self.states.len());
        let length = FRAC_PI_2 * (0.7 + 0.6 * self.common.f64());
        let steps = ((length / size).round() as usize).clamp(1, MOST_STEPS);
        let mut momenta: Vec<DVector<f64>> = self.random.iter_mut().map(|r| normals(n, r)).collect();
        let energy =
            |state: &ChainState<T::Solved>, p: &DVector<f64>| 0.5 * p.norm_squared() - state.point.log;
        let before: Vec<f64> = self.states.iter().zip(&momenta).map(|(s, p)| energy(s, p)).collect();
        let mut moved = self.states.clone();
        let mut before_last: Vec<Option<T::Solved>> = vec![None; count];
        let mut alive = vec![true; count];
        for _ in 0..steps {
            for (p, s) in momenta.iter_mut().zip(&moved) {
                *p += &s.slope * (0.5 * size);
            }
            // A chain that has reached zero density stays where it was.
            let next =
                |i: usize| if alive[i] { &moved[i].z + &momenta[i] * size } else { moved[i].z.clone() };
            let z: Vec<DVector<f64>> = (0..count).map(next).collect();
            let x: Vec<DVector<f64>> = z.iter().map(|z| self.whitened.to_scores(z)).collect();
            let starts = moved.iter().zip(&before_last).map(|(s, before)| match before {
                Some(before) => T::ahead(&s.point.solved, before),
                None => s.point.solved.clone(),
            });
            let starts: Vec<T::Solved> = starts.collect();
            let points: Vec<_> = x.iter().zip(&starts).collect();
            let found = self.target.evaluate(&points);
            self.evaluations += count;
            for (i, (point, (z, x))) in found.into_iter().zip(z.into_iter().zip(&x)).enumerate() {
                match point {
                    Some(point) if alive[i] => {
                        let here = ChainState::new(self.whitened, z, x.clone(), point);
                        before_last[i] = Some(std::mem::replace(&mut moved[i], here).point.solved);
                        momenta[i] += &moved[i].slope * (0.5 * size);
                    }
                    _ => alive[i] = false,
                }
            }
            if alive.iter().all(|a| !a) {
                break;
            }
        }
        Vec::from_iter(moved.iter().enumerate().map(|(i, after)| {
            let gain = before[i] - energy(after, &momenta[i]);
            let diverged = alive[i] && (gain.is_nan() || gain < -DIVERGED);
            let probability = if alive[i] && gain.is_finite() { gain.min(0.0).exp() } else { 0.0 };
            // Drawn in any case, so that a chain does not depend on the others.
            if self.random[i].f64() < probability {
                self.states[i] = after.clone();
            }
            TrajectoryEnd { probability, diverged, zero: !alive[i] }
        }))
    }
}

struct TrajectoryEnd {
    probability: f64,
    diverged: bool,
    zero: bool,
}

/// Ranges of up to `each` of `count` trajectories.
fn blocks(count: usize, each: usize) -> impl Iterator<Item = Range<usize>> {
    // A short run without warm-up has blocks of no trajectories.
    let each = each.max(1);
    (0..count).step_by(each).map(move |first| first..count.min(first + each))
}

impl<P> ChainState<P> {
    fn new(whitened: &Whitened, z: DVector<f64>, x: DVector<f64>, point: DensityPoint<P>) -> Self {
        let slope = whitened.spread.tr_mul(&point.gradient);
        Self { z, x, point, slope }
    }
}
