//! Sensitivity of a quantity to the prior of the tensions and to the measurements by power scaling (Kallioinen, Paananen, Bürkner and
//! Vehtari, Statistics and Computing 34, 2024): prior or likelihood is raised to a power slightly above or below one, and the draws are
//! reweighted. The sensitivity is the cumulative Jensen-Shannon distance between weighted and unweighted draws, for a doubling of the
//! power.

use serde::Serialize;

use tongue_core::statistics::mean_and_variance;

use super::parameters::{Draw, Parameter};
use super::problem::PosteriorProblem;
use super::quantiles::shares;

/// Difference of the power from one.
const STEP: f64 = 0.01;
/// Part of the draws that count as independent.
const EFFECTIVE: f64 = 0.4;
/// Distance from which a quantity is called sensitive (Kallioinen and others 2024, section 3.4).
pub const SENSITIVE: f64 = 0.05;

/// Distances by which a distribution moves when a power is doubled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Power of the prior of tensions in the postures and in the baseline.
    pub prior: f64,
    pub likelihood: f64,
    /// First-order change of the probability that the quantity is above zero when the prior's scale doubles, and its standard error.
    #[serde(skip)]
    pub probability_by_scale: [f64; 2],
}

impl Sensitivity {
    /// Whether the prior has a considerable effect, larger than that of the measurements.
    pub(crate) fn is_of_prior(&self) -> bool {
        self.prior >= SENSITIVE && self.prior > self.likelihood
    }
}

/// Weights of all draws for a smaller and a larger power of prior and likelihood.
pub struct Scaled {
    /// Logarithm of the prior less its mean.
    prior_log: Vec<f64>,
    prior: [Vec<f64>; 2],
    likelihood: [Vec<f64>; 2],
}

impl Scaled {
    pub fn new(problem: &PosteriorProblem<'_>, draws: &[Draw]) -> Self {
        let prior = |d: &Draw| -> f64 {
            let each = problem.parameters.iter().map(|p| match *p {
                Parameter::Tension(posture, m) => (d.tension(posture, m) / problem.scale(posture)).powi(2),
                _ => 0.0,
            });
            -0.5 * each.sum::<f64>()
        };
        let mut prior_log: Vec<f64> = draws.iter().map(prior).collect();
        let likelihood_log: Vec<f64> = draws.iter().map(|d| d.log_likelihood).collect();
        let (prior, likelihood) = (weights(&prior_log), weights(&likelihood_log));
        let (mean, _) = mean_and_variance(prior_log.iter().copied());
        prior_log.iter_mut().for_each(|l| *l -= mean);
        Self { prior_log, prior, likelihood }
    }

    /// Sensitivity of a quantity with these values in all draws.
    pub fn evaluate(&self, values: &[f64]) -> Sensitivity {
        // A half-normal prior raised to the power a has its scale divided by the square root of a, so twice the scale is a quarter of the
        // power. The probability changes by the covariance with the prior's logarithm for each unit of ln a.
        let by_scale = -2.0 * std::f64::consts::LN_2;
        let above = values.iter().filter(|v| **v > 0.0).count() as f64 / values.len() as f64;
        let rises = |v: &f64| if *v > 0.0 { 1.0 - above } else { -above };
        let each = values.iter().zip(&self.prior_log).map(|(v, log)| by_scale * rises(v) * log);
        let (mean, variance) = mean_and_variance(each);
        let probability_by_scale = [mean, (variance / (EFFECTIVE * values.len() as f64)).sqrt()];
        let [prior, likelihood] = [&self.prior, &self.likelihood].map(|sides| moved(values, sides));
        Sensitivity { prior, likelihood, probability_by_scale }
    }
}

/// Distance by which the distribution of these values moves when a power is doubled, from the weights for a smaller and a larger power.
pub fn moved(values: &[f64], sides: &[Vec<f64>; 2]) -> f64 {
    sides.iter().map(|w| distance(values, w)).sum::<f64>() / (2.0 * (1.0 + STEP).log2())
}

/// Weights for a smaller and a larger power of a density with these logarithms.
pub fn weights(logs: &[f64]) -> [Vec<f64>; 2] {
    [(1.0 + STEP).recip(), 1.0 + STEP].map(|power| shares(logs.iter().map(|l| l * (power - 1.0))).0)
}

/// Cumulative Jensen-Shannon distance, from 0 to 1, between weighted and equally weighted values (Nguyen and Vreeken 2015).
fn distance(values: &[f64], weights: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let equal = (values.len() as f64).recip();
    // The larger one of the distances in ascending and in descending order, so that the sign of the values does not matter.
    let from = |order: &[usize]| {
        let (mut p, mut q, mut sum, mut bound) = (0.0, 0.0, 0.0, 0.0);
        for pair in order.windows(2) {
            p += equal;
            q += weights[pair[0]];
            let width = (values[pair[1]] - values[pair[0]]).abs();
            let [a, b] = [p, q].map(|a| if a > 0.0 { a * (2.0 * a / (p + q)).log2() } else { 0.0 });
            sum += width * (a + b);
            bound += width * (p + q);
        }
        if bound > 0.0 { (sum / bound).max(0.0) } else { 0.0 }
    };
    let below = from(&order);
    order.reverse();
    below.max(from(&order)).sqrt()
}
