//! How the surface in a frame responds to changes of the shape at rest, among them those in which the ends of muscles move.

use nalgebra::{DMatrix, DVector, SVector};

use super::frame::{Frame, FramePosture, FrameSolver};
use super::jacobian::{DerivativeColumns, DerivativeUnit, Rates};
use super::shape::{RestShape, STEP};
use super::smoother::{CHUNK, SmoothedRecording, Smoother};
use crate::standard_deviations::{FAR_END_MM, MUSCLE_END_MM};
use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::effect::Configuration;
use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statics::lanes::UnitChange;

/// Derivatives of the observations of a frame and of its hidden points by the shape, mm.
pub(super) struct ShapeJacobian {
    pub seen: DMatrix<f64>,
    pub hidden: DMatrix<f64>,
}

/// Derivatives of all frames by the shape.
pub(super) fn by_shape(
    mode: &Smoother<'_, '_>,
    course: &SmoothedRecording,
    shape: Option<&RestShape>,
) -> Vec<Option<ShapeJacobian>> {
    let Some(shape) = shape else { return course.frames.iter().map(|_| None).collect() };
    let numbers: Vec<usize> = (0..course.frames.len()).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let by_chunk = parallel::map(&chunks, |chunk: &&[usize]| -> Vec<Option<ShapeJacobian>> {
        let known: Vec<usize> = chunk.iter().copied().filter(|&t| course.here[t].linear.is_some()).collect();
        let x: Vec<_> = known.iter().map(|&t| mode.unknowns(&course.here[t].z, &mode.shared)).collect();
        let postures = Vec::from_iter(known.iter().zip(&x).map(|(&t, x)| {
            let from = course.here[t].linear.as_ref().map(|linear| &*linear.positions);
            (&course.frames[t], x, from)
        }));
        let rates = shape.rates(&mut (mode.solver)(), &postures);
        let mut out: Vec<Option<ShapeJacobian>> = chunk.iter().map(|_| None).collect();
        for (t, all) in known.into_iter().zip(rates) {
            out[t - chunk[0]] = all;
        }
        out
    });
    by_chunk.into_iter().flatten().collect()
}

impl RestShape {
    /// Derivatives of the residuals of frames and of the distances of their hidden points, mm, by each direction; `None` for a frame without
    /// an equilibrium at its positions.
    pub(super) fn rates(
        &self,
        solver: &mut FrameSolver<'_>,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<ShapeJacobian>> {
        let found = solver.rates(self, postures).into_iter().zip(postures);
        Vec::from_iter(found.map(|(rates, (frame, ..))| {
            let mut rates = rates?;
            self.add_coils(&mut rates, frame);
            let is_finite = rates.by_unknown.iter().all(|v| v.is_finite());
            is_finite.then(|| ShapeJacobian { seen: rates.of_seen(), hidden: rates.of_hidden() })
        }))
    }

    /// Adds the derivatives by the directions that move coils along the surface.
    fn add_coils(&self, rates: &mut Rates, frame: &Frame) {
        let Rates { positions, by_unknown, .. } = rates;
        let first = by_unknown.ncols() - self.prior.coils.len();
        let hidden = frame.hidden.iter().map(|h| (&h.name, &h.along));
        let rows: Vec<_> = frame.names.iter().zip(&frame.along).chain(hidden).collect();
        for (k, (coil, weights)) in self.prior.coils.iter().enumerate() {
            let motion: Point = weights.iter().map(|(n, w)| positions[*n] * *w).sum();
            for (row, (_, along)) in rows.iter().enumerate().filter(|(_, (name, _))| *name == coil) {
                by_unknown[(row, first + k)] =
                    along.channel.checked_sub(1).map_or(0.0, |axis| 1e3 * motion[axis]);
            }
        }
    }
}

impl DerivativeColumns for RestShape {
    const UNIT: DerivativeUnit = DerivativeUnit::Millimetres;

    fn count(&self) -> usize {
        RestShape::count(self)
    }

    fn changes(&self) -> Option<Vec<UnitChange<'_, 2>>> {
        Some(self.in_lanes()?.iter().map(UnitChange::Rest).collect())
    }

    fn by_unknown(&self, _: usize, _: &DVector<f64>) -> f64 {
        1.0
    }

    /// The factorised stiffness turns the forces of each changed body into motion.
    fn set_alone(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let tensions = solver.tensions_of(x);
        let positions = rates.positions.clone();
        let mut free = vec![false; positions.len()];
        solver.system.pattern().nodes().iter().for_each(|&n| free[n] = true);
        let mut response = solver.response()?;
        let (mut before, mut after) =
            (vec![SVector::zeros(); positions.len()], vec![SVector::zeros(); positions.len()]);
        self.system.force(Configuration { positions: &positions, tensions: &tensions }, &mut before);
        for (k, (direction, changed)) in self.prior.directions.iter().zip(self.changed()?).enumerate() {
            // Nodes on bone move with the body at rest.
            let there: Vec<Point> = Vec::from_iter(
                positions.iter().enumerate().map(|(n, p)| if free[n] { *p } else { p + direction[n] * STEP }),
            );
            changed.force(Configuration { positions: &there, tensions: &tensions }, &mut after);
            response.to_load(|_, load| {
                for (l, (a, b)) in load.iter_mut().zip(after.iter().zip(&before)) {
                    *l += (a - b) / STEP;
                }
            });
            rates.set(k, |n| if free[n] { response.motion()[n] } else { direction[n] }, 1.0);
        }
        Some(())
    }
}

/// A node where muscles cross moves along the other muscle; if the sine of their angle is smaller than this it stays.
const LEAST_SINE: f64 = 0.3;

/// Motion of the nodes when an end of a muscle moves: its straight line turns with the end; ends on the outline slide along it.
pub(super) fn ends(body: &Body<2>) -> Vec<Vec<Point>> {
    let mesh = &body.mesh;
    let outline = mesh.outlines().into_iter().max_by_key(Vec::len).unwrap_or_default();
    let inside = mesh.in_tissue();
    let fixed = |n: usize| mesh.fixed.binary_search(&n).is_ok();
    let seen = |n: usize| [MANDIBLE, HYOID].iter().any(|b| body.bone(b).contains(&n));
    let mut nodes: Vec<usize> = mesh.muscles.iter().flat_map(|m| m.ends()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut out = Vec::new();
    for end in nodes {
        let on_outline = outline.iter().position(|&n| n == end).filter(|_| !fixed(end));
        let ways: Vec<Point> = match on_outline {
            Some(i) => {
                let count = outline.len();
                let (before, after) = (outline[(i + count - 1) % count], outline[(i + 1) % count]);
                (mesh.nodes[after] - mesh.nodes[before]).try_normalize(0.0).into_iter().collect()
            }
            None => vec![Point::x(), Point::y()],
        };
        for way in ways {
            let mut moved = vec![Point::zeros(); mesh.nodes.len()];
            moved[end] = way * (1e-3 * (if fixed(end) && !seen(end) { FAR_END_MM } else { MUSCLE_END_MM }));
            for (number, muscle) in mesh.muscles.iter().enumerate() {
                let [a, b] = muscle.ends();
                let other = if a == end { b } else { a };
                let line = mesh.nodes[other] - mesh.nodes[end];
                if (a != end && b != end) || line.norm() <= 0.0 {
                    continue;
                }
                let normal = Point::new(-line.y, line.x) / line.norm();
                for &node in muscle.nodes.iter().filter(|&&n| n != a && n != b && !fixed(n)) {
                    let part = 1.0 - (mesh.nodes[node] - mesh.nodes[end]).dot(&line) / line.norm_squared();
                    let across = normal.dot(&moved[end]) * part.clamp(0.0, 1.0);
                    let crossing = crossing(mesh, number, node);
                    let along = crossing.unwrap_or(normal);
                    let sine = normal.dot(&along);
                    if inside[node] && sine.abs() < LEAST_SINE || outline.contains(&node) {
                        continue;
                    }
                    moved[node] = along * (across / sine);
                }
            }
            out.push(moved);
        }
    }
    out
}

/// The direction of another muscle that shares a node.
fn crossing(mesh: &Mesh<2>, number: usize, node: usize) -> Option<Point> {
    let other = mesh.muscles.iter().enumerate().find(|(i, m)| *i != number && m.nodes.contains(&node))?.1;
    let [a, b] = other.ends();
    (mesh.nodes[b] - mesh.nodes[a]).try_normalize(0.0)
}
