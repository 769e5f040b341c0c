//! Held-out points, predicted by the model and by methods without mechanics. The purpose of the model is to find tensions, not to
//! interpolate, but results in which it is worse are reported too.
//!
//! - Points of a contour are predicted by a natural spline through the other points, and by principal components and a Gaussian of the
//!   speaker's recordings. The error is the distance of the hidden point from the predicted contour.
//! - Coils are predicted by their mean place, by the straight line between the coils beside them, and by a Gaussian of the speaker's
//!   recordings. The error is the distance from the predicted place.
//!
//! What is learned of a speaker comes from his or her other recordings, or from the same one if there is no other.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use tongue_core::geometry::{NaturalSpline, Point};
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording};

use super::Tracked;

/// Number of principal components.
const COMPONENTS: usize = 4;
/// Length by which a contour is extended in a straight line beyond its last point, m: hidden tips lie there.
const BEYOND_M: f64 = 30e-3;
/// This part of the largest variance is added to every variance, so that the covariance of few frames can be inverted.
const RIDGE: f64 = 1e-3;

/// Errors of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselinePredictor {
    pub name: String,
    /// Number of hidden points in all frames.
    pub points: usize,
    pub median_mm: f64,
    /// Root mean square error, mm.
    pub pooled_mm: f64,
}

/// Comparison of predictions of the held-out points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    pub points: Vec<String>,
    /// Where the other methods learned from: `other recordings`, or `the same recording` if there is only one.
    pub trained_on: &'static str,
    /// The methods, the model first.
    pub opponents: Vec<BaselinePredictor>,
}

impl BaselinePredictor {
    fn new(name: &str, mut distances_m: Vec<f64>) -> Option<Self> {
        distances_m.retain(|d| d.is_finite());
        distances_m.iter_mut().for_each(|d| *d = d.abs());
        distances_m.sort_by(f64::total_cmp);
        let n = distances_m.len();
        let median = 0.5 * (distances_m.get(n.checked_sub(1)? / 2)? + distances_m[n / 2]);
        let pooled = (distances_m.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
        Some(Self { name: name.to_owned(), points: n, median_mm: median * 1e3, pooled_mm: pooled * 1e3 })
    }
}

/// The model and the other methods on hidden points; `None` if no points are hidden. `seen` are the observations of every recording, and
/// `tracked` are the results of the model without the hidden points.
pub fn held_out(seen: &[&AlignedRecording], tracked: &[&[Tracked]], hide: &[String]) -> Option<HeldOut> {
    let trained_on = if seen.len() > 1 { "other recordings" } else { "the same recording" };
    let opponents = (!hide.is_empty()).then(|| opponents(seen, tracked, hide))?;
    Some(HeldOut { points: hide.to_vec(), trained_on, opponents })
}

fn opponents(seen: &[&AlignedRecording], tracked: &[&[Tracked]], hide: &[String]) -> Vec<BaselinePredictor> {
    let model = tracked.iter().copied().flatten().flat_map(missed).collect();
    let names: Vec<String> = seen.first().map(|s| s.contour.clone()).unwrap_or_default();
    let hidden: Vec<usize> = (0..names.len()).filter(|&i| hide.contains(&names[i])).collect();
    let shown: Vec<usize> = (0..names.len()).filter(|&i| !hide.contains(&names[i])).collect();
    let (mut by_spline, mut by_components, mut by_gaussian) = (Vec::new(), Vec::new(), Vec::new());
    for (nth, one) in seen.iter().enumerate().filter(|(_, s)| s.contour == names) {
        let training: Vec<DVector<f64>> = seen
            .iter()
            .enumerate()
            .filter(|(o, s)| (*o != nth || seen.len() == 1) && s.contour == names)
            .flat_map(|(_, s)| s.frames.iter().filter_map(whole))
            .collect();
        let learned = Learned::of(&training);
        for frame in &one.frames {
            let at = |i: &usize| frame.contour[*i].map(|m| m.at);
            let Some(visible) = shown.iter().map(at).collect::<Option<Vec<Point>>>() else { continue };
            let told: Vec<Point> = hidden.iter().filter_map(at).collect();
            let judge = |contour: &[Point], into: &mut Vec<f64>| {
                if let Some(curve) = NaturalSpline::through(contour).map(|c| c.extended(BEYOND_M)) {
                    into.extend(told.iter().map(|p| curve.distance(*p)));
                }
            };
            judge(&visible, &mut by_spline);
            if let Some(learned) = &learned {
                judge(&learned.by_components(&shown, &visible), &mut by_components);
                judge(&learned.by_gaussian(&shown, &visible), &mut by_gaussian);
            }
        }
    }
    let [by_mean, by_line, of_coils] = of_coils(seen, hide);
    let all = [
        BaselinePredictor::new("the model", model),
        BaselinePredictor::new("mean of the speaker's coils", by_mean),
        BaselinePredictor::new("line between the coils beside it", by_line),
        BaselinePredictor::new("Gaussian of the speaker's coils", of_coils),
        BaselinePredictor::new("natural spline through the other points", by_spline),
        BaselinePredictor::new("4 principal components of the speaker", by_components),
        BaselinePredictor::new("Gaussian of the speaker's points", by_gaussian),
    ];
    all.into_iter().flatten().collect()
}

/// The model's error of every hidden point, m. A coil stands there twice, once for each coordinate; its error is the length of both.
fn missed(frame: &Tracked) -> Vec<f64> {
    let mut out: Vec<(&str, f64)> = Vec::new();
    for hidden in &frame.hidden {
        match out.last_mut().filter(|(point, _)| *point == hidden.point) {
            Some((_, far)) => *far = far.hypot(hidden.missed_m),
            None => out.push((&hidden.point, hidden.missed_m)),
        }
    }
    out.into_iter().map(|(_, far)| far).collect()
}

/// Errors, m, of three predictions of hidden coils: their mean place, the straight line between the coils beside them, divided as it is
/// between the mean places, and the mean of a Gaussian given the other coils.
fn of_coils(seen: &[&AlignedRecording], hide: &[String]) -> [Vec<f64>; 3] {
    let (mut by_mean, mut by_line, mut by_gaussian) = (Vec::new(), Vec::new(), Vec::new());
    let first = seen.first().map(|s| coil_names(s)).unwrap_or_default();
    let (hidden, shown): (Vec<usize>, Vec<usize>) = (0..first.len()).partition(|&i| hide.contains(&first[i]));
    let all = |f: &AlignedFrame| (0..first.len()).map(|i| place(f, &i)).collect::<Option<Vec<Point>>>();
    for (nth, one) in seen.iter().enumerate().filter(|(_, s)| coil_names(s) == first) {
        let others =
            seen.iter().enumerate().filter(|(o, s)| (*o != nth || seen.len() == 1) && coil_names(s) == first);
        let training: Vec<_> =
            others.flat_map(|(_, s)| s.frames.iter().filter_map(all)).map(coordinates).collect();
        let Some(learned) = Learned::of(&training) else { continue };
        let mean = points(&learned.mean);
        for frame in &one.frames {
            let Some(visible) = shown.iter().map(|i| place(frame, i)).collect::<Option<Vec<_>>>() else {
                continue;
            };
            let expected = learned.by_gaussian(&shown, &visible);
            for (i, at) in hidden.iter().filter_map(|i| Some((*i, place(frame, i)?))) {
                by_mean.push((at - mean[i]).norm());
                by_gaussian.push((at - expected[i]).norm());
                let beside = [shown.iter().rfind(|s| **s < i), shown.iter().find(|s| **s > i)];
                if let [Some(&a), Some(&b)] = beside {
                    let far = [a, b].map(|s| (mean[i] - mean[s]).norm());
                    let ends = [a, b].map(|s| place(frame, &s).unwrap_or(mean[s]));
                    by_line.push((at - ends[0] - (ends[1] - ends[0]) * (far[0] / (far[0] + far[1]))).norm());
                }
            }
        }
    }
    [by_mean, by_line, by_gaussian]
}

fn place(f: &AlignedFrame, i: &usize) -> Option<Point> {
    f.sensors.get(*i).copied().flatten().map(|m| m.at)
}

fn coil_names(s: &AlignedRecording) -> Vec<String> {
    s.sensors.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>()
}

/// All coordinates of a frame in which every point was seen; `None` for other frames.
fn whole(frame: &AlignedFrame) -> Option<DVector<f64>> {
    frame.contour.iter().map(|m| m.map(|m| m.at)).collect::<Option<Vec<Point>>>().map(coordinates)
}

fn coordinates(points: Vec<Point>) -> DVector<f64> {
    DVector::from_iterator(2 * points.len(), points.iter().flat_map(|p| [p.x, p.y]))
}

/// Mean and covariance of the coordinates of complete frames.
struct Learned {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Learned {
    fn of(frames: &[DVector<f64>]) -> Option<Self> {
        if frames.len() < 2 * COMPONENTS || frames[0].is_empty() {
            return None;
        }
        let mean = frames.iter().sum::<DVector<f64>>() / frames.len() as f64;
        let mut covariance = DMatrix::zeros(mean.len(), mean.len());
        for f in frames {
            let away = f - &mean;
            covariance += &away * away.transpose() / frames.len() as f64;
        }
        Some(Self { mean, covariance })
    }

    /// The numbers of the coordinates of these points.
    fn rows(shown: &[usize]) -> Vec<usize> {
        shown.iter().flat_map(|i| [2 * i, 2 * i + 1]).collect()
    }

    /// The coordinates of the visible points less their means.
    fn away(&self, rows: &[usize], visible: &[Point]) -> DVector<f64> {
        let seen = visible.iter().flat_map(|p| [p.x, p.y]);
        DVector::from_iterator(rows.len(), rows.iter().zip(seen).map(|(r, v)| v - self.mean[*r]))
    }

    /// All points: the sum of components that fits the visible ones best.
    fn by_components(&self, shown: &[usize], visible: &[Point]) -> Vec<Point> {
        let eigen = self.covariance.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let basis = eigen.eigenvectors.select_columns(&order[..COMPONENTS.min(order.len())]);
        let rows = Self::rows(shown);
        let seen = basis.select_rows(&rows);
        let weights = (seen.tr_mul(&seen)).lu().solve(&seen.tr_mul(&self.away(&rows, visible)));
        points(&weights.map_or_else(|| self.mean.clone(), |w| &self.mean + basis * w))
    }

    /// All points: their means given the visible ones.
    fn by_gaussian(&self, shown: &[usize], visible: &[Point]) -> Vec<Point> {
        let rows = Self::rows(shown);
        let mut seen = self.covariance.select_rows(&rows).select_columns(&rows);
        let ridge = RIDGE * seen.diagonal().amax();
        (0..rows.len()).for_each(|i| seen[(i, i)] += ridge);
        let gain = seen.lu().solve(&self.away(&rows, visible));
        let across = self.covariance.select_columns(&rows);
        points(&gain.map_or_else(|| self.mean.clone(), |g| &self.mean + across * g))
    }
}

fn points(coordinates: &DVector<f64>) -> Vec<Point> {
    coordinates.as_slice().chunks_exact(2).map(|c| Point::new(c[0], c[1])).collect()
}
