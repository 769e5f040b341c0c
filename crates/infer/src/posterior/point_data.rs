//! Points of the tongue as data of a posterior: points of a contour, and coils, in one posture or in several.
//!
//! Their errors are those of `track` for one frame. Another part is the same in all postures: the placement of the points in the frame of
//! the body, the error of a body with a wrong shape, and the places where coils are glued. So the change from one posture to another is
//! known better than each posture by itself. What the placement does to a number is linearised where the body is at rest.
//!
//! Every error is that of a residual: the measured number less the computed one.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::{Point, Similarity};
use tongue_core::observe::{Contour, NodePosition, Observable, TongueSurface};

use crate::standard_deviations::{
    COIL_GAP_MM, DRAWN_ALONE_MM, DRAWN_NEAR_MM, FIRST_COIL_MM, LEFT_SCALE, LEFT_SHIFT_MM, LEFT_TURN_DEG,
    MEASURED_COIL_MM,
};
use crate::track::{Along, Errors};
use tongue_input::measured::recording::{AlignedRecording, Mark};

use super::auxiliary::{AuxiliaryData, DataSource, PostureView};

/// Step of a central difference along shift, turn and scale, in standard deviations.
const STEP: f64 = 1e-4;
/// Step of a central difference along the surface, m.
const STEP_M: f64 = 1e-5;

/// An error that several numbers share.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum SharedError {
    Back,
    Up,
    Turn,
    Scale,
    /// The place of a coil on the tongue, or its distance from the coil before it.
    Glue(String),
}

impl SharedError {
    const PLACEMENT: [Self; 4] = [Self::Back, Self::Up, Self::Turn, Self::Scale];

    /// A point whose placement is wrong by `sds` standard deviations.
    fn displaced(&self, at: Point, centre: Point, sds: f64) -> Point {
        let about = |scale, turn| centre + Similarity::new(scale, turn, Point::zeros()).place(at - centre);
        match self {
            Self::Back => at + Point::x() * (1e-3 * LEFT_SHIFT_MM * sds),
            Self::Up => at + Point::y() * (1e-3 * LEFT_SHIFT_MM * sds),
            Self::Turn => about(1.0, LEFT_TURN_DEG.to_radians() * sds),
            Self::Scale => about((LEFT_SCALE * sds).exp(), 0.0),
            Self::Glue(_) => at,
        }
    }
}

struct Number {
    frame: usize,
    observable: Arc<dyn Observable<2>>,
    measured: f64,
    along: Along,
    /// Shared errors, one standard deviation of each, in the unit of the number.
    shared: Vec<(SharedError, f64)>,
}

impl AuxiliaryData {
    /// Points of a speaker's tongue in the frame of the body, each frame of another posture (`None`: the baseline). A contour gives the
    /// distances of its points from the surface, m, and a coil its two coordinates, m. `None` where the body has no surface or there are no
    /// points.
    pub fn points(body: &Body<2>, seen: &AlignedRecording, postures: &[Option<usize>]) -> Option<Self> {
        let surface = TongueSurface::of(body)?;
        let rest = &body.mesh.nodes;
        let points = seen.frames.iter().flat_map(|f| f.contour.iter().chain(&f.sensors)).flatten();
        let centre = points.clone().map(|m| m.at).sum::<Point>() / points.count().max(1) as f64;
        let marks = Marks { surface: &surface, rest, centre, seen };
        let frames = 0..seen.frames.len().min(postures.len());
        let numbers: Vec<Number> =
            frames.flat_map(|f| marks.of_contour(f).into_iter().chain(marks.of_coils(f))).collect();
        let views = numbers.chunk_by(|a, b| a.frame == b.frame).map(|own| PostureView {
            posture: postures[own[0].frame],
            numbers: own.iter().map(|n| n.observable.clone()).collect(),
        });
        (!numbers.is_empty()).then(|| Self {
            of: DataSource::Shapes(views.collect()),
            measured: numbers.iter().map(|n| n.measured).collect(),
            errors: errors(&numbers),
        })
    }
}

/// Covariance of the errors of all numbers, m². A drawn contour has corners that say nothing about the tongue; a smooth covariance of the
/// own errors would take them as information.
fn errors(numbers: &[Number]) -> DMatrix<f64> {
    let errors = Errors::default();
    let own = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
        let (a, b) = (&numbers[i].along, &numbers[j].along);
        let same_frame = numbers[i].frame == numbers[j].frame;
        let near = (-(a.at_mm - b.at_mm).abs() / DRAWN_NEAR_MM).exp();
        let is_near = same_frame && a.channel == b.channel;
        let drawn = if is_near { a.sd_mm * b.sd_mm * near } else { 0.0 };
        let alone = if i == j { DRAWN_ALONE_MM.powi(2) } else { 0.0 };
        1e-6 * (errors.of_body(a, b, same_frame) + drawn + alone)
    });
    let mut by_source: BTreeMap<&SharedError, DVector<f64>> = BTreeMap::new();
    for (i, number) in numbers.iter().enumerate() {
        for (source, sd) in &number.shared {
            by_source.entry(source).or_insert_with(|| DVector::zeros(numbers.len()))[i] += sd;
        }
    }
    by_source.values().fold(own, |sum, sds| sum + sds * sds.transpose())
}

/// The points of all frames on a body.
struct Marks<'a> {
    surface: &'a TongueSurface,
    rest: &'a [Point],
    /// About this place the points may be turned and scaled.
    centre: Point,
    seen: &'a AlignedRecording,
}

impl Marks<'_> {
    /// By how much a measured number at a point changes with its placement.
    fn by_placement(&self, at: Point, value: impl Fn(Point) -> f64) -> Vec<(SharedError, f64)> {
        Vec::from_iter(SharedError::PLACEMENT.iter().map(|source| {
            let [high, low] = [STEP, -STEP].map(|sds| value(source.displaced(at, self.centre, sds)));
            (source.clone(), (high - low) / (2.0 * STEP))
        }))
    }

    fn of_contour(&self, frame: usize) -> Vec<Number> {
        let Self { rest, seen, .. } = *self;
        let curve = &self.surface.curve;
        let points: Vec<Mark> =
            seen.contour.iter().zip(&seen.frames[frame].contour).filter_map(|(_, m)| *m).collect();
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + (pair[1].at - pair[0].at).norm());
        }
        // Distances along a contour are counted from where the surface begins, so that those of several contours agree.
        let feet: Vec<f64> = points.iter().map(|m| curve.nearest_place(&m.at, rest)).collect();
        let forwards = if feet.first() <= feet.last() { 1.0 } else { -1.0 };
        let offset: f64 = feet.iter().zip(&along).map(|(foot, a)| foot - forwards * a).sum();
        let offset = offset / feet.len().max(1) as f64;
        Vec::from_iter(points.into_iter().zip(along).map(|(mark, along)| {
            Number {
                frame,
                observable: Arc::new(Contour::new(curve.clone(), mark.at)),
                measured: 0.0,
                along: Along { channel: 0, at_mm: 1e3 * (offset + forwards * along), sd_mm: 1e3 * mark.sd },
                // The computed number is the distance, and the measured one is zero.
                shared: self.by_placement(mark.at, |at| -Contour::new(curve.clone(), at).value(rest)),
            }
        }))
    }

    fn of_coils(&self, frame: usize) -> Vec<Number> {
        let Self { rest, seen, .. } = *self;
        let curve = &self.surface.curve;
        let place = |at: f64| curve.place(at, rest);
        let points = seen.frames[frame].sensors.iter().enumerate();
        let mut out = Vec::new();
        for (coil, mark) in points.filter_map(|(c, m)| Some((c, (*m)?))) {
            let behind = seen.sensors[coil].1;
            let at = (self.surface.tip - behind).clamp(0.0, curve.length());
            let tangent = (place(at + STEP_M) - place(at - STEP_M)) / (2.0 * STEP_M);
            for (axis, direction) in [Point::x(), Point::y()].into_iter().enumerate() {
                let glue = glue(seen, coil).into_iter().map(|(source, sd)| (source, tangent[axis] * sd));
                out.push(Number {
                    frame,
                    observable: Arc::new(NodePosition::on_curve(curve, at, direction)),
                    measured: mark.at[axis],
                    along: Along { channel: 1 + axis, at_mm: -1e3 * behind, sd_mm: 1e3 * mark.sd },
                    shared: self.by_placement(mark.at, |at| at[axis]).into_iter().chain(glue).collect(),
                });
            }
        }
        out
    }
}

/// The errors of the place of a coil on the tongue, m: of a measured one, or of the first one and the gaps up to it.
fn glue(seen: &AlignedRecording, coil: usize) -> Vec<(SharedError, f64)> {
    let known = (0..=coil).rev().find(|&c| seen.measured[c]);
    let sd = |c: usize| match c {
        c if known == Some(c) => 1e-3 * MEASURED_COIL_MM,
        0 => 1e-3 * FIRST_COIL_MM,
        _ => 1e-3 * COIL_GAP_MM,
    };
    (known.unwrap_or(0)..=coil).map(|c| (SharedError::Glue(seen.sensors[c].0.clone()), sd(c))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coil_behind_a_measured_one_is_as_uncertain_as_the_gap() {
        let mut seen = AlignedRecording {
            sensors: (1..).zip([0.01, 0.026, 0.042]).map(|(i, behind)| (format!("T{i}"), behind)).collect(),
            measured: vec![false; 3],
            ..AlignedRecording::of_contours(&[])
        };
        let sds =
            |seen: &AlignedRecording, coil| glue(seen, coil).iter().map(|(_, sd)| *sd).collect::<Vec<_>>();
        assert_eq!(sds(&seen, 2), [4e-3, 2e-3, 2e-3]);
        seen.measured[1] = true;
        assert_eq!(sds(&seen, 2), [1e-3, 2e-3]);
        assert_eq!(sds(&seen, 0), [4e-3]);
    }
}
