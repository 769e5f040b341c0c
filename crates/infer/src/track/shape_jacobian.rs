//! Derivatives of the observations of frames by the shape at rest, ends of muscles included.

use nalgebra::DMatrix;

use super::frame::{Frame, FramePosture, FrameSolver};
use super::jacobian::{Columns, Rates};
use super::rest_shape::RestShape;
use super::smoother::{SmoothedRecording, Smoother, in_chunks};
use tongue_core::geometry::Point;

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
        let mut rates = shape.rates(&mut smoother.solver(), &postures).into_iter();
        let has_equilibrium = chunk.iter().map(|&t| recording.here[t].linear.is_some());
        has_equilibrium.map(|has| if has { rates.next()? } else { None }).collect()
    })
}

impl RestShape {
    /// Derivatives of frames by each direction, mm; `None` for a frame without an equilibrium at its positions.
    pub(super) fn rates(
        &self,
        solver: &mut FrameSolver<'_>,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<ShapeJacobian>> {
        let found = solver.rates(&Columns::Shape(self), postures).into_iter().zip(postures);
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
