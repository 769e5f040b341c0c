//! The memory of a solve.

use std::sync::Arc;

use nalgebra::SVector;

use super::mass_spring::SimdNewton;
use crate::effect::Configuration;
use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;
use crate::system::System;
use crate::system::elements::Elements;

/// The memory of a solve, which solves of the same system and thread use again without allocating.
#[derive(Debug)]
pub struct Workspace<const D: usize> {
    /// Positions of all nodes, m: the start before a solve, the result after it.
    pub(super) positions: Vec<SVector<f64, D>>,
    pub(super) tensions: Vec<f64>,
    pub(super) trial: Vec<SVector<f64, D>>,
    pub(super) force: Vec<SVector<f64, D>>,
    /// Step of every node, m, zero at nodes that are no unknowns.
    pub(super) step: Vec<SVector<f64, D>>,
    /// One vector for each unknown in elimination order.
    pub(super) unknowns: Vec<SVector<f64, D>>,
    pub(super) stiffness: BlockMatrix<D>,
    pub(super) factor: Factor<D>,
    /// Whether `factor` is that of a stiffness near the present positions.
    pub(super) factor_ready: bool,
    /// Whether the last factorisation of an iteration was that of the exact stiffness.
    pub(super) factor_is_exact: bool,
    pub(super) curvature: Vec<SVector<f64, D>>,
    /// Displaced nodes of bones, and the positions that they have in the next solve, m.
    pub(super) displaced: Vec<(usize, SVector<f64, D>)>,
    /// The solver of mass-spring bodies in the plane, with one lane.
    pub(super) single: Option<(Arc<Elements>, SimdNewton<1>)>,
    /// Number of the system whose body is in that lane.
    pub(super) in_lane: Option<u64>,
}

impl<const D: usize> Workspace<D> {
    /// A workspace for `system` with the positions at rest.
    #[inline(never)]
    pub fn new(system: &System<D>) -> Self {
        let zeros = vec![SVector::zeros(); system.rest().len()];
        Self {
            positions: system.rest().to_vec(),
            tensions: vec![0.0; system.muscle_count()],
            trial: zeros.clone(),
            force: zeros.clone(),
            step: zeros,
            unknowns: vec![SVector::zeros(); system.pattern().unknowns()],
            curvature: vec![SVector::zeros(); system.pattern().unknowns()],
            stiffness: BlockMatrix::zeros(system.pattern()),
            factor: Factor::new(system.pattern()),
            factor_ready: false,
            factor_is_exact: false,
            displaced: system.displaced.clone(),
            single: system.elements().map(|elements| (elements.clone(), SimdNewton::new(elements))),
            in_lane: None,
        }
    }

    /// Places bone nodes in the next solve at their positions in the system plus `shift`, m.
    pub fn displace_bone(&mut self, system: &System<D>, nodes: &[usize], shift: SVector<f64, D>) {
        for &node in nodes {
            let place = system.bone_position(node) + shift;
            match self.displaced.iter_mut().find(|(n, _)| *n == node) {
                Some((_, to)) => *to = place,
                None => self.displaced.push((node, place)),
            }
        }
    }

    /// Copies an equilibrium that was solved elsewhere; `None` if the lists do not fit the system.
    pub(super) fn set(&mut self, positions: &[SVector<f64, D>], tensions: &[f64]) -> Option<()> {
        if positions.len() != self.positions.len() || tensions.len() != self.tensions.len() {
            return None;
        }
        self.positions.copy_from_slice(positions);
        self.tensions.copy_from_slice(tensions);
        Some(())
    }

    pub(super) fn configuration(&self) -> Configuration<'_, D> {
        Configuration { positions: &self.positions, tensions: &self.tensions }
    }

    /// Positions of all nodes, m.
    pub fn positions(&self) -> &[SVector<f64, D>] {
        &self.positions
    }

    /// Force on every node after a solve, N: the residual on free nodes, minus the reaction on bones.
    pub fn force(&self) -> &[SVector<f64, D>] {
        &self.force
    }

    pub fn start_from_rest(&mut self, system: &System<D>) {
        self.positions.copy_from_slice(system.rest());
        self.discard_factor();
    }

    /// Makes the next solve begin with a new factor.
    pub(super) fn discard_factor(&mut self) {
        self.factor_ready = false;
        self.factor_is_exact = false;
        self.single.iter_mut().for_each(|(_, work)| work.discard_factor());
    }

    /// Starts the next solve from the positions of all nodes, m, of a solved neighbour. It begins with the factor of the last solve.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn start_from(&mut self, positions: &[SVector<f64, D>]) {
        self.positions.copy_from_slice(positions);
    }
}
