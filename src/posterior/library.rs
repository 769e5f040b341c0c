//! Postures and baselines drawn from the priors and solved once: weighed, they are draws of the posterior of any row of a table, and of
//! any row without one of its muscles.
//!
//! A stretch is the length of a posture over that of a baseline, and neither knows which row it is compared with. So few postures and
//! baselines, each solved once in lanes, make many pairs; each counts as much as the stretches of a row are probable there.

use nalgebra::DMatrix;

use crate::random::{normals, seed_of};

use super::PosteriorError;
use super::density::{Density, Parameter, Seen, is_found};
use super::ground::Ground;
use super::score::{Part, about};
use super::spread::effective;

/// How many are solved, and how many pairs they make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Postures.
    pub postures: usize,
    /// Baselines.
    pub baselines: usize,
    /// Pairs.
    pub pairs: usize,
}

impl Default for Size {
    fn default() -> Self {
        Self { postures: 20_000, baselines: 4_000, pairs: 500_000 }
    }
}

/// Pairs of solved postures and baselines.
#[derive(Debug)]
pub struct Library {
    /// Lengths of all muscles of the body, m, posture after posture.
    postures: Vec<f64>,
    /// One over the lengths in the baselines, 1/m.
    baselines: Vec<f64>,
    muscles: usize,
    pairs: Vec<[u32; 2]>,
    /// Draws of the priors without an equilibrium: their density is zero.
    pub folds: usize,
}

/// A pair of less weight than this part of the heaviest counts for nothing.
const NOTHING: f64 = 1e-10;

/// Seed of the library that rows share.
const SEED: u64 = 1;

impl Ground {
    /// The library that all rows share; made when first asked for, which is to be before work on several rows at once begins: it is
    /// made on all threads.
    ///
    /// # Errors
    /// As [`Library::new`].
    pub fn library(&self) -> Result<&Library, PosteriorError> {
        let made = self.shared.get_or_init(|| Library::new(self, Size::default(), SEED));
        made.as_ref().map_err(Clone::clone)
    }
}

impl Library {
    /// Draws and solves; the bits do not depend on threads.
    ///
    /// # Errors
    /// As [`Density::new`].
    pub fn new(ground: &Ground, size: Size, seed: u64) -> Result<Self, PosteriorError> {
        let nothing = Seen { names: vec![], muscles: vec![], stretches: vec![], rounding: vec![] };
        let density = Density::new(ground, nothing)?;
        let n = density.parameters.len();
        let solved = |count: usize, first: usize, tones: bool| -> Vec<Option<Vec<f64>>> {
            let meaning = |i: usize| {
                let mut random = fastrand::Rng::with_seed(seed_of(seed, first + i));
                density.meaning(&normals(n, &mut random)).0
            };
            let load = |i: usize| match tones {
                true => density.baseline(&meaning(i), None),
                false => density.posture(&meaning(i), None),
            };
            density.lanes().map(count, density.settings(), load, |_, shape| {
                is_found(shape).then(|| ground.system.lengths(&shape.positions))
            })
        };
        let fixed = !density.parameters.iter().any(|p| matches!(p, Parameter::Tone(_)));
        let postures = solved(size.postures, 0, false);
        let baselines = solved(if fixed { 1 } else { size.baselines }, 1 << 30, true);
        let folds = postures.iter().chain(&baselines).filter(|l| l.is_none()).count();
        let postures: Vec<Vec<f64>> = postures.into_iter().flatten().collect();
        let baselines: Vec<Vec<f64>> = baselines.into_iter().flatten().collect();
        if postures.is_empty() || baselines.is_empty() {
            return Err(PosteriorError::NoMode);
        }
        let mut random = fastrand::Rng::with_seed(seed_of(seed, 1 << 31));
        let pair = |k: usize| [(k % postures.len()) as u32, random.usize(0..baselines.len()) as u32];
        Ok(Self {
            pairs: (0..size.pairs).map(pair).collect(),
            muscles: ground.muscles.len(),
            postures: postures.concat(),
            baselines: baselines.concat().into_iter().map(f64::recip).collect(),
            folds,
        })
    }

    /// The stretch of a muscle in a pair.
    fn stretch(&self, [posture, baseline]: [u32; 2], muscle: usize) -> f64 {
        self.postures[posture as usize * self.muscles + muscle]
            * self.baselines[baseline as usize * self.muscles + muscle]
    }

    /// Logarithms of the densities of what was seen at every pair.
    fn logs(&self, density: &Density<'_>) -> Vec<f64> {
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
        let mut log = |pair: &[u32; 2]| {
            for (r, (y, &m)) in residual.iter_mut().zip(seen.stretches.iter().zip(&seen.muscles)) {
                *r = y - self.stretch(*pair, m);
            }
            let (mut at, mut sum) = (0, 0.0);
            for i in 0..n {
                let dot: f64 = rows[at..=at + i].iter().zip(&residual[..=i]).map(|(a, b)| a * b).sum();
                sum += dot * dot;
                at += i + 1;
            }
            constant - 0.5 * sum
        };
        self.pairs.iter().map(&mut log).collect()
    }

    /// Logarithm of the marginal density of what was seen, and the effective number of pairs.
    pub fn evidence(&self, density: &Density<'_>) -> (f64, f64) {
        let logs = self.logs(density);
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = logs.iter().map(|l| (l - most).exp()).collect();
        (most + (weights.iter().sum::<f64>() / weights.len() as f64).ln(), effective(&weights))
    }

    /// What pairs say of the stretch of a muscle of the body that `density` has not seen, measured with a variance `rounding`: normal parts,
    /// their standard deviation, and the effective number of pairs.
    pub fn predict(&self, density: &Density<'_>, muscle: usize, rounding: f64) -> (Vec<Part>, f64, f64) {
        let logs = self.logs(density);
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (gain, sd) = about(density, muscle, rounding);
        let seen = &density.seen;
        let part = |(pair, log): (&[u32; 2], &f64)| {
            let weight = (log - most).exp();
            (weight > NOTHING).then(|| {
                let each = gain.iter().zip(seen.stretches.iter().zip(&seen.muscles));
                let error: f64 = each.map(|(g, (y, &m))| g * (y - self.stretch(*pair, m))).sum();
                Part { mean: self.stretch(*pair, muscle) + error, weight }
            })
        };
        let parts: Vec<Part> = self.pairs.iter().zip(&logs).filter_map(part).collect();
        let weights: Vec<f64> = parts.iter().map(|p| p.weight).collect();
        let effective = effective(&weights);
        (parts, sd, effective)
    }
}
