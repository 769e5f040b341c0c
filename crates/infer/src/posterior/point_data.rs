//! Points of a contour and coils as data of a posterior, in one posture or in several.
//!
//! Their own errors are those of `track` for one frame, with averages for many points of a contour. All postures share the placement of the
//! points in the frame of the body, the error by the shape of the body, and the places where coils are glued; so the change between
//! postures is known better than each posture. The effect of the placement is linearised at the body at rest about its most probable
//! placement there; about zero, a turn of 18 degrees would be wrong by millimetres.
//!
//! Errors are those of residuals, measured less computed.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::{Contour, NodePosition, Observable, TongueSurface};

use crate::error_model::{Along, ErrorModel, correlation, distances_along};
use crate::standard_deviations::{
    COIL_GAP_MM, FIRST_COIL_MM, LEFT_SCALE, LEFT_SHIFT_MM, LEFT_TURN_DEG, MEASURED_COIL_MM, POSTURE_ALONE_MM,
    POSTURE_FAR_MM, POSTURE_MM,
};
use tongue_input::measured::recording::{AlignedRecording, Mark};

use super::auxiliary::{AuxiliaryData, DataSource, PostureView};

/// Step of central differences by shift, turn and scale, in standard deviations.
const STEP: f64 = 1e-4;
/// Number of linearisations of the placement.
const ROUNDS: usize = 5;
/// Step of central differences along the surface, m.
const STEP_M: f64 = 1e-5;

/// An error that several numbers have in common.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum SharedError {
    /// One of the unknowns of the placement.
    Placement(usize),
    /// The place of a coil on the tongue, or its distance from the coil before it.
    Glue(String),
}

/// A number that follows from the shape of a posture, with its errors.
#[derive(Clone)]
struct Number {
    observable: Arc<dyn Observable<2>>,
    measured: f64,
    along: Along,
    /// Each shared error, and its effect on the number for one standard deviation.
    shared: Vec<(SharedError, f64)>,
}

impl AuxiliaryData {
    /// Points of a speaker's tongue in the frame of the body; each frame is another posture (`None`: the baseline). A contour gives
    /// distances of its points from the surface, m, or averages of many such distances; a coil gives two coordinates, m. `None` where the
    /// body has no surface or there are no points.
    pub fn points(body: &Body<2>, recording: &AlignedRecording, postures: &[Option<usize>]) -> Option<Self> {
        let surface = TongueSurface::of(body)?;
        let rest = &body.mesh.nodes;
        let points = recording.frames.iter().flat_map(|f| f.contour.iter().chain(&f.sensors)).flatten();
        let centre = points.clone().map(|m| m.at).sum::<Point>() / points.count().max(1) as f64;
        let mut marks = Marks { surface: &surface, rest, centre, recording, placement: DVector::zeros(4) };
        for _ in 0..ROUNDS {
            marks.placement = marks.most_probable_at_rest().unwrap_or(marks.placement);
        }
        let frames = postures.iter().zip(0..recording.frames.len());
        let frames = frames.map(|(posture, f)| (*posture, marks.of_frame(f)));
        let frames: Vec<(Option<usize>, Vec<Number>)> = frames.filter(|(_, own)| !own.is_empty()).collect();
        let numbers: Vec<(usize, &Number)> =
            (0..).zip(&frames).flat_map(|(f, (_, own))| own.iter().map(move |number| (f, number))).collect();
        let (views, own): (Vec<PostureView>, Vec<DVector<f64>>) =
            frames.iter().map(|(posture, own)| view(*posture, own)).unzip();
        let own: Vec<f64> = own.iter().flatten().copied().collect();
        let measured = DMatrix::from_iterator(numbers.len(), 1, numbers.iter().map(|(_, n)| n.measured));
        (!own.is_empty()).then(|| Self {
            measured: averaged(&views, &measured).data.into(),
            errors: averaged(&views, &averaged(&views, &shared_errors(&numbers)).transpose()).transpose()
                + 1e-6 * DMatrix::from_diagonal(&own.into()),
            sources: views.into_iter().map(DataSource::Shape).collect(),
        })
    }
}

/// The observables of a posture, and the variances of their own errors, mm², which are independent of those of other postures.
fn view(posture: Option<usize>, numbers: &[Number]) -> (PostureView, DVector<f64>) {
    let along: Vec<Along> = numbers.iter().map(|n| n.along).collect();
    let others = DVector::zeros(along.len());
    let (averages, own) = ErrorModel::default().in_frame(&along, f64::INFINITY, &others);
    let observables = numbers.iter().map(|n| n.observable.clone()).collect();
    (PostureView { posture, observables, averages }, own)
}

/// Takes a matrix with one row for each observable of all views to one with a row for each number.
fn averaged(views: &[PostureView], of_observables: &DMatrix<f64>) -> DMatrix<f64> {
    let mut from = 0;
    let mut rows = Vec::new();
    for view in views {
        let own = of_observables.rows(from, view.observables.len()).into_owned();
        from += own.nrows();
        rows.extend(view.averaged(own).row_iter().map(|row| row.into_owned()));
    }
    DMatrix::from_rows(&rows)
}

/// Covariance of the errors that numbers share, m²: by body, placement and places of coils. Numbers are given with their frames.
fn shared_errors(numbers: &[(usize, &Number)]) -> DMatrix<f64> {
    let of_body = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
        let [(frame, a), (other, b)] = [numbers[i], numbers[j]];
        1e-6 * ErrorModel::default().of_body(&a.along, &b.along, frame == other)
    });
    let mut by_source: BTreeMap<&SharedError, DVector<f64>> = BTreeMap::new();
    for (i, (_, number)) in numbers.iter().enumerate() {
        for (source, sd) in &number.shared {
            by_source.entry(source).or_insert_with(|| DVector::zeros(numbers.len()))[i] += sd;
        }
    }
    by_source.values().fold(of_body, |sum, sds| sum + sds * sds.transpose())
}

struct Marks<'a> {
    surface: &'a TongueSurface,
    rest: &'a [Point],
    /// The point about which points are turned and scaled.
    centre: Point,
    recording: &'a AlignedRecording,
    /// The placement about which is linearised: shift backwards and upwards, turn, and logarithm of the scale, in standard deviations.
    placement: DVector<f64>,
}

impl Marks<'_> {
    fn placed(&self, at: Point, placement: &DVector<f64>) -> Point {
        let turn = LEFT_TURN_DEG.to_radians() * placement[2];
        let shift = Point::new(placement[0], placement[1]) * (1e-3 * LEFT_SHIFT_MM);
        let similarity = Similarity::new((LEFT_SCALE * placement[3]).exp(), turn, shift);
        self.centre + similarity.place(at - self.centre)
    }

    /// The most probable placement if the postures differ from rest by some millimetres, for which all points of a contour count.
    fn most_probable_at_rest(&self) -> Option<DVector<f64>> {
        let (mut precision, mut gradient) = (DMatrix::identity(4, 4), DVector::zeros(4));
        for numbers in (0..self.recording.frames.len()).map(|f| self.of_frame(f)) {
            let covariance = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
                let (a, b) = (&numbers[i].along, &numbers[j].along);
                let alone = if i == j { a.sd_mm.powi(2) + POSTURE_ALONE_MM.powi(2) } else { 0.0 };
                let posture = POSTURE_MM.powi(2) * correlation(a, b, POSTURE_FAR_MM);
                1e-6 * (ErrorModel::default().of_body(a, b, true) + posture + alone)
            });
            let rates = DMatrix::from_fn(numbers.len(), 4, |i, source| numbers[i].shared[source].1);
            let away = numbers.iter().map(|n| n.measured - n.observable.value(self.rest));
            let weighted = covariance.cholesky()?.solve(&rates);
            precision += weighted.tr_mul(&rates);
            gradient += weighted.tr_mul(&DVector::from_iterator(numbers.len(), away));
        }
        Some(-precision.cholesky()?.solve(&gradient))
    }

    fn of_frame(&self, frame: usize) -> Vec<Number> {
        [self.of_contour(frame), self.of_coils(frame)].concat()
    }

    /// Derivatives of a function of a placed point by the placement, for one standard deviation each.
    fn by_placement(&self, at: Point, value: impl Fn(Point) -> f64) -> Vec<(SharedError, f64)> {
        Vec::from_iter((0..self.placement.len()).map(|source| {
            let [high, low] = [STEP, -STEP].map(|sds| {
                let mut placement = self.placement.clone();
                placement[source] += sds;
                value(self.placed(at, &placement))
            });
            (SharedError::Placement(source), (high - low) / (2.0 * STEP))
        }))
    }

    /// First-order change of a number from no placement to the present one.
    fn times_placement(&self, shared: &[(SharedError, f64)]) -> f64 {
        shared.iter().zip(&self.placement).map(|((_, rate), sds)| rate * sds).sum()
    }

    fn of_contour(&self, frame: usize) -> Vec<Number> {
        let (rest, recording) = (self.rest, self.recording);
        let curve = &self.surface.curve;
        let points: Vec<Mark> = recording.frames[frame].contour.iter().flatten().copied().collect();
        let along = distances_along(points.iter().map(|mark| Some(mark.at)), 1.0);
        // Distances along contours are counted from the beginning of the surface, so that those of several contours agree.
        let feet: Vec<f64> = points.iter().map(|m| curve.nearest_place(&m.at, rest)).collect();
        let forwards = if feet.first() <= feet.last() { 1.0 } else { -1.0 };
        let offset: f64 = feet.iter().zip(&along).map(|(foot, a)| foot - forwards * a).sum();
        let offset = offset / feet.len().max(1) as f64;
        Vec::from_iter(points.into_iter().zip(along).map(|(mark, along)| {
            // The computed number is the distance, and the measured one is zero.
            let shared = self.by_placement(mark.at, |at| -Contour::new(curve.clone(), at).value(rest));
            Number {
                observable: Arc::new(Contour::new(curve.clone(), self.placed(mark.at, &self.placement))),
                measured: -self.times_placement(&shared),
                along: Along { channel: 0, at_mm: 1e3 * (offset + forwards * along), sd_mm: 1e3 * mark.sd },
                shared,
            }
        }))
    }

    fn of_coils(&self, frame: usize) -> Vec<Number> {
        let (rest, recording) = (self.rest, self.recording);
        let curve = &self.surface.curve;
        let place = |at: f64| curve.place(at, rest);
        let points = recording.frames[frame].sensors.iter().enumerate();
        let mut out = Vec::new();
        for (coil, mark) in points.filter_map(|(c, m)| Some((c, (*m)?))) {
            let behind = recording.sensors[coil].1;
            let at = (self.surface.tip - behind).clamp(0.0, curve.length());
            let tangent = (place(at + STEP_M) - place(at - STEP_M)) / (2.0 * STEP_M);
            for (axis, direction) in [Point::x(), Point::y()].into_iter().enumerate() {
                let mut shared = self.by_placement(mark.at, |at| at[axis]);
                let measured = self.placed(mark.at, &self.placement)[axis] - self.times_placement(&shared);
                shared.extend(
                    glue(recording, coil).into_iter().map(|(source, sd)| (source, tangent[axis] * sd)),
                );
                out.push(Number {
                    observable: Arc::new(NodePosition::on_curve(curve, at, direction)),
                    measured,
                    along: Along { channel: 1 + axis, at_mm: -1e3 * behind, sd_mm: 1e3 * mark.sd },
                    shared,
                });
            }
        }
        out
    }
}

/// The errors of a coil's place on the tongue, m: of its measured place, or of a measured or first coil and the gaps from there.
pub fn glue(recording: &AlignedRecording, coil: usize) -> Vec<(SharedError, f64)> {
    let known = (0..=coil).rev().find(|&c| recording.measured[c]);
    let sd = |c: usize| match c {
        c if known == Some(c) => 1e-3 * MEASURED_COIL_MM,
        0 => 1e-3 * FIRST_COIL_MM,
        _ => 1e-3 * COIL_GAP_MM,
    };
    (known.unwrap_or(0)..=coil).map(|c| (SharedError::Glue(recording.sensors[c].0.clone()), sd(c))).collect()
}
