//! A plane that halves the body: nodes on it stay in it.

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::{Configuration, Effect, Tangent};

/// Springs that hold nodes in a plane across an axis, `1/2 k (x - x0)²` each, so stiff that the remaining
/// displacement is negligible. The simulated half of a symmetric body ends at this plane.
#[derive(Debug, Clone)]
pub struct SymmetryPlane {
    axis: usize,
    /// N/m.
    stiffness: f64,
    /// Nodes on the plane and where they are at rest along the axis, m.
    held: Vec<(usize, f64)>,
    slots: Vec<Slot>,
}

impl SymmetryPlane {
    /// The given nodes, held along an axis where they are at rest by springs of a stiffness, N/m.
    pub fn new<const D: usize>(
        axis: usize,
        stiffness: f64,
        nodes: &[usize],
        rest_positions: &[SVector<f64, D>],
    ) -> Self {
        let held = nodes.iter().map(|&n| (n, rest_positions[n][axis])).collect();
        Self { axis, stiffness, held, slots: Vec::new() }
    }
}

impl<const D: usize> Effect<D> for SymmetryPlane {
    fn name(&self) -> &'static str {
        "mirror"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.held.iter().for_each(|(n, _)| couple(&[*n]));
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.slots = self.held.iter().map(|(n, _)| pattern.slot(*n, *n)).collect();
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let away = |(n, rest): &(usize, f64)| at.positions[*n][self.axis] - rest;
        self.held.iter().map(|held| 0.5 * self.stiffness * away(held).powi(2)).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for &(n, rest) in &self.held {
            force[n][self.axis] -= self.stiffness * (at.positions[n][self.axis] - rest);
        }
    }

    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        let mut block = nalgebra::SMatrix::zeros();
        block[(self.axis, self.axis)] = self.stiffness;
        self.slots.iter().for_each(|slot| stiffness.add_symmetric(*slot, &block));
    }
}
