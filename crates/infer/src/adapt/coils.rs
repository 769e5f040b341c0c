//! Where a body lies in a recording of coils: shifted, turned and scaled by least squares on the mean places of the coils, with what
//! else there is (the trace of the palate, bones), under a prior of anatomy.
//!
//! ```text
//! minimise  (coils - surface)² / (1 mm)² + (first coil - 8 mm)² / (4 mm)² + sum (gap - 1.03 chord)² / (2 mm)²
//!           + |V (trace - palate)|² + (spine / 1.5 mm)² + (hyoid / 4.5 mm)² + (turn / 15°)² + (ln scale / 0.1)²
//!           + shape under the prior of [`ControlPoints`] + (mean tensions - 11 N/m)² / (7.5 N/m)²
//! ```
//! The surface is that of another tongue (its shape at rest is an unknown) in its mean posture (its mean tensions are unknowns too, to
//! first order). `V` whitens what another palate does to the trace. What is told is the similarity that brings the body nearest to that
//! tongue. Coils alone leave its turn open by some 9°, its shift by 5 mm and its scale by a tenth, and almost any placement lets
//! frames be met: how well they are met says nothing about it. The answer therefore carries its covariance.

use nalgebra::{DMatrix, DVector};

use crate::track::Surface;
use tongue_core::body::{Body, HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_core::system::{Model, System};
use tongue_input::measured::recording::Seen;

use super::least_squares::{by_differences, minimise};
use super::place::{TURNS, evenly, mean, outline};
use super::{Rest, RestError, mark_of};

/// Standard deviation of the turn from where the axes of the recording have it, rad, and of the logarithm of the scale.
const TURN_SD: f64 = 15.0 * std::f64::consts::PI / 180.0;
const LN_SCALE_SD: f64 = 0.10;
/// A shift of one unit of the search, m.
const SHIFT_M: f64 = 10e-3;
/// How far behind the tip the foremost coil is, and its standard deviation, m.
const FIRST_COIL_M: [f64; 2] = [8e-3, 4e-3];
/// The way along the surface from coil to coil is this much longer than the straight one between their mean places,
const LONGER: f64 = 1.03;
/// with this standard deviation, m.
const GAP_SD_M: f64 = 2e-3;
/// Standard deviation of a place along the surface that was measured, m.
const MEASURED_SD_M: f64 = 0.5e-3;
/// Standard deviation of a mean coil about what shape and tensions make of the surface, m.
const COIL_SD_M: f64 = 1e-3;
/// Of the mental spine and the hyoid about where they are seen, beside what shapes do to them, m.
const SPINE_SD_M: f64 = 1.5e-3;
const HYOID_SD_M: f64 = 4.5e-3;
/// What another palate does to the points of its trace: standard deviation, the length over which neighbours move together, and what
/// each does by itself, m.
const PALATE_M: [f64; 3] = [2.5e-3, 15e-3, 0.7e-3];
/// Mean tension of a muscle over a recording and its standard deviation, N per metre of thickness.
const TENSION_N: [f64; 2] = [11.0, 7.5];
/// Points to which the trace of a palate is brought, evenly along it.
const TRACE_POINTS: usize = 9;
/// Behind its end a palate goes on straight so far, m.
const BEYOND_M: f64 = 15e-3;
/// Step and end of the search, in units of its unknowns.
const STEP: f64 = 1e-5;
const ARRIVED: f64 = 1e-7;

/// What was seen of a speaker in a recording of coils, m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coils {
    /// Mean places of the coils on the tongue, from the foremost to the rearmost.
    pub means: Vec<Point>,
    /// How far behind the tip each is along the surface at rest, where that was measured.
    pub behind: Vec<Option<f64>>,
    /// The trace of the palate from front to back; empty where there is none.
    pub palate: Vec<Point>,
    /// The median place of the mental spine.
    pub spine: Option<Point>,
    /// The median place of the hyoid.
    pub hyoid: Option<Point>,
}

/// Where coils place a body.
#[derive(Debug, Clone)]
pub struct PlacedByCoils {
    /// Brings the body into the frame of the recording.
    pub similarity: Similarity,
    /// How far behind the tip each coil is along the surface of the placed body, m.
    pub behind: Vec<f64>,
    /// Root mean square distance of the mean coils from the surface that shape and mean tensions make, m.
    pub rms_m: f64,
    /// Covariance of where the middle of the body's outline is carried (m, to the back and upwards), of the turn (rad) and of the
    /// logarithm of the scale.
    pub covariance: DMatrix<f64>,
}

impl PlacedByCoils {
    /// Standard deviations of the middle (m, to the back and upwards), the turn (rad) and the logarithm of the scale.
    pub fn deviations(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }
}

impl Coils {
    /// Of recordings of one speaker, which have the same coils; `hide` are coils that are not looked at.
    pub fn of(seen: &[&Seen], hide: &[String], palate: Option<&[Point]>) -> Self {
        let Some(first) = seen.first() else { return Self::default() };
        let mut coils: Vec<(f64, bool, Point)> = Vec::new();
        for ((name, behind), measured) in first.sensors.iter().zip(&first.measured) {
            if hide.contains(name) {
                continue;
            }
            let places = seen.iter().filter_map(|s| {
                let number = s.sensors.iter().position(|(n, _)| n == name)?;
                Some(s.frames.iter().filter_map(move |f| f.sensors[number].map(|m| m.at)))
            });
            coils.extend(mean(places.flatten()).map(|at| (*behind, *measured, at)));
        }
        coils.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            means: coils.iter().map(|(_, _, at)| *at).collect(),
            behind: coils.iter().map(|(behind, measured, _)| measured.then_some(*behind)).collect(),
            palate: palate.map(<[Point]>::to_vec).unwrap_or_default(),
            spine: super::speaker::median(seen, MANDIBLE),
            hyoid: super::speaker::median(seen, HYOID),
        }
    }

    /// Places a body where this was seen on it, with the places of coils on its surface where these were not measured.
    ///
    /// # Errors
    /// [`RestError::Body`]: a body without an outline, fewer than two coils, coils that coincide.
    pub fn place(
        &self,
        body: &Body<2>,
        model: &Model,
        contracting: &[usize],
    ) -> Result<PlacedByCoils, RestError> {
        let count = self.means.len();
        if count < 2 {
            return Err(RestError::Body(format!(
                "{count} coils were seen on the tongue; to place it at least two are needed"
            )));
        }
        let search = Search::new(self, body, model, contracting)?;
        let residuals = |x: &DVector<f64>| search.residuals(x);
        let best = TURNS
            .iter()
            .filter_map(|turn| minimise(search.start(*turn), &residuals, &|_| true, STEP, ARRIVED))
            .min_by(|a, b| a.residuals.norm_squared().total_cmp(&b.residuals.norm_squared()));
        let best = best.ok_or_else(|| RestError::Body("its coils cannot be compared with it".to_owned()))?;
        let nothing = || RestError::Body("its coils say nothing of where it lies".to_owned());
        let told = |x: &DVector<f64>| search.told(x);
        let open = by_differences(&best.x, &residuals, STEP).and_then(|j| j.tr_mul(&j).try_inverse());
        let rates = by_differences(&best.x, &told, STEP).ok_or_else(nothing)?;
        let behind = search.places(&best.x);
        let away = search.away(&best.x, &behind);
        Ok(PlacedByCoils {
            similarity: search.nearest(&best.x).ok_or_else(nothing)?,
            rms_m: (away.iter().map(Point::norm_squared).sum::<f64>() / count as f64).sqrt(),
            behind,
            covariance: &rates * open.ok_or_else(nothing)? * rates.transpose(),
        })
    }
}

/// A body and what was seen on it. The unknowns, each over its standard deviation: where the middle of the body is carried (from the
/// mean of the coils), the turn, the logarithm of the scale, a place along the surface for each coil, the shape at rest (x and y of the
/// control points, as independent numbers), and the mean tensions.
struct Search<'a> {
    seen: &'a Coils,
    surface: Surface,
    /// Nodes of the body at rest, m.
    rest: &'a [Point],
    /// Nodes of its outline.
    outline: Vec<usize>,
    /// The middle of that.
    middle: Point,
    /// The mean of the coils.
    centre: Point,
    /// Of every coil how far it is expected behind the tip, or behind the coil before it, and the standard deviation of that.
    expected: Vec<[f64; 2]>,
    /// Of every node how an axis of it moves with the unknowns of the shape along that axis, m.
    by_shape: Vec<DVector<f64>>,
    /// Of every node where the mean tensions carry it, and how it moves with the unknowns of the tensions, m.
    posture: Vec<Point>,
    by_tension: Vec<Vec<Point>>,
    /// The palate of the body, the trace, and the factor of the covariance of their distances; empty where one of them is not there.
    palate: Vec<Point>,
    trace: Vec<Point>,
    of_trace: DMatrix<f64>,
    /// The foremost node of a bone, where it was seen, and the standard deviation of that.
    bones: Vec<(usize, Point, f64)>,
}

impl<'a> Search<'a> {
    fn new(
        seen: &'a Coils,
        body: &'a Body<2>,
        model: &Model,
        contracting: &[usize],
    ) -> Result<Self, RestError> {
        let measured = |i: usize| seen.behind.get(i).copied().flatten();
        let expected: Vec<[f64; 2]> = (0..seen.means.len())
            .map(|i| match (measured(i), i.checked_sub(1)) {
                (Some(at), _) => [at, MEASURED_SD_M],
                (None, None) => FIRST_COIL_M,
                (None, Some(before)) => [LONGER * (seen.means[i] - seen.means[before]).norm(), GAP_SD_M],
            })
            .collect();
        let palate = hard_palate(body.palate.as_deref().unwrap_or_default());
        let trace = evenly(&seen.palate, TRACE_POINTS).filter(|_| palate.len() > 1).unwrap_or_default();
        let mut along = vec![0.0; trace.len()];
        (1..trace.len()).for_each(|i| along[i] = along[i - 1] + (trace[i] - trace[i - 1]).norm());
        let shape = Rest::new(body, Similarity::IDENTITY)?;
        let (posture, by_tension) = postures(body, model, contracting)?;
        let nodes = &body.mesh.nodes;
        let bone = |(name, seen, sd): (&str, Option<Point>, f64)| {
            let mark = mark_of(body, name)?;
            let node = body.bone(name).iter().copied().find(|n| nodes[*n] == mark)?;
            Some((node, seen?, sd))
        };
        let bones = [(MANDIBLE, seen.spine, SPINE_SD_M), (HYOID, seen.hyoid, HYOID_SD_M)];
        Ok(Self {
            seen,
            surface: outline(body)?,
            rest: nodes,
            outline: body.mesh.surface_nodes(),
            middle: middle_of(body),
            centre: mean(seen.means.iter().copied()).unwrap_or_default(),
            expected,
            by_shape: shape.by_independent(),
            posture,
            by_tension,
            of_trace: factor(&along, PALATE_M)?,
            palate,
            trace,
            bones: bones.into_iter().filter_map(bone).collect(),
        })
    }

    /// Number of unknowns of the shape along an axis.
    fn shapes(&self) -> usize {
        self.by_shape.first().map_or(0, |r| r.len())
    }

    /// Begins at a turn, rad, with the expected places of the coils at their mean.
    fn start(&self, turn: f64) -> DVector<f64> {
        let tensions = self.by_tension.len();
        let mut x = DVector::zeros(4 + self.expected.len() + 2 * self.shapes() + tensions);
        x[2] = turn / TURN_SD;
        let away = self.away(&x, &self.places(&x));
        let shift = away.iter().sum::<Point>() / (away.len() as f64 * SHIFT_M);
        (x[0], x[1]) = (-shift.x, -shift.y);
        x
    }

    /// The similarity after the change of shape.
    fn similarity(&self, x: &DVector<f64>) -> Similarity {
        let about = Similarity::new((LN_SCALE_SD * x[3]).exp(), TURN_SD * x[2], Point::zeros());
        let to = self.centre + Point::new(x[0], x[1]) * SHIFT_M;
        Similarity::new(about.scale(), about.angle(), to - about.place(self.middle))
    }

    /// A node of the speaker's tongue at rest, before the similarity.
    fn changed(&self, x: &DVector<f64>, node: usize) -> Point {
        let (from, count) = (4 + self.expected.len(), self.shapes());
        let along = |axis: usize| self.by_shape[node].dot(&x.rows(from + axis * count, count));
        self.rest[node] + Point::new(along(0), along(1))
    }

    /// The similarity that brings the body nearest to the speaker's tongue at rest.
    fn nearest(&self, x: &DVector<f64>) -> Option<Similarity> {
        let similarity = self.similarity(x);
        let from: Vec<Point> = self.outline.iter().map(|&n| self.rest[n]).collect();
        let to: Vec<Point> = self.outline.iter().map(|&n| similarity.place(self.changed(x, n))).collect();
        Similarity::between(&from, &to)
    }

    /// What is told: where the middle of the body is carried, the turn and the logarithm of the scale.
    fn told(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let nearest = self.nearest(x)?;
        let at = nearest.place(self.middle);
        Some(DVector::from_vec(vec![at.x, at.y, nearest.angle(), nearest.scale().ln()]))
    }

    /// How far behind the tip each coil is.
    fn places(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut at = 0.0;
        let place = |(i, [by, sd]): (usize, &[f64; 2])| {
            let by = by + sd * x[4 + i];
            let measured = self.seen.behind.get(i).copied().flatten().is_some();
            at = if measured { by } else { at + by };
            at
        };
        self.expected.iter().enumerate().map(place).collect()
    }

    /// From where each coil was seen in the mean to where the speaker's tongue has it.
    fn away(&self, x: &DVector<f64>, behind: &[f64]) -> Vec<Point> {
        let similarity = self.similarity(x);
        let tensions = x.rows(x.len() - self.by_tension.len(), self.by_tension.len());
        let node = |n: usize| -> Point {
            let pulled: Point = self.by_tension.iter().zip(tensions.iter()).map(|(by, t)| by[n] * *t).sum();
            self.changed(x, n) + self.posture[n] + pulled
        };
        let on_tongue = |behind: &f64| -> Point {
            let at = (self.surface.tip - behind / similarity.scale()).clamp(0.0, self.surface.curve.length());
            self.surface.curve.weights(at).iter().map(|(n, w)| node(*n) * *w).sum()
        };
        behind.iter().zip(&self.seen.means).map(|(b, seen)| similarity.place(on_tongue(b)) - seen).collect()
    }

    fn residuals(&self, x: &DVector<f64>) -> Option<DVector<f64>> {
        let away = self.away(x, &self.places(x));
        let mut out: Vec<f64> = away.iter().flat_map(|a| [a.x / COIL_SD_M, a.y / COIL_SD_M]).collect();
        if !self.trace.is_empty() {
            let nearest = self.nearest(x)?;
            let beside = self.trace.iter().map(|p| nearest.scale() * beside(&self.palate, nearest.back(*p)));
            let beside = DVector::from_iterator(self.trace.len(), beside);
            out.extend(self.of_trace.solve_lower_triangular(&beside)?.iter().copied());
        }
        let similarity = self.similarity(x);
        for (node, seen, sd) in &self.bones {
            let away = (similarity.place(self.changed(x, *node)) - seen) / *sd;
            out.extend([away.x, away.y]);
        }
        out.extend(x.iter().skip(2).copied());
        Some(DVector::from_vec(out)).filter(|r: &DVector<f64>| r.iter().all(|v| v.is_finite()))
    }
}

/// Of every node where the usual mean tensions carry it from rest, and how it moves with a standard deviation more of each, m.
fn postures(
    body: &Body<2>,
    model: &Model,
    contracting: &[usize],
) -> Result<(Vec<Point>, Vec<Vec<Point>>), RestError> {
    let system = System::new(&body.mesh, model, contracting).map_err(|e| RestError::Body(e.to_string()))?;
    let mut workspace = Workspace::new(&system);
    let mut solve = |more: Option<usize>| -> Result<Vec<Point>, RestError> {
        let mut tensions = vec![0.0; system.muscle_count()];
        contracting.iter().for_each(|m| tensions[*m] = TENSION_N[0]);
        more.into_iter().for_each(|m| tensions[m] += TENSION_N[1]);
        workspace.start_from_rest(&system);
        let done = statics::solve(&system, &mut workspace, &tensions, &SolveSettings::default());
        match done.status {
            SolveStatus::Converged => Ok(workspace.positions().to_vec()),
            _ => Err(RestError::Body("it has no equilibrium at usual tensions".to_owned())),
        }
    };
    let less = |a: Vec<Point>, b: &[Point]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<Point>>();
    let usual = solve(None)?;
    let rates = contracting.iter().map(|m| Ok(less(solve(Some(*m))?, &usual)));
    let rates = rates.collect::<Result<Vec<_>, RestError>>()?;
    Ok((less(usual, &body.mesh.nodes), rates))
}

/// The middle of the outline of a body at rest, m.
fn middle_of(body: &Body<2>) -> Point {
    mean(body.mesh.surface_nodes().into_iter().map(|n| body.mesh.nodes[n])).unwrap_or_default()
}

/// The lower factor of the covariance of points at these places along a line.
fn factor(at: &[f64], [sd, together, alone]: [f64; 3]) -> Result<DMatrix<f64>, RestError> {
    let covariance = DMatrix::from_fn(at.len(), at.len(), |i, j| {
        let apart = (at[i] - at[j]) / together;
        sd * sd * (-0.5 * apart * apart).exp() + if i == j { alone * alone } else { 0.0 }
    });
    covariance.cholesky().map(|c| c.l()).ok_or_else(|| RestError::Body("coils coincide".to_owned()))
}

/// A palate from the edges of the upper teeth on, which are its foremost points, with a straight piece behind its end.
fn hard_palate(palate: &[Point]) -> Vec<Point> {
    let foremost = (0..palate.len()).min_by(|&a, &b| palate[a].x.total_cmp(&palate[b].x)).unwrap_or(0);
    let mut out = palate.get(foremost..).unwrap_or_default().to_vec();
    if let [.., before, last] = out[..]
        && let Some(on) = (last - before).try_normalize(0.0)
    {
        out.push(last + on * BEYOND_M);
    }
    out
}

/// Distance of a point from a line, positive above a line that runs to the back.
fn beside(line: &[Point], p: Point) -> f64 {
    let one = |w: &[Point]| {
        let (along, to) = (w[1] - w[0], p - w[0]);
        let part = (to.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        let away = to - along * part;
        (away.norm(), along.perp(&to))
    };
    let nearest = line.windows(2).map(one).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(0.0, |(distance, side)| if side < 0.0 { -distance } else { distance })
}

#[cfg(test)]
#[path = "coils_tests.rs"]
mod tests;
