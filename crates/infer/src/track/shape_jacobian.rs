//! Derivatives of the observations of frames by the shape at rest, ends of muscles included.

use nalgebra::{DMatrix, DVector, SVector};

use super::frame::{Frame, FramePosture, FrameSolver};
use super::jacobian::{DerivativeColumns, DerivativeUnit, Rates};
use super::rest_shape::{RestShape, STEP};
use super::smoother::{SmoothedRecording, Smoother, in_chunks};
use tongue_core::effect::Configuration;
use tongue_core::geometry::Point;
use tongue_core::statics::lanes::UnitChange;

/// Derivatives of a frame's observations and hidden points by the shape, mm.
pub(super) struct ShapeJacobian {
    pub fitted: DMatrix<f64>,
    pub hidden: DMatrix<f64>,
}

/// Derivatives of all frames by the shape; `None` where the shape is known or a frame has no equilibrium.
pub(super) fn shape_jacobians(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
) -> Vec<Option<ShapeJacobian>> {
    let Some(shape) = smoother.context.shape else { return recording.frames.iter().map(|_| None).collect() };
    in_chunks(0..recording.frames.len(), |chunk| {
        let known: Vec<usize> =
            chunk.iter().copied().filter(|&t| recording.here[t].linear.is_some()).collect();
        let x: Vec<_> = known.iter().map(|&t| smoother.unknowns_of(recording, t)).collect();
        let postures = Vec::from_iter(known.iter().zip(&x).map(|(&t, x)| {
            let from = recording.here[t].linear.as_ref().map(|linear| &*linear.positions);
            (&recording.frames[t], x, from)
        }));
        let rates = shape.rates(&mut smoother.solver(), &postures);
        let mut out: Vec<Option<ShapeJacobian>> = chunk.iter().map(|_| None).collect();
        for (t, all) in known.into_iter().zip(rates) {
            out[t - chunk[0]] = all;
        }
        out
    })
}

impl RestShape {
    /// Derivatives of frames by each direction, mm; `None` for a frame without an equilibrium at its positions.
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
            is_finite.then(|| ShapeJacobian {
                fitted: rates.jacobian_of_fitted(),
                hidden: rates.jacobian_of_hidden(),
            })
        }))
    }

    /// Adds the derivatives by the directions that move coils along the surface.
    fn add_coils(&self, rates: &mut Rates, frame: &Frame) {
        let Rates { positions, by_unknown, .. } = rates;
        let first = by_unknown.ncols() - self.prior.coils.len();
        for (k, (coil, weights)) in self.prior.coils.iter().enumerate() {
            let motion: Point = weights.iter().map(|(n, w)| positions[*n] * *w).sum();
            let rows = frame.observations.iter().chain(&frame.hidden).enumerate();
            for (row, hidden) in rows.filter(|(_, hidden)| hidden.name == *coil) {
                by_unknown[(row, first + k)] =
                    hidden.along.channel.checked_sub(1).map_or(0.0, |axis| 1e3 * motion[axis]);
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

    /// The factorised stiffness turns the forces of each perturbed body into motion.
    fn set_alone(&self, solver: &mut FrameSolver<'_>, x: &DVector<f64>, rates: &mut Rates) -> Option<()> {
        let tensions = solver.tensions_of(x);
        let positions = rates.positions.clone();
        let mut free = vec![false; positions.len()];
        solver.system.pattern().nodes().iter().for_each(|&n| free[n] = true);
        let mut response = solver.response()?;
        let (mut before, mut after) =
            (vec![SVector::zeros(); positions.len()], vec![SVector::zeros(); positions.len()]);
        self.system.force(Configuration { positions: &positions, tensions: &tensions }, &mut before);
        for (k, (direction, changed)) in
            self.prior.directions.iter().zip(self.perturbed_systems()?).enumerate()
        {
            // Nodes on bone move with the body at rest.
            let there: Vec<Point> = Vec::from_iter(
                positions.iter().enumerate().map(|(n, p)| if free[n] { *p } else { p + direction[n] * STEP }),
            );
            changed.force(Configuration { positions: &there, tensions: &tensions }, &mut after);
            response.compute_for_load(|_, load| {
                for (l, (a, b)) in load.iter_mut().zip(after.iter().zip(&before)) {
                    *l += (a - b) / STEP;
                }
            });
            rates.set_column(k, |n| if free[n] { response.motion()[n] } else { direction[n] }, 1.0);
        }
        Some(())
    }
}
