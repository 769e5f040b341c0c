//! The memory of a solve.

use nalgebra::SVector;

use crate::effect::Configuration;
use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;
use crate::system::System;

use super::mass_spring::Single;

/// Everything that a solve writes to. There is one for each thread and system, and it is reused without
/// allocating.
#[derive(Debug)]
pub struct Workspace<const D: usize> {
    /// Positions of all nodes, m: the start before a solve, the result after it.
    pub(super) positions: Vec<SVector<f64, D>>,
    pub(super) tensions: Vec<f64>,
    pub(super) trial: Vec<SVector<f64, D>>,
    pub(super) force: Vec<SVector<f64, D>>,
    /// The step of every node, m (zero where fixed).
    pub(super) step: Vec<SVector<f64, D>>,
    /// One vector for each unknown, in elimination order.
    pub(super) unknowns: Vec<SVector<f64, D>>,
    pub(super) stiffness: BlockMatrix<D>,
    pub(super) factor: Factor<D>,
    /// Whether `factor` is that of a stiffness near the present positions.
    pub(super) factor_ready: bool,
    /// Whether the last factorisation in an iteration was one of the exact stiffness.
    pub(super) factor_is_exact: bool,
    /// A direction of negative curvature, one vector for each unknown, in elimination order.
    pub(super) curvature: Vec<SVector<f64, D>>,
    /// Bone nodes that are displaced from rest, and their new positions, m.
    pub(super) carried: Vec<(usize, SVector<f64, D>)>,
    /// For mass-spring bodies in the plane, the start of a solve.
    pub(super) single: Option<Single>,
}

impl<const D: usize> Workspace<D> {
    /// A workspace for `system`, with the positions at rest.
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
            carried: system.carried().to_vec(),
            single: Single::new(system),
        }
    }

    /// Another workspace at rest for the same system, with the same bones carried to the same places.
    pub(super) fn another(&self, system: &System<D>) -> Self {
        Self { carried: self.carried.clone(), ..Self::new(system) }
    }

    /// The next solve puts bone nodes at their places in the system, shifted by `shift` (m).
    pub fn carry_bone(&mut self, system: &System<D>, nodes: &[usize], shift: SVector<f64, D>) {
        for &node in nodes {
            let held =
                system.carried().iter().find(|(n, _)| *n == node).map_or(system.rest()[node], |(_, at)| *at);
            match self.carried.iter_mut().find(|(n, _)| *n == node) {
                Some((_, to)) => *to = held + shift,
                None => self.carried.push((node, held + shift)),
            }
        }
    }

    /// Takes over an equilibrium that was solved elsewhere; `None` if the lists have other lengths than those of this
    /// system.
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

    /// Force on every node after a solve, N: the residual on free nodes, minus the reaction on bone.
    pub fn force(&self) -> &[SVector<f64, D>] {
        &self.force
    }

    /// Starts the next solve from the rest shape.
    pub fn start_from_rest(&mut self, system: &System<D>) {
        self.positions.copy_from_slice(system.rest());
        self.forget_factor();
    }

    /// The next solve begins with a new factor.
    pub(super) fn forget_factor(&mut self) {
        self.factor_ready = false;
        self.factor_is_exact = false;
        self.single.iter_mut().for_each(Single::forget_factor);
    }

    /// Starts the next solve from given positions, m, one for each node: those of a solved neighbour, whose
    /// stiffness is taken to be like that of the last solve.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn start_from(&mut self, positions: &[SVector<f64, D>]) {
        self.positions.copy_from_slice(positions);
    }
}
