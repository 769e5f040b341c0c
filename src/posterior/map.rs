//! The most probable scores, by a damped Gauss-Newton method with exact derivatives, and the covariance of geometry there.

use nalgebra::{DMatrix, DVector};

use super::PosteriorError;
use super::density::{Density, Linear, Place};
use super::hmc::Whitened;

/// The most probable point.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Scores.
    pub scores: DVector<f64>,
    /// Where it was solved.
    pub place: Place,
    /// How the stretches answer there.
    pub linear: Linear,
    /// `I + Jᵀ C⁻¹ J` there.
    pub precision: DMatrix<f64>,
    /// Logarithm of the density there, up to a constant.
    pub log: f64,
    /// Linearisations.
    pub evaluations: usize,
}

/// Most steps from one point.
const MOST_STEPS: usize = 40;
/// A step that is shorter, in scores, has arrived.
const ARRIVED: f64 = 1e-4;
/// No step is longer, in scores: tensions answer in straight lines only so far.
const LONGEST: f64 = 2.0;
/// Times that the covariance of geometry is taken at the mode and the mode sought anew.
const ROUNDS: usize = 3;

impl Mode {
    /// Finds the mode; leaves in the density the covariance of geometry at it.
    ///
    /// # Errors
    /// [`PosteriorError::NoMode`] where no equilibrium is found.
    pub fn find(density: &mut Density<'_>) -> Result<Self, PosteriorError> {
        // From the medians, or below them where there is no equilibrium at such tensions.
        let n = density.parameters.len();
        let mut found = Err(PosteriorError::NoMode);
        for score in [0.0, -1.0, -2.0, -3.0, -4.0] {
            found = Self::find_from(density, &DVector::from_element(n, score), &density.rest());
            if found.is_ok() {
                break;
            }
        }
        found
    }

    /// The same, from given scores that were solved at a place.
    ///
    /// # Errors
    /// As [`Mode::find`].
    pub fn find_from(
        density: &mut Density<'_>,
        start: &DVector<f64>,
        place: &Place,
    ) -> Result<Self, PosteriorError> {
        let (linear, place) = density.evaluator().linearise(start, place).ok_or(PosteriorError::NoMode)?;
        density.set_geometry(linear.covariance())?;
        let mut mode = Self::at(density, start.clone(), linear, place, 1);
        for _ in 0..ROUNDS {
            let moved = mode.climb(density)?;
            if !density.ground.is_of_springs() {
                let found = density.evaluator().linearise(&mode.scores, &mode.place);
                (mode.linear, mode.place) = found.ok_or(PosteriorError::NoMode)?;
            }
            density.set_geometry(mode.linear.covariance())?;
            if moved < 10.0 * ARRIVED {
                break;
            }
        }
        Ok(Self::at(density, mode.scores, mode.linear, mode.place, mode.evaluations))
    }

    fn at(
        density: &Density<'_>,
        scores: DVector<f64>,
        linear: Linear,
        place: Place,
        evaluations: usize,
    ) -> Self {
        let jacobian = linear.jacobian.select_rows(&density.seen.muscles);
        let n = scores.len();
        let precision = DMatrix::identity(n, n) + jacobian.tr_mul(&density.factor().solve(&jacobian));
        let residuals = density.residuals(&place.lengths, &place.baseline_lengths);
        let log = -0.5 * (residuals.dot(&density.factor().solve(&residuals)) + scores.norm_squared());
        Self { scores, place, linear, precision, log, evaluations }
    }

    /// Goes to the mode with the covariance as it is; how far it came.
    fn climb(&mut self, density: &Density<'_>) -> Result<f64, PosteriorError> {
        let mut evaluator = density.evaluator();
        let begin = self.scores.clone();
        let (mut scores, place) = (self.scores.clone(), self.place.clone());
        let mut here = Self::at(density, scores.clone(), self.linear.clone(), place, self.evaluations);
        let mut damping = 0.0;
        for _ in 0..MOST_STEPS {
            let jacobian = here.linear.jacobian.select_rows(&density.seen.muscles);
            let residuals = density.residuals(&here.place.lengths, &here.place.baseline_lengths);
            let gradient = jacobian.tr_mul(&density.factor().solve(&residuals)) - &scores;
            let mut matrix = here.precision.clone();
            (0..scores.len()).for_each(|i| matrix[(i, i)] += damping);
            let Some(factor) = matrix.cholesky() else { break };
            let mut step = factor.solve(&gradient);
            let longest = step.amax();
            if longest > LONGEST {
                step *= LONGEST / longest;
            }
            if step.amax() < ARRIVED {
                break;
            }
            let next = &scores + &step;
            let found = evaluator.linearise_all(&next, &here.place, false);
            here.evaluations += 1;
            let found =
                found.map(|(linear, place)| Self::at(density, next.clone(), linear, place, here.evaluations));
            match found {
                Some(there) if there.log > here.log => {
                    (scores, here) = (next, there);
                    damping *= 0.2;
                }
                _ => {
                    damping = (4.0 * damping).max(0.5);
                    if damping > 1e8 {
                        break;
                    }
                }
            }
        }
        let moved = (&here.scores - begin).amax();
        *self = here;
        Ok(moved)
    }

    /// Coordinates in which the posterior is nearly a round normal distribution.
    pub fn whitened(&self) -> Option<Whitened> {
        Whitened::new(self.scores.clone(), self.precision.clone())
    }
}
