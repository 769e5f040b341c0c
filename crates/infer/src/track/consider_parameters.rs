//! Draws of levels and courses of tensions that include the uncertainty of the shape at rest without fitting it.
//!
//! The problem is linearised once, at the most probable tensions on the placed body. Let `J` be the derivatives by the states `z` of all
//! frames, `D` those by the shared unknowns (`theta`: levels of the muscles, shape at rest, static error), `S` the covariance of the
//! errors and `Q` the precision of the states:
//! ```text
//! A = (J'S^-1 J + Q)^-1 J'S^-1 D        H = P + w sum (D'S^-1 D - D'S^-1 J A)        theta ~ N(-H^-1 g, H^-1)
//! ```
//! Given `theta`, `z` is normal too. Intervals would be too narrow if the most probable shape were searched for together with the
//! tensions of all frames (Neyman and Scott 1948). `w` is less than 1 because the model differs from the recorded tongue.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use tongue_core::random;

use super::eliminate::Eliminated;
use super::shape::RestShape;
use super::smoother::{SmoothedRecording, Smoother};

/// Largest number of frames whose information about levels and shape is counted in full; more frames together count as this many, because
/// more frames do not make the model more like a tongue. If every frame counted, the step to the most probable shape of some hundred frames
/// would be far longer than the range in which its linearisation holds.
const MOST_FRAMES: usize = 120;
/// Number of draws made at once; the second half of them mirrors the first.
pub(super) const BATCH: usize = 50;

/// Draws of the shared unknowns relative to the mode, one column each, from all recordings; `None` where the covariances cannot be
/// factorised.
pub(super) fn draws(
    mode: &Smoother<'_, '_>,
    courses: &[SmoothedRecording],
    linear: &[Eliminated<'_, '_>],
    shape: Option<&RestShape>,
) -> Option<DMatrix<f64>> {
    let frames = courses.iter().map(SmoothedRecording::count).sum();
    SharedPosterior::of(mode, (linear, frames), shape)?.draws(mode)
}

/// Information about the shared unknowns (levels, static error, shape) from the frames and the prior.
struct SharedPosterior {
    /// From the frames, with full weight.
    curvature: DMatrix<f64>,
    gradient: DVector<f64>,
    /// From the prior.
    prior: DMatrix<f64>,
    pull: DVector<f64>,
    /// From both, with the frames weighted by the trust in them, factorised.
    factor: Cholesky<f64, Dyn>,
    /// The most probable values, relative to those at the mode.
    middle: DVector<f64>,
}

impl SharedPosterior {
    /// From linearised recordings with data in so many frames.
    fn of(
        mode: &Smoother<'_, '_>,
        (linear, frames): (&[Eliminated<'_, '_>], usize),
        shape: Option<&RestShape>,
    ) -> Option<Self> {
        let (m, k, s) = (mode.sizes.muscles, mode.sizes.knots, shape.map_or(0, RestShape::count));
        let all = m + k + s;
        let mut curvature = DMatrix::zeros(all, all);
        let mut gradient = DVector::zeros(all);
        for one in linear {
            curvature += &one.curvature;
            gradient += &one.gradient;
        }
        let mut prior = DMatrix::zeros(all, all);
        prior.view_mut((0, 0), (m + k, m + k)).copy_from(&mode.shared_precision);
        let mut pull = DVector::zeros(all);
        pull.rows_mut(0, m + k).copy_from(&(&mode.shared_precision * &mode.shared));
        if let Some(shape) = shape {
            prior.view_mut((m + k, m + k), (s, s)).copy_from(&shape.prior.precision);
            pull.rows_mut(m + k, s).copy_from(&shape.prior.gradient);
        }
        // The static error belongs to the errors, so its prior has the same reduced weight when the shape is estimated.
        let trust = mode.settings.trust;
        let of_frames = trust * (MOST_FRAMES as f64 / frames.max(1) as f64).min(1.0);
        let judged = |i: usize| if (m..m + k).contains(&i) { trust } else { 1.0 };
        let weighed = DMatrix::from_fn(all, all, |i, j| prior[(i, j)] * (judged(i) * judged(j)).sqrt());
        let h = weighed + &curvature * of_frames;
        let g = DVector::from_fn(all, |i, _| pull[i] * judged(i)) + &gradient * of_frames;
        let factor = ((&h + h.transpose()) * 0.5).cholesky()?;
        let middle = -factor.solve(&g);
        Some(Self { curvature, gradient, prior, pull, factor, middle })
    }

    /// Draws of the shared unknowns relative to the mode, one column each.
    fn draws(&self, mode: &Smoother<'_, '_>) -> Option<DMatrix<f64>> {
        let Self { curvature, gradient, prior, pull, factor, middle } = self;
        let (m, k, all) = (mode.sizes.muscles, mode.sizes.knots, middle.len());
        // Given levels and shape, the static error is drawn again with the full weight of the frames.
        let of_error = (curvature.view((m, m), (k, k)) + prior.view((m, m), (k, k))).into_owned();
        let error = if k > 0 { Some(((&of_error + of_error.transpose()) * 0.5).cholesky()?) } else { None };
        let batches = mode.settings.draws.div_ceil(BATCH).max(1);
        let mut out = DMatrix::zeros(all, batches * BATCH);
        for batch in 0..batches {
            let mut random = fastrand::Rng::with_seed(random::seed_of(mode.settings.seed, batch));
            for draw in 0..BATCH / 2 {
                let mut by = random::normals(all, &mut random);
                factor.l_dirty().tr_solve_lower_triangular_mut(&mut by);
                let mut by_error = random::normals(k, &mut random);
                if let Some(error) = &error {
                    error.l_dirty().tr_solve_lower_triangular_mut(&mut by_error);
                }
                for (half, sign) in [(0, 1.0), (BATCH / 2, -1.0)] {
                    let mut theta = middle + &by * sign;
                    if let Some(error) = &error {
                        theta.rows_mut(m, k).fill(0.0);
                        let pulled = curvature * &theta + gradient + pull;
                        let at = -error.solve(&pulled.rows(m, k).into_owned()) + &by_error * sign;
                        theta.rows_mut(m, k).copy_from(&at);
                    }
                    out.column_mut(batch * BATCH + half + draw).copy_from(&theta);
                }
            }
        }
        Some(out)
    }
}
