//! Points of the tongue as data of a posterior: points of a contour, and coils, in one posture or in several.
//!
//! Their errors are those of `track` for one frame. Another part is the same in all postures: the placement of the points in the frame of
//! the body, the error of a body with a wrong shape, and the places where coils are glued. So the change from one posture to another is
//! known better than each posture by itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::{Contour, Curve, NodePosition, Observable};

use crate::adapt::{FIRST_COIL_SD_M, GAP_SD_M, MEASURED_COIL_SD_M};
use crate::track::{Along, Errors, SCALE_SD, SHIFT_SD_M, Surface, TURN_SD};
use tongue_input::measured::recording;

use super::beside::{Beside, Of, Sight, View};

/// Step of a central difference along shift, turn and scale, in standard deviations.
const STEP: f64 = 1e-4;
/// Step of a central difference along the surface, m.
const STEP_M: f64 = 1e-5;

/// An error that several numbers share.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Shared {
    /// Number 0 to 3 of the placement: shift to the back, shift upwards, turn, scale.
    Placement(usize),
    /// The place of a coil on the tongue, or its distance from the coil before it.
    Glue(String),
}

/// A measured number.
struct Mark {
    posture: Option<usize>,
    name: String,
    observable: Arc<dyn Observable<2>>,
    measured: f64,
    along: Along,
    /// Shared errors, one standard deviation of each, in the unit of the number.
    shared: Vec<(Shared, f64)>,
}

impl Beside {
    /// Points of a speaker's tongue in the frame of the body, of this kind by name: for each posture (`None`: the baseline) the first frame of
    /// a recording. A contour gives the distances of its points from the surface, m, and a coil its two coordinates, m. `None` where the body
    /// has no surface or there are no points.
    pub fn points(kind: &str, body: &Body<2>, seen: &[(Option<usize>, &recording::Seen)]) -> Option<Self> {
        let surface = Surface::of(body)?;
        let frames = || seen.iter().filter_map(|(_, s)| s.frames.first());
        let places: Vec<Point> =
            frames().flat_map(|f| f.contour.iter().chain(&f.sensors)).flatten().map(|m| m.at).collect();
        let centre = places.iter().sum::<Point>() / places.len() as f64;
        let of_posture = |(posture, seen): &(Option<usize>, &recording::Seen)| {
            let mut marks = of_contour(&surface.curve, &body.mesh.nodes, centre, (*posture, seen));
            marks.extend(of_coils(&surface, &body.mesh.nodes, centre, (*posture, seen)));
            marks
        };
        let marks: Vec<Mark> = seen.iter().flat_map(of_posture).collect();
        if marks.is_empty() {
            return None;
        }
        let views = marks.chunk_by(|a, b| a.posture == b.posture).map(|own| View {
            posture: own[0].posture,
            count: own.len(),
            sight: Arc::new(own.iter().map(|m| m.observable.clone()).collect::<Vec<_>>()) as Arc<dyn Sight>,
        });
        Some(Self {
            kind: kind.to_owned(),
            of: Of::Shapes(views.collect()),
            measured: marks.iter().map(|m| m.measured).collect(),
            errors: errors(&marks),
            names: marks.into_iter().map(|m| m.name).collect(),
        })
    }
}

/// Covariance of the errors of all numbers, m².
fn errors(marks: &[Mark]) -> DMatrix<f64> {
    let errors = Errors::default();
    let own = DMatrix::from_fn(marks.len(), marks.len(), |i, j| {
        let (a, b) = (&marks[i], &marks[j]);
        1e-6 * errors.of_observations(&a.along, &b.along, (a.posture == b.posture, i == j))
    });
    let mut by_source: BTreeMap<&Shared, DVector<f64>> = BTreeMap::new();
    for (i, (source, sd)) in marks.iter().enumerate().flat_map(|(i, m)| m.shared.iter().map(move |s| (i, s)))
    {
        by_source.entry(source).or_insert_with(|| DVector::zeros(marks.len()))[i] += sd;
    }
    by_source.values().fold(own, |sum, sds| sum + sds * sds.transpose())
}

/// A point whose shift, turn or scale is wrong by a number of standard deviations.
fn displaced(at: Point, centre: Point, which: usize, by: f64) -> Point {
    match which {
        0 => at + Point::x() * (SHIFT_SD_M * by),
        1 => at + Point::y() * (SHIFT_SD_M * by),
        2 => centre + Similarity::new(1.0, TURN_SD * by, Point::zeros()).place(at - centre),
        _ => centre + Similarity::new((SCALE_SD * by).exp(), 0.0, Point::zeros()).place(at - centre),
    }
}

/// What a number changes by with the placement, one standard deviation each.
fn by_placement(at: Point, centre: Point, value: impl Fn(Point) -> f64) -> Vec<(Shared, f64)> {
    let rate = |which: usize| {
        let side = |by: f64| value(displaced(at, centre, which, by));
        (side(STEP) - side(-STEP)) / (2.0 * STEP)
    };
    (0..4).map(|which| (Shared::Placement(which), rate(which))).collect()
}

fn of_contour(
    curve: &Curve,
    rest: &[Point],
    centre: Point,
    (posture, seen): (Option<usize>, &recording::Seen),
) -> Vec<Mark> {
    let marks = seen.frames.iter().take(1).flat_map(|f| seen.contour.iter().zip(&f.contour));
    let marks: Vec<(&String, recording::Mark)> = marks.filter_map(|(n, m)| Some((n, (*m)?))).collect();
    let mut along = vec![0.0];
    for pair in marks.windows(2) {
        along.push(along[along.len() - 1] + (pair[1].1.at - pair[0].1.at).norm());
    }
    // Distances along the contour are counted from where the surface begins, so that those of several contours agree.
    let feet: Vec<f64> = marks.iter().map(|(_, m)| curve.nearest_place(&m.at, rest)).collect();
    let forwards = if feet.first() <= feet.last() { 1.0 } else { -1.0 };
    let offset: f64 = feet.iter().zip(&along).map(|(foot, a)| foot - forwards * a).sum::<f64>();
    let offset = offset / feet.len().max(1) as f64;
    let mark = |((name, mark), along): ((&String, recording::Mark), f64)| {
        let distance = |at: Point| Contour::new(curve.clone(), at).value(rest);
        Mark {
            posture,
            name: name.clone(),
            observable: Arc::new(Contour::new(curve.clone(), mark.at)),
            measured: 0.0,
            along: Along { channel: 0, at_mm: 1e3 * (offset + forwards * along), sd_mm: 1e3 * mark.sd },
            // The distance is a computed number; a measured one would change by the opposite.
            shared: by_placement(mark.at, centre, |at| -distance(at)),
        }
    };
    marks.into_iter().zip(along).map(mark).collect()
}

fn of_coils(
    surface: &Surface,
    rest: &[Point],
    centre: Point,
    (posture, seen): (Option<usize>, &recording::Seen),
) -> Vec<Mark> {
    let curve = &surface.curve;
    let place = |at: f64| curve.weights(at).iter().map(|&(node, w)| rest[node] * w).sum::<Point>();
    let marks = seen.frames.iter().take(1).flat_map(|f| f.sensors.iter().enumerate());
    let mut out = Vec::new();
    for (number, mark) in marks.filter_map(|(n, m)| Some((n, (*m)?))) {
        let (name, behind) = &seen.sensors[number];
        let at = (surface.tip - behind).clamp(0.0, curve.length());
        let tangent = (place(at + STEP_M) - place(at - STEP_M)) / (2.0 * STEP_M);
        // A usual distance from the tip is the sum of usual gaps.
        let glued: Vec<(&String, f64)> = if seen.measured[number] {
            vec![(name, MEASURED_COIL_SD_M)]
        } else {
            let sd = |n: usize| if n == 0 { FIRST_COIL_SD_M } else { GAP_SD_M };
            (0..=number).map(|n| (&seen.sensors[n].0, sd(n))).collect()
        };
        for (axis, (direction, label)) in [(Point::x(), "back"), (Point::y(), "up")].into_iter().enumerate() {
            let glue = glued.iter().map(|(name, sd)| (Shared::Glue((*name).clone()), tangent[axis] * sd));
            out.push(Mark {
                posture,
                name: format!("{name} {label}"),
                observable: Arc::new(NodePosition::on_curve(curve, at, direction)),
                measured: mark.at[axis],
                along: Along { channel: 1 + axis, at_mm: -1e3 * behind, sd_mm: 1e3 * mark.sd },
                shared: by_placement(mark.at, centre, |at| at[axis]).into_iter().chain(glue).collect(),
            });
        }
    }
    out
}
