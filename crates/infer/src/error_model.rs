//! Covariance of the errors, the distances between a contour and the surface of a body.
//!
//! ```text
//! slow² exp(-dq²/2/15²) exp(-|dt|/memory) + static² exp(-dq²/2/15²) + [same point] sd² max(1, 9 mm/spacing) max(1, 12.5 ms/period)
//! ```
//! in mm with `q` the distance along the mean contour. A body with a wrong shape has the same errors in every frame, so a part of the error
//! is shared by all frames. The own error of a point is white along the contour and in time: closer points or frames than 9 mm and 12.5 ms
//! carry no more information than points and frames at these distances. Many points of a contour are averaged over 9 mm, because a drawn
//! contour contains no information between its keypoints.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::standard_deviations as sd;
use tongue_core::geometry::Point;

/// Covariance of the errors of the observations, lengths in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorModel {
    /// Standard deviation of the error that decays from frame to frame, mm.
    pub slow_mm: f64,
    /// Standard deviation of the error that all frames share, mm.
    pub static_mm: f64,
    /// Distance along the contour of points with independent own errors, mm.
    pub apart_mm: f64,
    /// Time between frames with independent own errors, s.
    pub apart_s: f64,
}

impl Default for ErrorModel {
    fn default() -> Self {
        Self {
            slow_mm: sd::SLOW_MM,
            static_mm: sd::STATIC_MM,
            apart_mm: sd::POINTS_APART_MM,
            apart_s: sd::FRAMES_APART_S,
        }
    }
}

impl ErrorModel {
    /// For a body of known shape, and points whose errors are independent.
    pub const INDEPENDENT: Self = Self { slow_mm: 0.0, static_mm: 0.0, apart_mm: 0.0, apart_s: 0.0 };

    /// Covariance of two observations' errors by the shape of the body, mm²; without `same_frame` their slow errors are independent.
    pub fn of_body(&self, a: &Along, b: &Along, same_frame: bool) -> f64 {
        let slow = if same_frame { self.slow_mm.powi(2) } else { 0.0 };
        (slow + self.static_mm.powi(2)) * correlation(a, b, sd::ERRORS_FAR_MM)
    }

    /// Variance of the own error of an observation without neighbours, mm². `period_s`: time between frames.
    fn alone(&self, along: &Along, period_s: f64) -> f64 {
        along.sd_mm.powi(2) * (self.apart_s / period_s).max(1.0)
    }

    /// Variances of the own errors of the observations of a frame, mm²; contour points are in order along the contour.
    pub fn own(&self, along: &[Along], period_s: f64) -> Vec<f64> {
        let on_contour: Vec<f64> = along.iter().filter(|a| a.channel == 0).map(|a| a.at_mm).collect();
        let last = on_contour.len().saturating_sub(1);
        let mut numbers = 0..;
        Vec::from_iter(along.iter().map(|a| {
            let number = if a.channel == 0 { numbers.next() } else { None };
            let apart = number.filter(|_| last > 0).map_or(f64::INFINITY, |i: usize| {
                let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
                (on_contour[after] - on_contour[before]).abs() / (after - before) as f64
            });
            // Points at one place together carry the information of one point.
            self.alone(a, period_s) * (self.apart_mm / apart).clamp(1.0, on_contour.len().max(1) as f64)
        }))
    }

    /// Matrix that replaces the many points of a contour by averages at places [`ErrorModel::apart_mm`] apart; the weight of a point falls
    /// linearly to zero at the next place. Other observations are kept. `None` for a contour of few points.
    fn averages(&self, along: &[Along]) -> Option<DMatrix<f64>> {
        let on_contour = || along.iter().filter(|a| a.channel == 0).map(|a| a.at_mm);
        let [low, high] =
            [on_contour().fold(f64::INFINITY, f64::min), on_contour().fold(f64::NEG_INFINITY, f64::max)];
        let pieces = ((high - low) / self.apart_mm).round();
        if !pieces.is_finite() || on_contour().count() as f64 <= MANY * (pieces + 1.0) {
            return None;
        }
        let apart = (high - low) / pieces.max(1.0);
        let others = (0..along.len()).filter(|&i| along[i].channel != 0);
        let rows: Vec<Vec<f64>> = (0..=pieces as usize)
            .filter_map(|k| {
                let weights: Vec<f64> = Vec::from_iter(along.iter().map(|a| {
                    let away = if apart > 0.0 { ((a.at_mm - low) / apart - k as f64).abs() } else { 0.0 };
                    if a.channel == 0 { (1.0 - away).max(0.0) } else { 0.0 }
                }));
                let sum: f64 = weights.iter().sum();
                (sum > 0.0).then(|| weights.iter().map(|w| w / sum).collect::<Vec<f64>>())
            })
            .chain(others.map(|i| (0..along.len()).map(|j| f64::from(u8::from(i == j))).collect()))
            .collect();
        Some(DMatrix::from_fn(rows.len(), along.len(), |i, j| rows[i][j]))
    }

    /// The averages that replace the observations of a frame (`None`: there are none), and the variances of the own errors of what is left,
    /// mm². `others` are added to the variances of the observations, mm².
    pub(crate) fn in_frame(
        &self,
        along: &[Along],
        period_s: f64,
        others: &DVector<f64>,
    ) -> (Option<DMatrix<f64>>, DVector<f64>) {
        let Some(averages) = self.averages(along) else {
            return (None, DVector::from(self.own(along, period_s)) + others);
        };
        let alone: Vec<f64> = along.iter().map(|a| self.alone(a, period_s)).collect();
        let variances = &averages * (DVector::from(alone) + others);
        (Some(averages), variances)
    }

    /// Standard deviation of a point, mm.
    pub fn sd(&self, along: &Along) -> f64 {
        let parts = [self.slow_mm, self.static_mm, along.sd_mm];
        parts.iter().map(|p| p * p).sum::<f64>().sqrt()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Along {
    /// 0: across the contour; 1 and 2: the coordinates of a sensor. Errors of different channels are independent.
    pub channel: usize,
    /// Distance along the mean contour, mm.
    pub at_mm: f64,
    pub sd_mm: f64,
}

/// Length of the polyline from its first point to each point, times `per_m` (1e3: in mm). A point that was not measured gets the value of
/// the point before it.
pub(crate) fn distances_along(points: impl IntoIterator<Item = Option<Point>>, per_m: f64) -> Vec<f64> {
    let (mut last, mut along): (Option<Point>, f64) = (None, 0.0);
    Vec::from_iter(points.into_iter().map(|point| {
        along += point.zip(last).map_or(0.0, |(a, b)| (a - b).norm() * per_m);
        last = point.or(last);
        along
    }))
}

/// A contour is averaged if it has more than this many times as many points as independent ones.
const MANY: f64 = 1.5;
/// Distance between the knots of the slow and the static error, as a part of the correlation length.
const KNOTS_APART: f64 = 0.8;
/// Relative addition to the variances at the knots that makes their correlation positive definite.
const JITTER: f64 = 1e-6;

/// The slow and the static error as values at a few knots of each channel (Gaussian-process approximation by inducing points).
#[derive(Debug, Clone)]
pub struct Knots {
    errors: ErrorModel,
    places: Vec<Along>,
    /// Factor of the correlation of the values at the knots.
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Knots {
    pub fn new<'a>(errors: ErrorModel, measured: impl IntoIterator<Item = &'a Along>) -> Self {
        let mut ends: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
        for along in measured {
            let [low, high] = ends.entry(along.channel).or_insert([along.at_mm; 2]);
            (*low, *high) = (low.min(along.at_mm), high.max(along.at_mm));
        }
        let mut places = Vec::new();
        if errors.slow_mm > 0.0 || errors.static_mm > 0.0 {
            for (channel, [low, high]) in ends {
                let pieces = ((high - low) / (KNOTS_APART * sd::ERRORS_FAR_MM)).ceil();
                let apart = if pieces > 0.0 { (high - low) / pieces } else { 0.0 };
                let at_mm = (0..=pieces as usize).map(|i| low + apart * i as f64);
                places.extend(at_mm.map(|at_mm| Along { channel, at_mm, sd_mm: 0.0 }));
            }
        }
        let n = places.len();
        let correlation = DMatrix::from_fn(n, n, |i, j| {
            let same = if i == j { JITTER } else { 0.0 };
            same + correlation(&places[i], &places[j], sd::ERRORS_FAR_MM)
        });
        let factor = if n > 0 { Cholesky::new(correlation) } else { None };
        Self { errors, places, factor }
    }

    pub(crate) fn len(&self) -> usize {
        if self.factor.is_some() { self.places.len() } else { 0 }
    }

    /// Precision of the values at the knots for this standard deviation, mm.
    pub fn precision(&self, sd_mm: f64) -> DMatrix<f64> {
        // Replaces a standard deviation of zero, so that the precision is finite.
        const LEAST_MM: f64 = 1e-4;
        let factor = self.factor.as_ref().map_or_else(|| DMatrix::zeros(0, 0), Cholesky::inverse);
        factor / sd_mm.max(LEAST_MM).powi(2)
    }

    /// Coefficients that interpolate the values at the knots to other places, and the parts of the variances that they do not explain.
    fn basis(&self, along: &[Along]) -> (DMatrix<f64>, Vec<f64>) {
        let Some(factor) = &self.factor else {
            return (DMatrix::zeros(along.len(), 0), vec![0.0; along.len()]);
        };
        let across = DMatrix::from_fn(self.places.len(), along.len(), |k, i| {
            correlation(&self.places[k], &along[i], sd::ERRORS_FAR_MM)
        });
        let weights = factor.solve(&across);
        let left = (0..along.len()).map(|i| (1.0 - across.column(i).dot(&weights.column(i))).max(0.0));
        let left = left.collect();
        (weights.transpose(), left)
    }

    /// `None` where a standard deviation is zero.
    pub fn frame(&self, along: &[Along], period_s: f64) -> Option<FrameErrors> {
        let (basis, left) = self.basis(along);
        let shared = self.errors.slow_mm.powi(2) + self.errors.static_mm.powi(2);
        let (averages, variances) = self.errors.in_frame(along, period_s, &(shared * DVector::from(left)));
        let sds = variances.map(f64::sqrt);
        sds.iter().all(|sd| *sd > 0.0 && sd.is_finite()).then_some(FrameErrors { sds, basis, averages })
    }
}

/// Correlation of errors along the contour; `length_mm` is the standard deviation of a bell curve.
pub(crate) fn correlation(a: &Along, b: &Along, length_mm: f64) -> f64 {
    if a.channel == b.channel { bell(a.at_mm - b.at_mm, length_mm) } else { 0.0 }
}

/// A bell curve of height 1 with this standard deviation.
pub(crate) fn bell(apart: f64, reach: f64) -> f64 {
    (-0.5 * (apart / reach).powi(2)).exp()
}

#[derive(Debug, Clone)]
pub struct FrameErrors {
    /// Standard deviations besides the errors at the knots, mm: of the observations, or of their averages.
    pub sds: DVector<f64>,
    /// Coefficients of the values at the knots for every observation.
    pub basis: DMatrix<f64>,
    averages: Option<DMatrix<f64>>,
}

impl FrameErrors {
    /// Scales residuals or their derivatives so that their errors are independent with standard deviation 1.
    pub fn whitened(&self, values: DMatrix<f64>) -> DMatrix<f64> {
        let mut values = match &self.averages {
            Some(averages) => averages * values,
            None => values,
        };
        values.row_iter_mut().zip(self.sds.iter()).for_each(|(mut row, sd)| row /= *sd);
        values
    }
}
