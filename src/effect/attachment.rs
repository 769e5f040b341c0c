//! Bones that hold a patch of the tissue's surface elastically.

use nalgebra::{SMatrix, SVector};

use crate::body::Tie;
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::{Configuration, Effect, Tangent};

/// `1/2 integral κ |u - v|² ds` over parts of the surface, `u` the displacement of the tissue and `v` that of the bone: for each
/// [`Tie`] a quadratic form in the positions of the nodes of both, constant and the same in all directions.
///
/// The force that it leaves on the nodes of the bone is the reaction, as with bones that hold nodes.
#[derive(Debug, Clone)]
pub struct Attachment {
    ties: Vec<(Tie, Vec<Slot>)>,
    stiffness: f64,
}

impl Attachment {
    /// Ties whose form is multiplied by `stiffness`, N/m³ (2D: per metre of thickness).
    pub fn new(ties: &[Tie], stiffness: f64) -> Self {
        Self { ties: ties.iter().map(|tie| (tie.clone(), Vec::new())).collect(), stiffness }
    }

    /// For each tie: its nodes, and for each of them the weighted sum of the positions of all, N.
    fn sums<'a, const D: usize>(
        &'a self,
        positions: &'a [SVector<f64, D>],
    ) -> impl Iterator<Item = (usize, SVector<f64, D>)> + 'a {
        self.ties.iter().flat_map(move |(tie, _)| {
            let rows = tie.form.chunks_exact(tie.nodes.len());
            // Relative to one of them, since the form does not see where the whole is.
            let origin = positions[tie.nodes[0]];
            tie.nodes.iter().zip(rows).map(move |(&node, row)| {
                let sum: SVector<f64, D> =
                    tie.nodes.iter().zip(row).map(|(&other, c)| (positions[other] - origin) * *c).sum();
                (node, sum * self.stiffness)
            })
        })
    }
}

impl<const D: usize> Effect<D> for Attachment {
    fn name(&self) -> &'static str {
        "attachment"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.ties.iter().for_each(|(tie, _)| couple(&tie.nodes));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for (tie, slots) in &mut self.ties {
            let nodes = &tie.nodes;
            *slots = nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| pattern.slot(a, b))).collect();
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let mut energy = 0.0;
        for (tie, _) in &self.ties {
            let (rows, origin) = (tie.form.chunks_exact(tie.nodes.len()), at.positions[tie.nodes[0]]);
            for (&node, row) in tie.nodes.iter().zip(rows) {
                let here = at.positions[node] - origin;
                for (&other, c) in tie.nodes.iter().zip(row) {
                    energy += 0.5 * c * here.dot(&(at.positions[other] - origin));
                }
            }
        }
        energy * self.stiffness
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        self.sums(at.positions).for_each(|(node, sum)| force[node] -= sum);
    }

    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for (tie, slots) in &self.ties {
            let count = tie.nodes.len();
            for (pair, (slot, c)) in slots.iter().zip(&tie.form).enumerate() {
                // The lower half of the form is the same as the upper.
                if pair / count <= pair % count {
                    stiffness.add_symmetric(*slot, &(SMatrix::identity() * (c * self.stiffness)));
                }
            }
        }
    }
}
