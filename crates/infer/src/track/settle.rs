//! The tensions of a single frame under a half-normal prior, as used in the search for a rest shape.

use nalgebra::{Cholesky, DMatrix, DVector, SVector};

use super::frame::{Frame, Linear, Solver};
use super::mode::FEWEST;
use super::scores;

/// Longest step of a score: the linear response of the tensions holds only so far.
const LONGEST_STEP: f64 = 1.2;
/// The search has converged when a step of the scores is shorter than this: a hundredth of a standard deviation of the prior.
pub(crate) const ARRIVED: f64 = 1e-2;

/// Prior of the scores of all muscles.
#[derive(Debug, Clone, PartialEq)]
pub struct CoursePrior {
    /// Scale of the half-normal tensions, N per metre of thickness.
    pub scale_n: f64,
    /// Mean of the scores.
    pub mean: DVector<f64>,
    /// Covariance of the scores.
    pub covariance: DMatrix<f64>,
    /// Time over which a score is remembered, s; 0: frames are independent.
    pub memory_s: f64,
}

impl CoursePrior {
    /// Independent half-normal tensions of one scale.
    pub fn half_normal(muscles: usize, scale_n: f64, memory_s: f64) -> Self {
        Self {
            scale_n,
            mean: DVector::zeros(muscles),
            covariance: DMatrix::identity(muscles, muscles),
            memory_s,
        }
    }

    /// The inverse of the covariance.
    pub(crate) fn precision(&self) -> DMatrix<f64> {
        let n = self.mean.len();
        Cholesky::new(self.covariance.clone()).map_or_else(|| DMatrix::identity(n, n), |c| c.inverse())
    }
}

impl Solver<'_> {
    /// The scores with the smallest cost of a single frame with the prior, by the Levenberg-Marquardt method from given scores and
    /// positions. Returns the scores, the frame there and the cost; `None` where there is no equilibrium at the start.
    pub(crate) fn settle(
        &mut self,
        frame: &Frame,
        x: &DVector<f64>,
        from: Option<&[SVector<f64, 2>]>,
        prior: &CoursePrior,
        precision: &DMatrix<f64>,
        (steps, arrived): (usize, f64),
    ) -> Option<(DVector<f64>, Linear, f64)> {
        let away = |x: &DVector<f64>| x - &prior.mean;
        let priced = |linear: &Linear, x: &DVector<f64>| {
            let d = away(x);
            linear.residuals.norm_squared() + d.dot(&(precision * &d))
        };
        if frame.observations.len() < FEWEST {
            return None;
        }
        let mut x = x.clone();
        let mut linear = self.linearise(frame, &x, from)?;
        let mut cost = priced(&linear, &x);
        let mut damping = 0.0;
        for _ in 0..steps {
            let mut curvature = linear.jacobian.tr_mul(&linear.jacobian) + precision;
            (0..x.len()).for_each(|i| curvature[(i, i)] += damping);
            let pull = linear.jacobian.tr_mul(&linear.residuals) + precision * away(&x);
            let Some(factors) = curvature.cholesky() else { break };
            let next = stepped(&x, &-factors.solve(&pull));
            let step = (&next - &x).amax();
            match self.linearise(frame, &next, Some(&linear.positions)) {
                Some(there) if priced(&there, &next) < cost => {
                    cost = priced(&there, &next);
                    (x, linear) = (next, there);
                    damping *= 0.2;
                }
                _ => damping = (damping * 6.0).max(1.0),
            }
            if step < arrived || damping > 1e6 {
                break;
            }
        }
        Some((x, linear, cost))
    }
}

/// The scores after a step, which is shortened if it is too long.
fn stepped(x: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
    let cut = (LONGEST_STEP / step.amax().max(LONGEST_STEP)).min(1.0);
    (x + step * cut).map(|g| g.clamp(scores::LOWEST, scores::HIGHEST))
}
