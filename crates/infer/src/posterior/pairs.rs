//! Postures and baselines drawn about modes and solved once: paired and weighed, they are draws of the posterior, and of that without any one
//! of the muscles.
//!
//! A stretch is the length of a posture over that of a baseline, and neither knows of the other. So few of them, each solved once in lanes,
//! make many pairs. Postures are drawn from the marginals of normal approximations at the modes, somewhat widened, and so are
//! baselines; every fifth comes from the prior, so that no weight is without bound (Hesterberg 1995). Each pair counts as much as prior and
//! stretches make it probable, over the density from which it was drawn.

use nalgebra::{DMatrix, DVector};

use tongue_core::random::{normals, seed_of};

use super::PosteriorError;
use super::density::{Density, Meaning, Parameter, is_found};
use super::map::Mode;
use super::score::Part;
use super::spread::effective;

/// Postures, baselines, and baselines that each posture is paired with.
const POSTURES: usize = 2_000;
const BASELINES: usize = 1_000;
const EACH: usize = 20;
/// By how much the normal approximation is widened, and which draw of so many comes from the prior.
const WIDER: f64 = 1.2;
const FROM_PRIOR: usize = 5;

/// Pairs of solved postures and baselines.
#[derive(Debug)]
pub struct Pairs {
    postures: Solved,
    baselines: Solved,
    pairs: Vec<[usize; 2]>,
    muscles: usize,
}

/// Draws of postures or of baselines that have an equilibrium.
#[derive(Debug)]
struct Solved {
    /// Lengths of all muscles of the body, m, draw after draw; of baselines one over them, 1/m.
    lengths: Vec<f64>,
    /// Logarithms of the prior over the density from which they were drawn.
    logs: Vec<f64>,
    /// Part of all draws that have an equilibrium: the others have no density.
    found: f64,
}

/// A pair with the logarithm of its weight.
type Weighed = ([usize; 2], f64);

impl Pairs {
    /// Draws about modes, and solves; the bits do not depend on threads. Of `density` only what is sampled counts.
    ///
    /// # Errors
    /// [`PosteriorError::NoMode`] where no draw has an equilibrium.
    pub fn about(density: &Density<'_>, modes: &[Mode], seed: u64) -> Result<Self, PosteriorError> {
        let is_tone = |p: &Parameter| matches!(p, Parameter::Tone(_));
        let solved = |tones: bool, count: usize, seed: u64| {
            let proposal = Proposal::new(density, modes, |p| is_tone(p) == tones)?;
            // Where all are fixed there is one.
            let count = if proposal.positions.is_empty() { 1 } else { count };
            Solved::new(density, &proposal, tones, count, seed)
        };
        let postures = solved(false, POSTURES, seed)?;
        let baselines = solved(true, BASELINES, seed_of(seed, 1))?;
        let (all, over) = (postures.logs.len(), baselines.logs.len());
        let each = EACH.min(over);
        let pairs = (0..all * each).map(|k| [k / each, k % over]).collect();
        Ok(Self { postures, baselines, pairs, muscles: density.ground.muscles.len() })
    }

    /// The stretch of a muscle in a pair.
    fn stretch(&self, [posture, baseline]: [usize; 2], muscle: usize) -> f64 {
        self.postures.lengths[posture * self.muscles + muscle]
            * self.baselines.lengths[baseline * self.muscles + muscle]
    }

    /// All pairs with their weights for what was seen; and the logarithm of the marginal density of that.
    fn weighed(&self, density: &Density<'_>) -> (Vec<Weighed>, f64) {
        let seen = &density.seen;
        // Rows of a square root of the inverse covariance.
        let root = density.factor().l();
        let whole = root.clone().try_inverse().unwrap_or_else(|| DMatrix::zeros(root.nrows(), root.ncols()));
        let n = seen.muscles.len();
        let rows: Vec<f64> =
            (0..n).flat_map(|i| (0..=i).map(|j| whole[(i, j)]).collect::<Vec<_>>()).collect();
        let constant = -root.diagonal().iter().map(|d| d.ln()).sum::<f64>()
            - 0.5 * n as f64 * std::f64::consts::TAU.ln();
        let mut residual = vec![0.0; n];
        let mut log = |pair: [usize; 2]| {
            for (r, (y, &m)) in residual.iter_mut().zip(seen.stretches.iter().zip(&seen.muscles)) {
                *r = y - self.stretch(pair, m);
            }
            let (mut at, mut sum) = (0, 0.0);
            for i in 0..n {
                let dot: f64 = rows[at..=at + i].iter().zip(&residual[..=i]).map(|(a, b)| a * b).sum();
                sum += dot * dot;
                at += i + 1;
            }
            constant - 0.5 * sum + self.postures.logs[pair[0]] + self.baselines.logs[pair[1]]
        };
        let logs: Vec<f64> = self.pairs.iter().map(|pair| log(*pair)).collect();
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|l| (l - most).exp()).collect();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        let evidence = most + (mean * self.postures.found * self.baselines.found).ln();
        (self.pairs.iter().copied().zip(weights).collect(), evidence)
    }

    /// How many count: the fewer of postures and baselines, each of which is in many pairs.
    fn effective(&self, weighed: &[Weighed]) -> f64 {
        let of = |which: usize, count: usize| {
            let mut weights = vec![0.0; count];
            weighed.iter().for_each(|(pair, weight)| weights[pair[which]] += weight);
            if count > 1 { effective(&weights) } else { f64::INFINITY }
        };
        of(0, self.postures.logs.len()).min(of(1, self.baselines.logs.len()))
    }

    /// Logarithm of the marginal density of what was seen, and how many postures or baselines count.
    pub fn evidence(&self, density: &Density<'_>) -> (f64, f64) {
        let (weighed, evidence) = self.weighed(density);
        (evidence, self.effective(&weighed))
    }

    /// What pairs say of the stretch of a muscle of the body that `density` has not seen and that goes with its residuals by `gain`: the means
    /// of normal parts, and how many postures or baselines count.
    pub fn predict(&self, density: &Density<'_>, muscle: usize, gain: &DVector<f64>) -> (Vec<Part>, f64) {
        let (weighed, _) = self.weighed(density);
        let seen = &density.seen;
        let part = |&(pair, weight): &Weighed| {
            let each = gain.iter().zip(seen.stretches.iter().zip(&seen.muscles));
            let error: f64 = each.map(|(g, (y, &m))| g * (y - self.stretch(pair, m))).sum();
            Part { mean: self.stretch(pair, muscle) + error, weight }
        };
        (weighed.iter().map(part).collect(), self.effective(&weighed))
    }
}

impl Solved {
    fn new(
        density: &Density<'_>,
        proposal: &Proposal,
        tones: bool,
        count: usize,
        seed: u64,
    ) -> Result<Self, PosteriorError> {
        let drawn: Vec<(Meaning, f64)> = (0..count)
            .map(|i| {
                let (scores, log) = proposal.draw(i, &mut fastrand::Rng::with_seed(seed_of(seed, i)));
                (density.meaning(&scores).0, log)
            })
            .collect();
        let load = |i: usize| match tones {
            true => density.baseline(&drawn[i].0, None),
            false => density.posture(&drawn[i].0, None),
        };
        let solved = density.lanes().map(count, density.settings(), load, |_, shape| {
            is_found(shape).then(|| density.ground.system.lengths(&shape.positions))
        });
        let found = solved.into_iter().zip(&drawn).filter_map(|(lengths, (_, log))| Some((lengths?, *log)));
        let (lengths, logs): (Vec<Vec<f64>>, Vec<f64>) = found.unzip();
        if logs.is_empty() {
            return Err(PosteriorError::NoMode);
        }
        let lengths = lengths.concat();
        let lengths = if tones { lengths.into_iter().map(f64::recip).collect() } else { lengths };
        Ok(Self { lengths, found: logs.len() as f64 / count as f64, logs })
    }
}

/// Where some of the parameters are drawn from: in turn from the prior and from normal distributions.
struct Proposal {
    /// Which of how many.
    positions: Vec<usize>,
    count: usize,
    /// Means and square roots of the covariances.
    normals: Vec<(DVector<f64>, DMatrix<f64>)>,
}

impl Proposal {
    fn new(
        density: &Density<'_>,
        modes: &[Mode],
        is_in: impl Fn(&Parameter) -> bool,
    ) -> Result<Self, PosteriorError> {
        let count = density.parameters.len();
        let positions: Vec<usize> = (0..count).filter(|&i| is_in(&density.parameters[i])).collect();
        let marginal = |mode: &Mode| {
            let covariance = mode.precision.clone().cholesky()?.inverse();
            let own = covariance.select_rows(&positions).select_columns(&positions) * (WIDER * WIDER);
            Some((mode.scores.select_rows(&positions), own.cholesky()?.unpack()))
        };
        let normals: Option<Vec<_>> = modes.iter().map(marginal).collect();
        Ok(Self { normals: normals.ok_or(PosteriorError::Covariance)?, positions, count })
    }

    /// Scores of all parameters, the others zero, and the logarithm of their prior over the density of the mixture.
    fn draw(&self, number: usize, random: &mut fastrand::Rng) -> (DVector<f64>, f64) {
        let z = normals(self.positions.len(), random);
        let turn = number / FROM_PRIOR + number % FROM_PRIOR;
        let own =
            match (number.is_multiple_of(FROM_PRIOR), self.normals.get(turn % self.normals.len().max(1))) {
                (false, Some((centre, root))) => centre + root * z,
                _ => z,
            };
        let over_prior = |(centre, root): &(DVector<f64>, DMatrix<f64>)| {
            let away = &own - centre;
            let whitened = root.solve_lower_triangular(&away).unwrap_or(away);
            let log = 0.5 * (own.norm_squared() - whitened.norm_squared());
            (log - root.diagonal().map(f64::ln).sum()).exp()
        };
        let mean = self.normals.iter().map(over_prior).sum::<f64>() / self.normals.len().max(1) as f64;
        let part = 1.0 / FROM_PRIOR as f64;
        let mut scores = DVector::zeros(self.count);
        self.positions.iter().zip(own.iter()).for_each(|(&i, g)| scores[i] = *g);
        (scores, -(part + (1.0 - part) * mean).ln())
    }
}
