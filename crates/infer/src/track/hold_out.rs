//! Held-out points predicted by the model, whose purpose is to find tensions, and by methods without mechanics.
//!
//! - Points of a contour: a natural spline through the other points, and principal components and a Gaussian of the speaker's recordings.
//!   The error is the distance from the predicted contour.
//! - Coils: their mean place, the straight line between the coils beside them, and a Gaussian of the speaker's recordings. The error is the
//!   distance from the predicted place.
//!
//! The methods learn from the speaker's other recordings, or from the same one if there is no other.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use tongue_core::geometry::{NaturalSpline, Point};
use tongue_core::statistics::median;
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording, Mark};

use super::Tracked;

const COMPONENTS: usize = 4;
/// Length by which a contour is extended in a straight line beyond its last point, m, where hidden tips lie.
const BEYOND_M: f64 = 30e-3;
/// Part of the largest variance that is added to every variance, so that the covariance of few frames can be inverted.
const RIDGE: f64 = 1e-3;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselinePredictor {
    pub name: String,
    pub points: usize,
    pub median_mm: f64,
    /// Root mean square error, mm.
    pub pooled_mm: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    pub points: Vec<String>,
    /// What the other methods learned from: `other recordings`, or `the same recording` if there is only one.
    pub trained_on: &'static str,
    /// The methods, the model first.
    pub opponents: Vec<BaselinePredictor>,
}

impl BaselinePredictor {
    fn new(name: &str, mut distances_m: Vec<f64>) -> Option<Self> {
        distances_m.retain(|d| d.is_finite());
        distances_m.iter_mut().for_each(|d| *d = d.abs());
        distances_m.sort_by(f64::total_cmp);
        let (n, median) = (distances_m.len(), median(distances_m.iter().copied())?);
        let pooled = (distances_m.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
        Some(Self { name: name.to_owned(), points: n, median_mm: median * 1e3, pooled_mm: pooled * 1e3 })
    }
}

/// Errors of the model and the other methods at hidden points; `None` without hidden points. `tracked` is found without these.
pub fn held_out(
    recordings: &[&AlignedRecording],
    tracked: &[&[Tracked]],
    hide: &[String],
) -> Option<HeldOut> {
    let trained_on = if recordings.len() > 1 { "other recordings" } else { "the same recording" };
    let opponents = (!hide.is_empty()).then(|| opponents(recordings, tracked, hide))?;
    Some(HeldOut { points: hide.to_vec(), trained_on, opponents })
}

fn opponents(
    recordings: &[&AlignedRecording],
    tracked: &[&[Tracked]],
    hide: &[String],
) -> Vec<BaselinePredictor> {
    let model = tracked.iter().copied().flatten().flat_map(missed).collect();
    let (mut by_spline, mut by_components, mut by_gaussian) = (Vec::new(), Vec::new(), Vec::new());
    each_frame(recordings, hide, &|s| s.contour.clone(), &|f| &f.contour, &mut |points, learned| {
        let judge = |contour: &[Point], into: &mut Vec<f64>| {
            if let Some(curve) = NaturalSpline::through(contour).map(|c| c.extended(BEYOND_M)) {
                into.extend(points.hidden.iter().map(|(_, at)| curve.distance(*at)));
            }
        };
        judge(&points.visible, &mut by_spline);
        if let Some(learned) = learned {
            judge(&learned.by_components(points), &mut by_components);
            judge(&learned.by_gaussian(points), &mut by_gaussian);
        }
    });
    let (mut by_mean, mut by_line, mut of_coils) = (Vec::new(), Vec::new(), Vec::new());
    let coil_names = |s: &AlignedRecording| s.sensors.iter().map(|(name, _)| name.clone()).collect();
    each_frame(recordings, hide, &coil_names, &|f| &f.sensors, &mut |coils, learned| {
        let Some(learned) = learned else { return };
        let (mean, expected) = (points(&learned.mean), learned.by_gaussian(coils));
        for &(i, at) in &coils.hidden {
            by_mean.push((at - mean[i]).norm());
            of_coils.push((at - expected[i]).norm());
            let beside = [coils.shown.iter().rposition(|s| *s < i), coils.shown.iter().position(|s| *s > i)];
            if let [Some(before), Some(after)] = beside {
                // The line is divided as it is between the mean places.
                let far = [before, after].map(|s| (mean[i] - mean[coils.shown[s]]).norm());
                let ends = [before, after].map(|s| coils.visible[s]);
                by_line.push((at - ends[0] - (ends[1] - ends[0]) * (far[0] / (far[0] + far[1]))).norm());
            }
        }
    });
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

/// Contour points or coils of a frame: numbers and places, m, of those that a method sees, and of the hidden ones.
struct SplitFrame<'a> {
    shown: &'a [usize],
    visible: Vec<Point>,
    hidden: Vec<(usize, Point)>,
}

/// Calls `judge` for every frame that shows all visible points, with what was learned from other recordings of the same points. `names` are
/// those of the points of a recording, `marks` their places in a frame.
fn each_frame(
    recordings: &[&AlignedRecording],
    hide: &[String],
    names: &dyn Fn(&AlignedRecording) -> Vec<String>,
    marks: &dyn Fn(&AlignedFrame) -> &[Option<Mark>],
    judge: &mut dyn FnMut(&SplitFrame<'_>, Option<&Learned>),
) {
    let first = recordings.first().map(|s| names(s)).unwrap_or_default();
    let (hidden, shown): (Vec<usize>, Vec<usize>) = (0..first.len()).partition(|&i| hide.contains(&first[i]));
    let place = |f: &AlignedFrame, i: usize| marks(f).get(i).copied().flatten().map(|m| m.at);
    let whole = |f: &AlignedFrame| {
        let places = (0..first.len()).map(|i| place(f, i)).collect::<Option<Vec<Point>>>()?;
        Some(DVector::from_iterator(2 * places.len(), places.iter().flat_map(|p| [p.x, p.y])))
    };
    for (nth, one) in recordings.iter().enumerate().filter(|(_, s)| names(s) == first) {
        let others = recordings
            .iter()
            .enumerate()
            .filter(|(o, s)| (*o != nth || recordings.len() == 1) && names(s) == first);
        let training: Vec<_> = others.flat_map(|(_, s)| s.frames.iter().filter_map(whole)).collect();
        let learned = Learned::of(&training);
        for frame in &one.frames {
            let visible = shown.iter().map(|&i| place(frame, i)).collect::<Option<Vec<_>>>();
            let Some(visible) = visible else { continue };
            let hidden = hidden.iter().filter_map(|&i| Some((i, place(frame, i)?))).collect();
            judge(&SplitFrame { shown: &shown, visible, hidden }, learned.as_ref());
        }
    }
}

/// Errors of the model at hidden points, m; both coordinates of a coil give one distance.
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

    /// Numbers of the coordinates of the visible points, and these coordinates less their means.
    fn away(&self, frame: &SplitFrame<'_>) -> (Vec<usize>, DVector<f64>) {
        let rows: Vec<usize> = frame.shown.iter().flat_map(|i| [2 * i, 2 * i + 1]).collect();
        let measured = frame.visible.iter().flat_map(|p| [p.x, p.y]);
        let away =
            DVector::from_iterator(rows.len(), rows.iter().zip(measured).map(|(r, v)| v - self.mean[*r]));
        (rows, away)
    }

    /// All points by the components that fit the visible ones best.
    fn by_components(&self, frame: &SplitFrame<'_>) -> Vec<Point> {
        let eigen = self.covariance.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let basis = eigen.eigenvectors.select_columns(&order[..COMPONENTS.min(order.len())]);
        let (rows, away) = self.away(frame);
        let visible = basis.select_rows(&rows);
        let weights = (visible.tr_mul(&visible)).lu().solve(&visible.tr_mul(&away));
        points(&weights.map_or_else(|| self.mean.clone(), |w| &self.mean + basis * w))
    }

    /// Conditional means of all points given the visible ones.
    fn by_gaussian(&self, frame: &SplitFrame<'_>) -> Vec<Point> {
        let (rows, away) = self.away(frame);
        let mut visible = self.covariance.select_rows(&rows).select_columns(&rows);
        let ridge = RIDGE * visible.diagonal().amax();
        (0..rows.len()).for_each(|i| visible[(i, i)] += ridge);
        let gain = visible.lu().solve(&away);
        let across = self.covariance.select_columns(&rows);
        points(&gain.map_or_else(|| self.mean.clone(), |g| &self.mean + across * g))
    }
}

fn points(coordinates: &DVector<f64>) -> Vec<Point> {
    coordinates.as_slice().chunks_exact(2).map(|c| Point::new(c[0], c[1])).collect()
}
