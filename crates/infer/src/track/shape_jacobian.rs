//! Derivatives of the observations of frames by the shape at rest, ends of muscles included.

use nalgebra::DMatrix;

use super::frame::{Frame, FramePosture, FrameSolver};
use super::jacobian::{Columns, Rates};
use super::rest_shape::RestShape;
use super::smoother::{SmoothedRecording, Smoother, in_chunks};
use tongue_core::geometry::Point;

/// Derivatives of the observations of all frames by the shape, mm; `None` where the shape is known or a frame has no equilibrium.
pub(super) fn shape_jacobians(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
) -> Vec<Option<DMatrix<f64>>> {
    let Some(shape) = smoother.context.shape else { return vec![None; recording.frames.len()] };
    in_chunks(0..recording.frames.len(), |chunk| {
        let known: Vec<usize> =
            chunk.iter().copied().filter(|&t| recording.here[t].linear.is_some()).collect();
        let x: Vec<_> = known.iter().map(|&t| smoother.unknowns_of(recording, t)).collect();
        let postures = Vec::from_iter(known.iter().zip(&x).map(|(&t, x)| {
            let from = recording.here[t].linear.as_ref().map(|linear| &*linear.positions);
            (&recording.frames[t], x, from)
        }));
        let mut rates = shape.rates(&mut smoother.solver(), &postures).into_iter();
        Vec::from_iter(chunk.iter().map(|&t| {
            recording.here[t].linear.as_ref()?;
            Some(rates.next()??.jacobian_of_fitted())
        }))
    })
}

impl RestShape {
    /// Derivatives of frames by each direction, mm; `None` for a frame without an equilibrium at its positions.
    pub(super) fn rates(
        &self,
        solver: &mut FrameSolver<'_>,
        postures: &[FramePosture<'_>],
    ) -> Vec<Option<Rates>> {
        let found = solver.rates(&Columns::Shape(self), postures).into_iter().zip(postures);
        Vec::from_iter(found.map(|(rates, (frame, ..))| {
            let mut rates = rates?;
            self.add_coils(&mut rates, frame);
            rates.by_unknown.iter().all(|v| v.is_finite()).then_some(rates)
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
