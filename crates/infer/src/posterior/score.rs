//! Predictive distributions and scores of a measured stretch.

use nalgebra::DVector;
use serde::Serialize;

use tongue_core::random::normal;

use super::problem::PosteriorProblem;
use super::quantiles::Quantiles;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PredictionMethod {
    /// Weighted draws of the mixture of all posteriors that each leave out one stretch.
    Together,
    /// Draws of the posterior without this stretch.
    Sampled,
}

/// Prediction of a stretch without its own measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    pub spread: Quantiles,
    pub log_score: f64,
    /// Continuous ranked probability score (Gneiting and Raftery 2007).
    pub crps: f64,
    pub how: PredictionMethod,
    pub effective: f64,
}

/// The normal distribution of a stretch given a draw, without its common standard deviation.
#[derive(Debug, Clone, Copy)]
pub struct MixtureComponent {
    pub mean: f64,
    pub weight: f64,
}

/// The prediction by a mixture of normal distributions of one standard deviation, whose draws are worth `effective` independent ones.
pub fn left_out(
    parts: &[MixtureComponent],
    sd: f64,
    measured: f64,
    (how, effective): (PredictionMethod, f64),
    seed: u64,
) -> LeftOut {
    let mut random = fastrand::Rng::with_seed(seed);
    let draws: Vec<(f64, f64)> =
        parts.iter().map(|p| (p.mean + sd * normal(&mut random), p.weight)).collect();
    let total: f64 = parts.iter().map(|p| p.weight).sum();
    let densities = parts.iter().map(|p| {
        let z = (measured - p.mean) / sd;
        p.weight * (-0.5 * z * z).exp() / (sd * std::f64::consts::TAU.sqrt())
    });
    let density = densities.sum::<f64>() / total;
    LeftOut {
        crps: crps(&draws, measured),
        spread: Quantiles::weighted(draws, effective),
        log_score: density.max(f64::MIN_POSITIVE).ln(),
        how,
        effective,
    }
}

/// `E|x - y| - E|x - x'|/2` of weighted draws.
fn crps(draws: &[(f64, f64)], measured: f64) -> f64 {
    let mut sorted = draws.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|d| d.1).sum();
    let near = sorted.iter().map(|d| d.1 * (d.0 - measured).abs()).sum::<f64>() / total;
    // The sum over all pairs is that of the gaps between neighbours times the weights on both sides.
    let (mut below, mut apart) = (0.0, 0.0);
    for pair in sorted.windows(2) {
        below += pair[0].1 / total;
        apart += (pair[1].0 - pair[0].0) * below * (1.0 - below);
    }
    near - apart
}

/// Normal distribution of a stretch's error given the other residuals: their coefficients in its mean, and its standard deviation. `other`
/// leaves out the stretch at `position` of `whole`.
pub fn conditional(
    whole: &PosteriorProblem<'_>,
    other: &PosteriorProblem<'_>,
    position: usize,
) -> (DVector<f64>, f64) {
    let (row, errors) = (whole.rows[position], whole.discrepancies() + whole.rounding());
    let across = DVector::from_fn(other.rows.len(), |i, _| {
        let in_whole = if i < position { i } else { i + 1 };
        other.geometry[(other.rows[i], row)] + errors[(in_whole, position)]
    });
    let gain = other.factor.solve(&across);
    let own = other.geometry[(row, row)] + errors[(position, position)];
    let variance = own - gain.dot(&across);
    (gain, variance.max(f64::MIN_POSITIVE).sqrt())
}
