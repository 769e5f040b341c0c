//! 95 % intervals of activations.
//!
//! The data determine the pull of each muscle relative to the assumed stiffness of the tissue: a stiffer body with more active muscles
//! takes the same shape. So an activation is that of the assumed tissue times a common factor, whose logarithm is normal and independent of
//! the data.
//!
//! For the assumed tissue the posterior is the normal distribution of the linearised response, truncated to activations from 0 to 1. It is
//! drawn by slice sampling (Neal 2003) along its principal axes and along each activation in turn.

use fastrand::Rng;
use nalgebra::{DMatrix, DVector};
use tongue_core::random::normal;

/// Number of draws kept, and of sweeps over all directions between two of them.
const DRAWS: usize = 2000;
const THIN: usize = 4;
/// An interval that begins below this activation begins at 0.
const NONE_BELOW: f64 = 0.01;

/// The interval of each activation, near whose values in `answer` the residuals (in standard deviations) change by the Jacobian; empty
/// where the precision of the posterior is singular. `prior_sd` is the standard deviation of the prior of each activation, whose mean is 0,
/// and `stiffness_sd_ln` that of the logarithm of the common factor.
pub(super) fn intervals_95(
    residuals: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    answer: &DVector<f64>,
    prior_sd: f64,
    stiffness_sd_ln: f64,
) -> Vec<[f64; 2]> {
    let n = answer.len();
    let precision = jacobian.tr_mul(jacobian) + DMatrix::from_diagonal_element(n, n, prior_sd.powi(-2));
    let axes = precision.clone().symmetric_eigen().eigenvectors;
    let unit = DMatrix::identity(n, n);
    let directions = axes.column_iter().chain(unit.column_iter()).map(|d| d.into_owned());
    let directions: Vec<_> = directions.map(|d| (&precision * &d, d)).collect();
    if !directions.iter().all(|(p, d)| p.dot(d) > 0.0) {
        return Vec::new();
    }
    let mut here = answer.map(|a| a.clamp(0.0, 1.0));
    let mut slope = jacobian.tr_mul(&(residuals + jacobian * (&here - answer))) + &here * prior_sd.powi(-2);
    let mut random = Rng::with_seed(1);
    let mut drawn = vec![Vec::with_capacity(DRAWS); n];
    for _ in 0..DRAWS {
        for (by_slope, direction) in std::iter::repeat_n(&directions, THIN).flatten() {
            let (curvature, along) = (by_slope.dot(direction), slope.dot(direction));
            let (middle, level) =
                (-along / curvature, along * along / curvature - 2.0 * (1.0 - random.f64()).ln());
            let half = (level / curvature).sqrt();
            let (mut low, mut high) = (middle - half, middle + half);
            for (a, d) in here.iter().zip(direction.iter()).filter(|(_, d)| **d != 0.0) {
                let ends = [-a / d, (1.0 - a) / d];
                low = low.max(ends[0].min(ends[1]));
                high = high.min(ends[0].max(ends[1]));
            }
            let step = low + (high - low).max(0.0) * random.f64();
            here += direction * step;
            slope += by_slope * step;
        }
        let factor = (stiffness_sd_ln * normal(&mut random)).exp();
        drawn.iter_mut().zip(here.iter()).for_each(|(all, a)| all.push((factor * a).clamp(0.0, 1.0)));
    }
    drawn.into_iter().zip(answer.iter()).map(|(draws, &found)| interval_95(draws, found)).collect()
}

/// The central interval of 95 % of the draws, extended to the activation found. It is the interval from 0 where that is shorter, as for a
/// muscle of which little is known, or where the central one begins near 0 or above the activation found.
fn interval_95(mut draws: Vec<f64>, found: f64) -> [f64; 2] {
    draws.sort_by(f64::total_cmp);
    let [low, from_zero, high] = [0.025, 0.95, 0.975].map(|part| draws[(part * draws.len() as f64) as usize]);
    let begins_at_0 = from_zero < high - low || low < NONE_BELOW || found < low;
    let [low, high] = if begins_at_0 { [0.0, from_zero] } else { [low, high] };
    [low, high.max(found)]
}
