//! Covariance of the errors, which are the distances between a contour and the surface of a body.
//!
//! ```text
//! slow² exp(-dq²/2/15²) exp(-|dt|/memory) + [same frame] (sd_i sd_j exp(-|dq|/4) + 0.1² [same point])
//!                                         + static² exp(-dq²/2/15²)
//! ```
//! in mm with `q` the distance along the mean contour. A body with a wrong shape has the same errors in every frame, so a part of the
//! error is shared by all frames. The covariance does not depend on the number of points: a contour drawn through more points carries no
//! more information. The errors of one frame have an exponential covariance, because a drawn contour has corners that say nothing about
//! the tongue; a smooth covariance would take them as information.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Covariance of the errors of the observations, lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Standard deviation of the error that is remembered from frame to frame, mm.
    pub slow_mm: f64,
    /// Standard deviation of the error that all frames share, mm.
    pub static_mm: f64,
    /// Correlation length of both along the contour, mm.
    pub far_mm: f64,
    /// Correlation length of the errors of one frame along the contour, mm.
    pub near_mm: f64,
    /// Standard deviation of the independent error of each point, mm.
    pub alone_mm: f64,
}

impl Default for Errors {
    fn default() -> Self {
        Self { slow_mm: 0.7, static_mm: 0.7, far_mm: 15.0, near_mm: 4.0, alone_mm: 0.1 }
    }
}

impl Errors {
    /// Errors for a body of known shape, and points whose errors are independent.
    pub const INDEPENDENT: Self =
        Self { slow_mm: 0.0, static_mm: 0.0, far_mm: 15.0, near_mm: 1e-3, alone_mm: 0.0 };

    /// Covariance of the errors of two observations, mm². `same`: whether they are of one frame (frames are otherwise too far apart to
    /// remember), and whether they are one and the same observation.
    pub fn of_observations(&self, a: &Along, b: &Along, (same_frame, same): (bool, bool)) -> f64 {
        if a.channel != b.channel {
            return 0.0;
        }
        let apart = (a.at_mm - b.at_mm).abs();
        let of_body = self.static_mm.powi(2) * alike(apart, self.far_mm);
        if !same_frame {
            return of_body;
        }
        let own = if same { self.alone_mm.powi(2) } else { 0.0 };
        let of_frame = self.slow_mm.powi(2) * alike(apart, self.far_mm);
        of_body + of_frame + a.sd_mm * b.sd_mm * (-apart / self.near_mm).exp() + own
    }

    /// Total standard deviation of an observation, mm.
    pub fn sd(&self, along: &Along) -> f64 {
        let parts = [self.slow_mm, self.static_mm, self.alone_mm, along.sd_mm];
        parts.iter().map(|p| p * p).sum::<f64>().sqrt()
    }
}

/// Place and error of an observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along {
    /// 0: across the contour; 1 and 2: the two coordinates of a sensor. Errors of different channels are independent.
    pub channel: usize,
    /// Distance along the mean contour, mm.
    pub at_mm: f64,
    /// Standard deviation, mm.
    pub sd_mm: f64,
}

/// Distance between the knots of the slow and the static error, as a part of their correlation length.
const KNOTS_APART: f64 = 0.8;
/// Part of the variance that is added to that of the knots, so that the matrix can be factorised.
const JITTER: f64 = 1e-6;

/// The slow and the static error, as values at a few knots of each channel.
#[derive(Debug, Clone)]
pub(super) struct Knots {
    errors: Errors,
    /// Channel and place of each knot, mm.
    places: Vec<(usize, f64)>,
    /// Correlation of the values at the knots, factorised.
    factor: Option<Cholesky<f64, Dyn>>,
}

fn alike(apart: f64, length: f64) -> f64 {
    (-0.5 * (apart / length).powi(2)).exp()
}

impl Knots {
    /// Knots along all observations.
    pub fn new(errors: Errors, seen: &[&[Along]]) -> Self {
        let mut ends: Vec<(usize, [f64; 2])> = Vec::new();
        for along in seen.iter().copied().flatten() {
            match ends.iter_mut().find(|(c, _)| *c == along.channel) {
                Some((_, [low, high])) => {
                    *low = low.min(along.at_mm);
                    *high = high.max(along.at_mm);
                }
                None => ends.push((along.channel, [along.at_mm; 2])),
            }
        }
        ends.sort_by_key(|(c, _)| *c);
        let mut places = Vec::new();
        if errors.slow_mm > 0.0 || errors.static_mm > 0.0 {
            for (channel, [low, high]) in ends {
                let pieces = ((high - low) / (KNOTS_APART * errors.far_mm)).ceil();
                let apart = if pieces > 0.0 { (high - low) / pieces } else { 0.0 };
                places.extend((0..=pieces as usize).map(|i| (channel, low + apart * i as f64)));
            }
        }
        let n = places.len();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            let same = if i == j { JITTER } else { 0.0 };
            same + correlation(places[i], places[j], errors.far_mm)
        });
        let factor = if n > 0 { Cholesky::new(correlation) } else { None };
        Self { errors, places, factor }
    }

    /// Number of knots.
    pub fn len(&self) -> usize {
        if self.factor.is_some() { self.places.len() } else { 0 }
    }

    /// Precision of the values at the knots for this standard deviation, mm.
    pub fn precision(&self, sd_mm: f64) -> DMatrix<f64> {
        // A standard deviation of zero is replaced by this one, so that the precision is finite.
        const LEAST_MM: f64 = 1e-4;
        let factor = self.factor.as_ref().map_or_else(|| DMatrix::zeros(0, 0), Cholesky::inverse);
        factor / sd_mm.max(LEAST_MM).powi(2)
    }

    /// Coefficients that interpolate the values at the knots to other places, and the part of the variance that remains.
    fn basis(&self, along: &[Along]) -> (DMatrix<f64>, Vec<f64>) {
        let Some(factor) = &self.factor else {
            return (DMatrix::zeros(along.len(), 0), vec![0.0; along.len()]);
        };
        let across = DMatrix::from_fn(self.places.len(), along.len(), |k, i| {
            correlation(self.places[k], (along[i].channel, along[i].at_mm), self.errors.far_mm)
        });
        let weights = factor.solve(&across);
        let left = (0..along.len()).map(|i| (1.0 - across.column(i).dot(&weights.column(i))).max(0.0));
        let left = left.collect();
        (weights.transpose(), left)
    }

    /// Covariance of the remaining errors of a frame, mm².
    fn rest(&self, a: &Along, b: &Along) -> f64 {
        let apart = (a.at_mm - b.at_mm).abs() / self.errors.near_mm;
        if a.channel == b.channel { a.sd_mm * b.sd_mm * (-apart).exp() } else { 0.0 }
    }

    pub fn frame(&self, along: &[Along]) -> Option<FrameErrors> {
        let n = along.len();
        let (basis, left) = self.basis(along);
        let shared = self.errors.slow_mm.powi(2) + self.errors.static_mm.powi(2);
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { self.errors.alone_mm.powi(2) + shared * left[i] } else { 0.0 };
            self.rest(&along[i], &along[j]) + own
        });
        // Independent errors of size zero could not be factorised.
        Some(FrameErrors { factor: Cholesky::new(covariance)?, basis })
    }

    /// Kriging from the observations of a frame to the error at another place.
    pub fn kriging(&self, along: &[Along], errors: &FrameErrors, other: &Along) -> Kriging {
        let across = DVector::from_iterator(along.len(), along.iter().map(|a| self.rest(a, other)));
        let weights = errors.factor.solve(&across);
        let (basis, left) = self.basis(std::slice::from_ref(other));
        let shared = self.errors.slow_mm.powi(2) + self.errors.static_mm.powi(2);
        let own = self.rest(other, other) + self.errors.alone_mm.powi(2) + shared * left[0];
        let variance = (own - across.dot(&weights)).max(0.0);
        let of_knots = basis.row(0).transpose() - errors.basis.tr_mul(&weights);
        Kriging { weights, of_knots, sd_mm: variance.sqrt() }
    }
}

fn correlation(a: (usize, f64), b: (usize, f64), length: f64) -> f64 {
    if a.0 == b.0 { alike(a.1 - b.1, length) } else { 0.0 }
}

#[derive(Debug, Clone)]
pub(super) struct FrameErrors {
    factor: Cholesky<f64, Dyn>,
    /// Coefficients of the values at the knots for every observation.
    pub basis: DMatrix<f64>,
}

impl FrameErrors {
    /// Whitens residuals or their derivatives: their errors become independent with standard deviation 1.
    pub fn whitened(&self, mut values: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.l_dirty().solve_lower_triangular_mut(&mut values);
        values
    }

    /// Standard deviation of an observation without the contribution of the knots, mm.
    pub fn sd(&self, i: usize) -> f64 {
        let l = self.factor.l_dirty();
        (0..=i).map(|k| l[(i, k)].powi(2)).sum::<f64>().sqrt()
    }
}

/// The error at a place that was not observed: `weights . (residuals - basis knots) + row . knots ± sd`.
#[derive(Debug, Clone)]
pub(super) struct Kriging {
    pub weights: DVector<f64>,
    /// Total weights of the values at the knots.
    pub of_knots: DVector<f64>,
    /// Standard deviation of the remaining error, mm.
    pub sd_mm: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(places: &[f64]) -> Vec<Along> {
        places.iter().map(|&at_mm| Along { channel: 0, at_mm, sd_mm: 0.93 }).collect()
    }

    #[test]
    fn knots_and_rest_are_the_covariance_that_is_meant() {
        let errors = Errors::default();
        let seen = along(&[0.0, 5.0, 9.0, 31.0, 44.0, 70.0, 88.0]);
        let knots = Knots::new(errors, &[&seen]);
        let frame = knots.frame(&seen).unwrap();
        let shared = knots.precision(errors.slow_mm).try_inverse().unwrap()
            + knots.precision(errors.static_mm).try_inverse().unwrap();
        let l = frame.factor.l();
        let found = &l * l.transpose() + &frame.basis * shared * frame.basis.transpose();
        for (i, a) in seen.iter().enumerate() {
            for (j, b) in seen.iter().enumerate() {
                let d = a.at_mm - b.at_mm;
                let mut meant = 0.98 * alike(d, 15.0) + 0.93_f64.powi(2) * (-d.abs() / 4.0).exp();
                meant += if i == j { 0.01 } else { 0.0 };
                assert!((found[(i, j)] - meant).abs() < 0.02, "{i} {j}: {} {meant}", found[(i, j)]);
            }
        }
    }

    #[test]
    fn ten_times_the_points_say_no_more_of_a_shift_of_the_contour() {
        // The information of a frame about a shift of the whole contour.
        let information = |count: usize| {
            let seen = along(&(0..count).map(|i| 90.0 * i as f64 / (count - 1) as f64).collect::<Vec<_>>());
            let knots = Knots::new(Errors::default(), &[&seen]);
            let frame = knots.frame(&seen).unwrap();
            let shift = frame.whitened(DMatrix::from_element(count, 1, 1.0));
            let with = frame.whitened(frame.basis.clone());
            let shared = knots.precision(0.7) * 0.5 + with.tr_mul(&with);
            let across = with.tr_mul(&shift);
            (shift.tr_mul(&shift) - across.tr_mul(&shared.cholesky().unwrap().solve(&across)))[(0, 0)]
        };
        let (few, many) = (information(11), information(101));
        assert!((many / few - 1.0).abs() < 0.15, "{few} {many}");
    }

    #[test]
    fn kriging_is_the_conditional_normal_distribution() {
        let seen = along(&[0.0, 8.0, 16.0, 30.0]);
        let other = Along { channel: 0, at_mm: 11.0, sd_mm: 0.93 };
        let knots = Knots::new(Errors { slow_mm: 0.0, static_mm: 1e-6, ..Errors::default() }, &[&seen]);
        let frame = knots.frame(&seen).unwrap();
        let found = knots.kriging(&seen, &frame, &other);
        let k = |a: &Along, b: &Along| knots.rest(a, b) + if a == b { 0.01 } else { 0.0 };
        let covariance = DMatrix::from_fn(4, 4, |i, j| k(&seen[i], &seen[j]));
        let across = DVector::from_fn(4, |i, _| k(&seen[i], &other));
        let weights = covariance.try_inverse().unwrap() * &across;
        assert!((&found.weights - &weights).amax() < 1e-9);
        let variance = k(&other, &other) - across.dot(&weights);
        assert!((found.sd_mm - variance.sqrt()).abs() < 1e-9);
    }
}
