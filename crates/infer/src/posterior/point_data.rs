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
use tongue_core::observe::{Contour, NodePosition, Observable};

use crate::adapt::{FIRST_COIL_SD_M, GAP_SD_M, MEASURED_COIL_SD_M};
use crate::track::{Along, Errors, SCALE_SD, SHIFT_SD_M, TURN_SD, TongueSurface};
use tongue_input::measured::recording::{AlignedRecording, Mark};

use super::auxiliary::{AuxiliaryData, DataSource, PostureView};

/// Step of a central difference along shift, turn and scale, in standard deviations.
const STEP: f64 = 1e-4;
/// Step of a central difference along the surface, m.
const STEP_M: f64 = 1e-5;

/// An error that several numbers share.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Shared {
    Back,
    Up,
    Turn,
    Scale,
    /// The place of a coil on the tongue, or its distance from the coil before it.
    Glue(String),
}

impl Shared {
    const PLACEMENT: [Self; 4] = [Self::Back, Self::Up, Self::Turn, Self::Scale];

    /// A point whose placement is wrong by `sds` standard deviations.
    fn displaced(&self, at: Point, centre: Point, sds: f64) -> Point {
        let about = |scale, turn| centre + Similarity::new(scale, turn, Point::zeros()).place(at - centre);
        match self {
            Self::Back => at + Point::x() * (SHIFT_SD_M * sds),
            Self::Up => at + Point::y() * (SHIFT_SD_M * sds),
            Self::Turn => about(1.0, TURN_SD * sds),
            Self::Scale => about((SCALE_SD * sds).exp(), 0.0),
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
    shared: Vec<(Shared, f64)>,
}

impl AuxiliaryData {
    /// Points of a speaker's tongue in the frame of the body, each frame of another posture (`None`: the baseline). A contour gives the
    /// distances of its points from the surface, m, and a coil its two coordinates, m. `None` where the body has no surface or there are no
    /// points.
    pub fn points(body: &Body<2>, seen: &AlignedRecording, postures: &[Option<usize>]) -> Option<Self> {
        let surface = TongueSurface::of(body)?;
        let rest = &body.mesh.nodes;
        let points = || seen.frames.iter().flat_map(|f| f.contour.iter().chain(&f.sensors)).flatten();
        let centre = points().map(|m| m.at).sum::<Point>() / points().count().max(1) as f64;
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

/// Correlation length of the errors of one contour along it, and the independent error of a point, mm. A drawn contour has corners that
/// say nothing about the tongue; a smooth covariance would take them as information.
const NEAR_MM: f64 = 4.0;
const ALONE_MM: f64 = 0.1;

/// Covariance of the errors of all numbers, m².
fn errors(numbers: &[Number]) -> DMatrix<f64> {
    let errors = Errors::default();
    let own = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
        let (a, b) = (&numbers[i].along, &numbers[j].along);
        let same_frame = numbers[i].frame == numbers[j].frame;
        let near = (-(a.at_mm - b.at_mm).abs() / NEAR_MM).exp();
        let is_near = same_frame && a.channel == b.channel;
        let drawn = if is_near { a.sd_mm * b.sd_mm * near } else { 0.0 };
        let alone = if i == j { ALONE_MM.powi(2) } else { 0.0 };
        1e-6 * (errors.of_body(a, b, same_frame) + drawn + alone)
    });
    let mut by_source: BTreeMap<&Shared, DVector<f64>> = BTreeMap::new();
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
    fn by_placement(&self, at: Point, value: impl Fn(Point) -> f64) -> Vec<(Shared, f64)> {
        let rate = |source: &Shared| {
            let side = |sds: f64| value(source.displaced(at, self.centre, sds));
            (side(STEP) - side(-STEP)) / (2.0 * STEP)
        };
        Shared::PLACEMENT.iter().map(|source| (source.clone(), rate(source))).collect()
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
        let number = |(mark, along): (Mark, f64)| {
            let distance = |at: Point| Contour::new(curve.clone(), at).value(rest);
            Number {
                frame,
                observable: Arc::new(Contour::new(curve.clone(), mark.at)),
                measured: 0.0,
                along: Along { channel: 0, at_mm: 1e3 * (offset + forwards * along), sd_mm: 1e3 * mark.sd },
                // The computed number is the distance, and the measured one is zero.
                shared: self.by_placement(mark.at, |at| -distance(at)),
            }
        };
        points.into_iter().zip(along).map(number).collect()
    }

    fn of_coils(&self, frame: usize) -> Vec<Number> {
        let Self { rest, seen, .. } = *self;
        let curve = &self.surface.curve;
        let place = |at: f64| curve.weights(at).iter().map(|&(node, w)| rest[node] * w).sum::<Point>();
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
fn glue(seen: &AlignedRecording, coil: usize) -> Vec<(Shared, f64)> {
    let known = (0..=coil).rev().find(|&c| seen.measured[c]);
    let sd = |c: usize| match c {
        c if known == Some(c) => MEASURED_COIL_SD_M,
        0 => FIRST_COIL_SD_M,
        _ => GAP_SD_M,
    };
    (known.unwrap_or(0)..=coil).map(|c| (Shared::Glue(seen.sensors[c].0.clone()), sd(c))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tongue_core::body::Body;
    use tongue_input::measured::recording::AlignedFrame;

    /// A contour and three coils that lie on the body at rest, in two frames.
    fn seen(body: &Body<2>) -> AlignedRecording {
        let surface = TongueSurface::of(body).unwrap();
        let place =
            |at: f64| surface.curve.weights(at).iter().map(|(n, w)| body.mesh.nodes[*n] * *w).sum::<Point>();
        let contour: Vec<Point> = (0..11).map(|i| place(0.02 + 5e-3 * f64::from(i))).collect();
        let behind = [0.01, 0.026, 0.042];
        let mark = |at: Point| Some(Mark { at, sd: 0.5e-3 });
        let one = AlignedRecording::of_contours(&[&contour]);
        let sensors = behind.iter().map(|b| mark(place(surface.tip - b))).collect();
        let frame = AlignedFrame { sensors, ..one.frames[0].clone() };
        AlignedRecording {
            sensors: (1..).zip(behind).map(|(i, b)| (format!("T{i}"), b)).collect(),
            measured: vec![false; 3],
            frames: vec![frame.clone(), frame],
            ..one
        }
    }

    /// By how many standard deviations, squared, the residuals where the points of each frame are moved by so much are away from zero.
    fn cost(body: &Body<2>, moved: [Point; 2]) -> f64 {
        let mut seen = seen(body);
        for (frame, by) in seen.frames.iter_mut().zip(moved) {
            frame.contour.iter_mut().chain(&mut frame.sensors).flatten().for_each(|m| m.at += by);
        }
        let beside = AuxiliaryData::points(body, &seen, &[Some(0), None]).unwrap();
        let computed = beside.of_shapes(|_| &body.mesh.nodes);
        let residuals = DVector::from_vec(beside.measured.clone()) - DVector::from_vec(computed);
        residuals.dot(&beside.errors.clone().cholesky().unwrap().solve(&residuals))
    }

    #[test]
    fn a_common_shift_is_one_standard_deviation_and_a_shift_of_one_posture_is_many() {
        let body = Body::tongue(5.5e-3).unwrap();
        let (back, zero) = (Point::new(SHIFT_SD_M, 0.0), Point::zeros());
        // Contours and coils of both postures move together.
        let common = cost(&body, [back; 2]);
        assert!(common < 2.0, "{common}");
        let apart = cost(&body, [back, zero]);
        assert!(apart > 8.0 * common.max(1.0), "{apart} {common}");
    }

    #[test]
    fn a_coil_behind_a_measured_one_is_as_uncertain_as_the_gap() {
        let mut seen = seen(&Body::tongue(5.5e-3).unwrap());
        let sds =
            |seen: &AlignedRecording, coil| glue(seen, coil).iter().map(|(_, sd)| *sd).collect::<Vec<_>>();
        assert_eq!(sds(&seen, 2), [FIRST_COIL_SD_M, GAP_SD_M, GAP_SD_M]);
        seen.measured[1] = true;
        assert_eq!(sds(&seen, 2), [MEASURED_COIL_SD_M, GAP_SD_M]);
        assert_eq!(sds(&seen, 0), [FIRST_COIL_SD_M]);
    }

    #[test]
    fn a_contour_that_was_drawn_the_other_way_has_the_same_errors() {
        let body = Body::tongue(5.5e-3).unwrap();
        let only = |reversed: bool| {
            let mut seen = AlignedRecording { sensors: Vec::new(), ..seen(&body) };
            for frame in &mut seen.frames {
                frame.sensors.clear();
                if reversed {
                    frame.contour.reverse();
                }
            }
            AuxiliaryData::points(&body, &seen, &[Some(0), None]).unwrap().errors
        };
        let (forth, back) = (only(false), only(true));
        let other = |i: usize| 11 * (i / 11) + 10 - i % 11;
        let expected = DMatrix::from_fn(22, 22, |i, j| back[(other(i), other(j))]);
        assert!((&forth - expected).amax() < 1e-9 * forth.amax());
    }
}
