//! Hamiltonian Monte Carlo (Neal 2011) with chains side by side: as many in a group as there are lanes, all with the same step and the
//! same number of steps, each with its own momenta and its own decisions. Groups are fixed by the number of a chain, so the bits do not
//! depend on threads.
//!
//! Coordinates are whitened by a given matrix; in the first half of the warm-up all chains together learn a better one, in both halves the
//! step is found by dual averaging (Hoffman and Gelman 2014, section 3.2). Both are then kept.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector};

use tongue_core::parallel;
use tongue_core::random::{normals, seed_of};
use tongue_core::statics::lanes::LANES;

/// What is sampled: a density of which up to [`LANES`] points are evaluated at once.
pub trait Target: Sync {
    /// What a point leaves for its neighbours to begin at.
    type Place: Clone + Send + Sync;
    /// What is kept of a draw.
    type Kept: Clone + Send + Sync;

    /// The logarithm of the density and its derivatives at each point, begun from the place beside it; `None` where the density is
    /// zero.
    fn evaluate(&mut self, points: &[(&DVector<f64>, &Self::Place)]) -> Vec<Option<Point<Self::Place>>>;

    /// The same with memory of its own: one for each group of chains.
    fn anew(&self) -> Self;

    /// An approximation of the logarithm with its derivatives, by which trajectories are steered; what is drawn does not depend on how good it
    /// is. `None` where the density itself steers.
    fn steer(&self, _at: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        None
    }

    /// As [`Target::evaluate`], without derivatives: of the ends of trajectories that were steered by an approximation.
    fn weigh(&mut self, points: &[(&DVector<f64>, &Self::Place)]) -> Vec<Option<(f64, Self::Place)>> {
        self.evaluate(points).into_iter().map(|p| p.map(|p| (p.log, p.place))).collect()
    }

    /// What is kept of a draw with this logarithm of the density.
    fn keep(&self, at: &DVector<f64>, log: f64, place: &Self::Place) -> Self::Kept;
}

/// An evaluated point.
#[derive(Debug, Clone)]
pub struct Point<P> {
    /// Logarithm of the density, up to a constant.
    pub log: f64,
    /// Its derivatives.
    pub gradient: DVector<f64>,
    /// Where neighbours can begin.
    pub place: P,
}

/// How long is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Number of chains.
    pub chains: usize,
    /// Draws of each half of the warm-up of each chain, which are thrown away.
    pub warm_up: usize,
    /// Draws of each chain that are kept.
    pub draws: usize,
    /// Of so many draws one is kept.
    pub thin: usize,
    /// Seed.
    pub seed: u64,
}

/// A chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain<K> {
    /// What was kept of every draw.
    pub draws: Vec<K>,
    /// Trajectories, after the warm-up, whose energy went wrong by more than [`DIVERGED`].
    pub divergences: usize,
    /// Trajectories, after the warm-up, that ended where the density is zero.
    pub zero: usize,
    /// Mean probability of acceptance after the warm-up.
    pub acceptance: f64,
    /// Evaluations of the density.
    pub evaluations: usize,
}

impl<K> Chain<K> {
    /// A chain without draws.
    const EMPTY: Self = Self { draws: Vec::new(), divergences: 0, zero: 0, acceptance: 0.0, evaluations: 0 };
}

/// An energy that is off by more than this is that of a trajectory that diverged (as in Stan).
pub const DIVERGED: f64 = 1000.0;
/// Acceptance that the step is made for.
const WANTED: f64 = 0.8;
/// First step, and the longest that makes sense in whitened coordinates.
const FIRST_STEP: f64 = 0.5;
const LONGEST_STEP: f64 = 1.6;
/// Most steps of a trajectory.
const MOST_STEPS: usize = 100;

/// Coordinates in which the density is nearly a round normal one: `x = centre + spread z`.
#[derive(Debug, Clone)]
pub struct Whitened {
    /// The middle.
    pub centre: DVector<f64>,
    /// A square root of the covariance.
    pub spread: DMatrix<f64>,
}

/// Samples. Every chain begins at a draw of the whitened normal distribution, evaluated from `place`; chains that find no such draw
/// with a density begin in the middle. What is sampled is made anew after the first half of the warm-up, with all that was weighed there.
pub fn sample<T: Target>(
    make: impl Fn(&[Weighed<T::Place>]) -> T,
    whitened: &Whitened,
    place: &T::Place,
    settings: &Settings,
) -> Vec<Chain<T::Kept>> {
    let firsts: Vec<usize> = (0..settings.chains).step_by(LANES).collect();
    let first = make(&[]);
    let mut groups = parallel::map(&firsts, |&number| {
        let chains = (settings.chains - number).min(LANES);
        Group::new(first.anew(), whitened, place, settings, number, chains).warmed_up(settings.warm_up)
    });
    let Some(learned) = whitened.learned(&groups) else {
        return vec![Chain::EMPTY; settings.chains];
    };
    let weighed: Vec<Weighed<T::Place>> =
        groups.iter_mut().flat_map(|g| std::mem::take(&mut g.weighed)).collect();
    let second = make(&weighed);
    let go_on = |group: &Warm<T::Place>| group.go_on(second.anew(), whitened, &learned).run(settings);
    parallel::map(&groups, go_on).into_iter().flatten().collect()
}

/// Scores of a point and where it was solved.
pub type Weighed<P> = (DVector<f64>, P);

/// Where a chain is.
#[derive(Clone)]
struct State<P> {
    z: DVector<f64>,
    x: DVector<f64>,
    /// Logarithm of the density; not known along a trajectory that is steered by an approximation.
    log: f64,
    /// What neighbours begin at.
    place: P,
    /// Logarithm of what steers, and its derivatives by the whitened coordinates.
    steered: f64,
    slope: DVector<f64>,
}

/// Chains that go on side by side, and what they have learned.
struct Group<'a, T: Target> {
    target: T,
    whitened: &'a Whitened,
    states: Vec<State<T::Place>>,
    /// One a chain.
    random: Vec<fastrand::Rng>,
    /// What the chains have in common: lengths of trajectories.
    common: fastrand::Rng,
    evaluations: usize,
    step: DualAveraging,
    /// Ends of trajectories that were weighed, in the first half of the warm-up.
    weighed: Vec<Weighed<T::Place>>,
}

/// Where chains are after the first half of the warm-up.
struct Warm<P> {
    /// Where each is; fewer than `random` where some could not begin.
    states: Vec<State<P>>,
    random: Vec<fastrand::Rng>,
    common: fastrand::Rng,
    evaluations: usize,
    /// Where they have been.
    seen: Vec<DVector<f64>>,
    weighed: Vec<Weighed<P>>,
}

impl<P: Clone> Warm<P> {
    /// The same chains, in other coordinates.
    fn go_on<'a, T: Target<Place = P>>(
        &self,
        target: T,
        old: &Whitened,
        whitened: &'a Whitened,
    ) -> Group<'a, T> {
        // Derivatives by the old coordinates are those by the scores times the old spread.
        let by_scores = old.spread.transpose().lu();
        let state = |s: &State<P>| {
            let gradient = by_scores.solve(&s.slope).unwrap_or_else(|| DVector::zeros(s.x.len()));
            let (z, slope) = (whitened.scores_of(&s.x), whitened.spread.tr_mul(&gradient));
            State { z, slope, ..s.clone() }
        };
        Group {
            target,
            whitened,
            states: self.states.iter().map(state).collect(),
            random: self.random.clone(),
            common: self.common.clone(),
            evaluations: self.evaluations,
            step: DualAveraging::new(),
            weighed: Vec::new(),
        }
    }
}

impl<'a, T: Target> Group<'a, T> {
    fn new(
        mut target: T,
        whitened: &'a Whitened,
        place: &T::Place,
        settings: &Settings,
        first: usize,
        chains: usize,
    ) -> Self {
        let n = whitened.centre.len();
        let mut random: Vec<fastrand::Rng> = (first..first + chains)
            .map(|chain| fastrand::Rng::with_seed(seed_of(settings.seed, chain)))
            .collect();
        let common = fastrand::Rng::with_seed(seed_of(settings.seed, (1 << 20) + first));
        let mut states: Vec<Option<State<T::Place>>> = (0..chains).map(|_| None).collect();
        let mut evaluations = 0;
        // Draws ever nearer to the middle, until all have a density.
        for attempt in 0..12 {
            if states.iter().all(Option::is_some) {
                break;
            }
            let part = if attempt == 11 { 0.0 } else { 0.8f64.powi(attempt) };
            let z: Vec<DVector<f64>> = random.iter_mut().map(|r| normals(n, r) * part).collect();
            let x: Vec<DVector<f64>> = z.iter().map(|z| whitened.at(z)).collect();
            let points: Vec<_> = x.iter().map(|x| (x, place)).collect();
            evaluations += points.len();
            let found = moved(&mut target, whitened, &points, &z);
            for (state, found) in states.iter_mut().zip(found) {
                let Some(found) = found.filter(|_| state.is_none()) else { continue };
                let log = match found.log.is_nan() {
                    true => target.weigh(&[(&found.x, place)]).pop().flatten(),
                    false => Some((found.log, found.place.clone())),
                };
                *state = log.map(|(log, place)| State { log, place, ..found });
            }
        }
        let states = states.into_iter().flatten().collect();
        let (step, weighed) = (DualAveraging::new(), Vec::new());
        Self { target, whitened, states, random, common, evaluations, step, weighed }
    }

    /// Goes through the first half of the warm-up.
    fn warmed_up(mut self, warm_up: usize) -> Warm<T::Place> {
        let mut seen = Vec::new();
        if self.states.len() == self.random.len() {
            for draw in 0..warm_up {
                let weighed = self.warm();
                self.weighed.extend(weighed);
                // What comes first is still far away.
                if draw >= warm_up / 3 {
                    seen.extend(self.states.iter().map(|s| s.x.clone()));
                }
            }
        }
        let Self { states, random, common, evaluations, weighed, .. } = self;
        Warm { states, random, common, evaluations, seen, weighed }
    }

    /// One trajectory, from which the step is learned; the ends that were weighed.
    fn warm(&mut self) -> Vec<Weighed<T::Place>> {
        let mut ends = self.trajectory(self.step.trial);
        let weighed = ends.iter_mut().filter_map(|e| e.weighed.take()).collect();
        self.step.learn(ends.iter().map(|e| e.steered_well).sum::<f64>() / ends.len() as f64);
        weighed
    }

    fn run(mut self, settings: &Settings) -> Vec<Chain<T::Kept>> {
        let count = self.states.len();
        let mut chains = vec![Chain::EMPTY; self.random.len()];
        if count < chains.len() {
            // Not even the middle has a density.
            return chains;
        }
        for _ in 0..settings.warm_up {
            self.warm();
        }
        for draw in 0..settings.draws * settings.thin {
            let ends = self.trajectory(self.step.found);
            for ((chain, end), state) in chains.iter_mut().zip(&ends).zip(&self.states) {
                chain.divergences += usize::from(end.diverged);
                chain.zero += usize::from(end.zero);
                chain.acceptance += end.probability / (settings.draws * settings.thin) as f64;
                if draw % settings.thin == settings.thin - 1 {
                    chain.draws.push(self.target.keep(&state.x, state.log, &state.place));
                }
            }
        }
        chains.iter_mut().for_each(|c| c.evaluations = self.evaluations / count);
        chains
    }

    /// One trajectory of every chain.
    fn trajectory(&mut self, size: f64) -> Vec<End<T::Place>> {
        let (n, count) = (self.whitened.centre.len(), self.states.len());
        let length = FRAC_PI_2 * (0.7 + 0.6 * self.common.f64());
        let steps = ((length / size).round() as usize).clamp(1, MOST_STEPS);
        let mut momenta: Vec<DVector<f64>> = self.random.iter_mut().map(|r| normals(n, r)).collect();
        let kinetic = |p: &DVector<f64>| 0.5 * p.norm_squared();
        let before: Vec<f64> = momenta.iter().map(kinetic).collect();
        let mut there = self.states.clone();
        let mut alive = vec![true; count];
        for _ in 0..steps {
            for (p, s) in momenta.iter_mut().zip(&there) {
                *p += &s.slope * (0.5 * size);
            }
            // A chain that has left the density waits where it was.
            let z: Vec<DVector<f64>> = (0..count)
                .map(|i| if alive[i] { &there[i].z + &momenta[i] * size } else { there[i].z.clone() })
                .collect();
            let x: Vec<DVector<f64>> = z.iter().map(|z| self.whitened.at(z)).collect();
            let points: Vec<_> = x.iter().zip(&there).map(|(x, s)| (x, &s.place)).collect();
            let found = moved(&mut self.target, self.whitened, &points, &z);
            self.evaluations += found.iter().flatten().filter(|s| !s.log.is_nan()).count();
            for (i, state) in found.into_iter().enumerate() {
                match state {
                    Some(state) if alive[i] => {
                        momenta[i] += &state.slope * (0.5 * size);
                        there[i] = state;
                    }
                    _ => alive[i] = false,
                }
            }
            if alive.iter().all(|a| !a) {
                break;
            }
        }
        // Ends of trajectories that an approximation steered are weighed by the density.
        let open: Vec<usize> = (0..count).filter(|&i| alive[i] && there[i].log.is_nan()).collect();
        let points: Vec<_> = open.iter().map(|&i| (&there[i].x, &there[i].place)).collect();
        self.evaluations += open.len();
        let weighed = self.target.weigh(&points);
        for (&i, found) in open.iter().zip(weighed) {
            match found {
                Some((log, place)) => (there[i].log, there[i].place) = (log, place),
                None => alive[i] = false,
            }
        }
        let mut ends = Vec::with_capacity(count);
        for (i, end) in there.into_iter().enumerate() {
            let here = &self.states[i];
            let lost = kinetic(&momenta[i]) - before[i];
            let (gain, steered) = (end.log - here.log - lost, end.steered - here.steered - lost);
            let diverged = alive[i] && (steered.is_nan() || steered < -DIVERGED);
            let part = |gain: f64| if alive[i] && gain.is_finite() { gain.min(0.0).exp() } else { 0.0 };
            let weighed = Some((end.x.clone(), end.place.clone())).filter(|_| open.contains(&i) && alive[i]);
            // The number is drawn in any case, so that a chain does not depend on what became of others.
            if self.random[i].f64() < part(gain) {
                self.states[i] = end;
            }
            let (probability, steered_well) = (part(gain), part(steered));
            ends.push(End { probability, steered_well, diverged, zero: !alive[i], weighed });
        }
        ends
    }
}

/// States at points, each begun from the place beside it, with coordinates `z`: steered by the approximation if there is one, and then not weighed.
fn moved<T: Target>(
    target: &mut T,
    whitened: &Whitened,
    points: &[(&DVector<f64>, &T::Place)],
    z: &[DVector<f64>],
) -> Vec<Option<State<T::Place>>> {
    let state = |i: usize, place: T::Place, log: f64, steered: f64, gradient: &DVector<f64>| State {
        z: z[i].clone(),
        x: points[i].0.clone(),
        log,
        place,
        steered,
        slope: whitened.spread.tr_mul(gradient),
    };
    let steered: Vec<_> = points.iter().map(|(x, _)| target.steer(x)).collect();
    if steered.iter().any(Option::is_some) {
        let each = steered.into_iter().enumerate();
        return each
            .map(|(i, s)| s.map(|(log, slope)| state(i, points[i].1.clone(), f64::NAN, log, &slope)))
            .collect();
    }
    let found = target.evaluate(points).into_iter().enumerate();
    found.map(|(i, p)| p.map(|p| state(i, p.place, p.log, p.log, &p.gradient))).collect()
}

/// How a trajectory ended.
struct End<P> {
    /// Probability with which its end is taken.
    probability: f64,
    /// The same if what steers were the density: the step is learned by it.
    steered_well: f64,
    diverged: bool,
    zero: bool,
    /// The end, if it was weighed by itself.
    weighed: Option<Weighed<P>>,
}

impl Whitened {
    /// The point of coordinates.
    pub(super) fn at(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.centre + &self.spread * z
    }

    /// The coordinates of a point.
    fn scores_of(&self, x: &DVector<f64>) -> DVector<f64> {
        let away = x - &self.centre;
        self.spread.clone().lu().solve(&away).unwrap_or_else(|| DVector::zeros(x.len()))
    }

    /// What chains have learned of the middle and the covariance, drawn towards these by so many draws as there are coordinates. `None`
    /// where a chain could not begin.
    fn learned<P>(&self, groups: &[Warm<P>]) -> Option<Self> {
        if groups.iter().any(|g| g.states.len() < g.random.len()) {
            return None;
        }
        let seen: Vec<&DVector<f64>> = groups.iter().flat_map(|g| &g.seen).collect();
        let n = self.centre.len();
        if seen.len() < 10 * n {
            return Some(self.clone());
        }
        let (count, own) = (seen.len() as f64, n as f64);
        let centre = seen.iter().copied().sum::<DVector<f64>>() / count;
        let mut covariance = &self.spread * self.spread.transpose() * own;
        for x in seen {
            let away = x - &centre;
            covariance += &away * away.transpose();
        }
        let spread = (covariance / (count + own)).cholesky()?.l();
        Some(Self { centre, spread })
    }

    /// From the middle and the inverse of the covariance; `None` where this is not positive definite.
    pub fn new(centre: DVector<f64>, precision: DMatrix<f64>) -> Option<Self> {
        let n = centre.len();
        let factor = precision.cholesky()?.unpack();
        let spread = factor.transpose().solve_upper_triangular(&DMatrix::identity(n, n))?;
        Some(Self { centre, spread })
    }
}

/// The step for an acceptance wanted, after Hoffman and Gelman (2014), with their constants.
struct DualAveraging {
    trial: f64,
    found: f64,
    count: f64,
    error: f64,
    mean_ln: f64,
}

impl DualAveraging {
    fn new() -> Self {
        Self { trial: FIRST_STEP, found: FIRST_STEP, count: 0.0, error: 0.0, mean_ln: FIRST_STEP.ln() }
    }

    fn learn(&mut self, acceptance: f64) {
        const GAMMA: f64 = 0.05;
        const DELAY: f64 = 10.0;
        const KAPPA: f64 = 0.75;
        self.count += 1.0;
        let weight = 1.0 / (self.count + DELAY);
        self.error = (1.0 - weight) * self.error + weight * (WANTED - acceptance);
        let ln = ((10.0 * FIRST_STEP).ln() - self.error * self.count.sqrt() / GAMMA)
            .clamp((1e-3_f64).ln(), LONGEST_STEP.ln());
        let part = self.count.powf(-KAPPA);
        self.mean_ln = part * ln + (1.0 - part) * self.mean_ln;
        (self.trial, self.found) = (ln.exp(), self.mean_ln.exp());
    }
}
