//! Elastic supports: bones that hold a patch of the tissue's surface, and the symmetry plane of a half body.

use nalgebra::{SMatrix, SVector};

use super::{Configuration, Effect, Tangent};
use crate::body::Tie;
use crate::sparse::{BlockMatrix, Pattern, Slot};

/// `1/2 integral κ |u - v|² ds` over parts of the surface, with the displacements `u` of the tissue and `v` of the bone. Each [`Tie`] is a
/// constant quadratic form in the displacements of the nodes of both, the same in all directions. The force on the bone's nodes is the
/// reaction, as for nodes that are held directly.
#[derive(Debug, Clone)]
pub struct Attachment<const D: usize> {
    ties: Vec<(Tie, Vec<Slot>)>,
    stiffness: f64,
    rest: Vec<SVector<f64, D>>,
}

impl<const D: usize> Attachment<D> {
    /// Ties between nodes with these positions at rest, m. Their forms are multiplied by `stiffness`, N/m³ (2D: per metre of thickness).
    pub fn new(ties: &[Tie], stiffness: f64, rest_positions: &[SVector<f64, D>]) -> Self {
        let ties = ties.iter().map(|tie| (tie.clone(), Vec::new())).collect();
        Self { ties, stiffness, rest: rest_positions.to_vec() }
    }

    /// For each node of each tie its number, its displacement relative to the tie's first node, m, and the form's weighted sum of these
    /// displacements, N.
    fn sums<'a>(
        &'a self,
        positions: &'a [SVector<f64, D>],
    ) -> impl Iterator<Item = (usize, SVector<f64, D>, SVector<f64, D>)> + 'a {
        self.ties.iter().flat_map(move |(tie, _)| {
            let rows = tie.form.chunks_exact(tie.nodes.len());
            // Relative displacements can be used, because the form does not change with a common shift.
            let moved = move |node: usize| positions[node] - self.rest[node];
            let origin = moved(tie.nodes[0]);
            tie.nodes.iter().zip(rows).map(move |(&node, row)| {
                let sum: SVector<f64, D> =
                    tie.nodes.iter().zip(row).map(|(&other, c)| (moved(other) - origin) * *c).sum();
                (node, moved(node) - origin, sum * self.stiffness)
            })
        })
    }
}

impl<const D: usize> Effect<D> for Attachment<D> {
    fn name(&self) -> &'static str {
        "attachment"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.ties.iter().for_each(|(tie, _)| couple(&tie.nodes));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for (tie, slots) in &mut self.ties {
            *slots = pattern.pair_slots(&tie.nodes).collect();
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.sums(at.positions).map(|(_, moved, sum)| 0.5 * moved.dot(&sum)).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        self.sums(at.positions).for_each(|(node, _, sum)| force[node] -= sum);
    }

    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for (tie, slots) in &self.ties {
            let rows = tie.form.chunks_exact(tie.nodes.len()).enumerate();
            for (slot, c) in slots.iter().zip(rows.flat_map(|(i, row)| &row[i..])) {
                stiffness.add_symmetric(*slot, &(SMatrix::identity() * (c * self.stiffness)));
            }
        }
    }
}

/// Springs `1/2 k (x - x0)²` that hold nodes in a plane across an axis, so stiff that the remaining displacement is negligible. The
/// simulated half of a symmetric body ends at this plane.
#[derive(Debug, Clone)]
pub struct SymmetryPlane {
    axis: usize,
    stiffness: f64,
    /// Nodes on the plane, with their coordinates along the axis at rest, m.
    held: Vec<(usize, f64)>,
    slots: Vec<Slot>,
}

impl SymmetryPlane {
    /// Springs of `stiffness`, N/m, that hold these nodes along an axis at their positions at rest.
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
        let away = self.held.iter().map(|(n, rest)| at.positions[*n][self.axis] - rest);
        away.map(|by| 0.5 * self.stiffness * by.powi(2)).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for &(n, rest) in &self.held {
            force[n][self.axis] -= self.stiffness * (at.positions[n][self.axis] - rest);
        }
    }

    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        let mut block = SMatrix::zeros();
        block[(self.axis, self.axis)] = self.stiffness;
        self.slots.iter().for_each(|slot| stiffness.add_symmetric(*slot, &block));
    }
}
