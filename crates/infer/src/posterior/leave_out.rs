//! Predictions of every measured stretch from the other measurements.
//!
//! Reweighted draws of the whole posterior would be biased towards the measurement, which its covariance due to geometry has used too. So
//! one run samples a mixture, in equal parts, of the posteriors that each leave out one stretch (Silva and Zanella, Journal of the American
//! Statistical Association 119, 2024):
//!
//! ```text
//! q(g) = N(g; 0, I) sum over i of N(y_-i; s(g), C_i) / Z_i
//! ```
//! `C_i` has the covariance due to geometry about the mode without stretch i, and `Z_i` is the marginal density of the other stretches by
//! Laplace's approximation. The weight of a draw for stretch i is the share of term i in the sum; as no share exceeds one, the weights have
//! no heavy tail and need no smoothing. Where the effective number of draws is too small, the posterior without that stretch is sampled.

use nalgebra::{DMatrix, DVector};

use tongue_core::parallel;
use tongue_core::random::{normals, seed_of};

use super::PosteriorError;
use super::hmc::Whitened;
use super::map::MapEstimate;
use super::parameters::Draw;
use super::problem::PosteriorProblem;
use super::quantiles::{Quantiles, effective, shares};
use super::run::{Posterior, Sampling, chains, numbered};
use super::score::{LeftOut, MixtureComponent, PredictionMethod, conditional, left_out};
use super::surrogate::{ResidualLikelihood, Surrogate};

/// Draws of the mixture for each stretch of a posture, and draws of a posterior that is sampled separately. Postures that are sampled
/// together have as many draws as one, because leaving one of many stretches out changes little.
const DRAWS_EACH: usize = 200;
const OWN_DRAWS: usize = 800;
/// Smallest effective number of draws of the mixture for a stretch.
const LEAST_EFFECTIVE: f64 = 50.0;
/// Fixed, so that a fit, a batch and a validation report the same predictions.
const SEED: u64 = 5;

struct Without<'a> {
    problem: PosteriorProblem<'a>,
    map_estimate: MapEstimate,
    /// Minus the logarithm of the marginal density, up to a constant.
    weight: f64,
}

impl<'a> Without<'a> {
    fn new(
        whole: &PosteriorProblem<'a>,
        map_estimate: &MapEstimate,
        position: usize,
    ) -> Result<Self, PosteriorError> {
        let mut problem = whole.with_measurements(whole.measurements.without(position))?;
        let map_estimate = MapEstimate::find_near(&mut problem, map_estimate)?;
        let factor = map_estimate.precision.clone().cholesky().ok_or(PosteriorError::Covariance)?;
        let weight = factor.l_dirty().diagonal().map(f64::ln).sum() - map_estimate.log;
        Ok(Self { problem, map_estimate, weight })
    }
}

/// The posteriors that each leave out one stretch, in the order of the stretches.
struct Mixture<'a>(Vec<Without<'a>>);

impl Mixture<'_> {
    /// Logarithms of the terms at these residuals, and minus their derivatives by the residuals.
    fn parts(&self, residuals: &DVector<f64>) -> Vec<(f64, DVector<f64>)> {
        Vec::from_iter(self.0.iter().enumerate().map(|(position, without)| {
            let (log, weighted) = without.problem.log(&residuals.clone().remove_row(position));
            (log + without.weight, weighted.insert_row(position, 0.0))
        }))
    }
}

impl ResidualLikelihood for Mixture<'_> {
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>) {
        let parts = self.parts(residuals);
        let (shares, log) = shares(parts.iter().map(|p| p.0));
        let zero = DVector::zeros(residuals.len());
        (log, parts.into_iter().zip(shares).fold(zero, |sum, ((_, weighted), share)| sum + weighted * share))
    }
}

/// Predictions of every measured stretch from the other measurements.
pub fn predict_each_from_others(
    problem: &PosteriorProblem<'_>,
    map_estimate: &MapEstimate,
) -> Result<Vec<LeftOut>, PosteriorError> {
    let positions: Vec<usize> = (0..problem.measurements.stretches.len()).collect();
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    let all = parallel::map(&positions, |&position| Without::new(problem, map_estimate, position));
    let mixture = Mixture(all.into_iter().collect::<Result<_, PosteriorError>>()?);
    let count = positions.len() as f64;
    let modes = mixture.0.iter().map(|without| &without.map_estimate);
    let centre = modes.clone().map(|m| &m.scores).sum::<DVector<f64>>() / count;
    let n = centre.len();
    let precision = modes.fold(DMatrix::zeros(n, n), |sum, m| sum + &m.precision) / count;
    let whitened = Whitened::new(centre, precision).ok_or(PosteriorError::Covariance)?;
    let postures = problem.postures();
    let settings = Sampling { draws: DRAWS_EACH * positions.len() / postures, seed: SEED };
    let surrogate = Surrogate::refined(problem, &mixture, &whitened)?;
    let thin = postures.min(2);
    let draws = numbered(chains(problem, &mixture, &surrogate, &whitened, &settings, thin));
    let weights: Vec<Vec<f64>> = draws
        .iter()
        .map(|d| {
            let residuals = problem.residuals(&d.lengths, &d.auxiliary);
            shares(mixture.parts(&residuals).iter().map(|p| p.0)).0
        })
        .collect();
    let each = mixture.0.into_iter().enumerate().map(|(position, without)| {
        let own: Vec<f64> = weights.iter().map(|w| w[position]).collect();
        let count = effective(&own);
        if count >= LEAST_EFFECTIVE {
            let how = (PredictionMethod::Together, count);
            return Ok(predicted(problem, position, &without.problem, (&draws, &own), how));
        }
        let settings = Sampling { draws: OWN_DRAWS, seed: SEED };
        let own = without.problem.posterior_about(without.map_estimate, &settings)?;
        let (weights, ess) = (vec![1.0; own.draws.len()], own.diagnostics.ess);
        let how = (PredictionMethod::Sampled, ess.bulk.min(ess.tail));
        Ok(predicted(problem, position, &own.problem, (&own.draws, &weights), how))
    });
    each.collect()
}

/// The prediction of a stretch from weighted draws; `other` leaves the stretch out, `whole` includes it, and `how` has the method and the
/// effective number of draws.
fn predicted(
    whole: &PosteriorProblem<'_>,
    position: usize,
    other: &PosteriorProblem<'_>,
    (draws, weights): (&[Draw], &[f64]),
    how: (PredictionMethod, f64),
) -> LeftOut {
    let (row, measured) = (whole.rows[position], whole.measurements.stretches[position].value);
    let (gain, sd) = conditional(whole, other, position);
    let parts: Vec<MixtureComponent> = Vec::from_iter(draws.iter().zip(weights).map(|(d, &weight)| {
        let error = gain.dot(&other.residuals(&d.lengths, &d.auxiliary));
        MixtureComponent { mean: d.stretch(row) + error, weight }
    }));
    left_out(&parts, sd, measured, how, seed_of(SEED, position))
}

/// The stretches of the model, corrected by the error of its geometry given the measurements.
pub fn fitted_stretches(posterior: &Posterior<'_>, seed: u64) -> Vec<Quantiles> {
    let problem = &posterior.problem;
    let rows = &problem.rows;
    let stretches = &rows[..problem.measurements.stretches.len()];
    if stretches.is_empty() {
        return Vec::new();
    }
    let geometry = problem.select_measured(&problem.geometry);
    let gain = &geometry * &problem.precision;
    let left = &geometry - &gain * &geometry;
    // If the geometry has no errors, the matrix is nearly singular, and rounding can make an eigenvalue slightly negative.
    let eigen = ((&left + left.transpose()) * 0.5).symmetric_eigen();
    let roots = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
    let root = &eigen.eigenvectors * roots;
    let mut random = fastrand::Rng::with_seed(seed);
    let mut all = vec![Vec::with_capacity(posterior.draws.len()); stretches.len()];
    for d in &posterior.draws {
        let residuals = problem.residuals(&d.lengths, &d.auxiliary);
        let error = &gain * residuals + &root * normals(rows.len(), &mut random);
        for (i, &row) in stretches.iter().enumerate() {
            all[i].push(d.stretch(row) + error[i]);
        }
    }
    all.into_iter().map(Quantiles::of).collect()
}
