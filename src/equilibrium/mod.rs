//! Static equilibrium: the minimum of the potential energy, found by Newton's method.
//!
//! `minimise E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²` over the free nodes. Masses,
//! dampers, Q2 and the contractile dampers have no effect on where it lies, so none of them is computed.

mod carry;
mod newton;
mod sensitivity;

use nalgebra::SVector;
use serde::Serialize;

use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;
use crate::system::System;

pub use carry::solve;
pub use sensitivity::length_sensitivities;

/// When a solve stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest residual force on a free node that counts as equilibrium, N. Default 1e-9.
    pub tolerance: f64,
    /// Most Newton iterations. Default 200.
    pub max_iterations: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-9, max_iterations: 200 }
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The residual force is below the tolerance, or as small as rounding lets it be.
    Converged,
    /// The iteration limit came first.
    IterationLimit,
    /// No step along a descent direction lowers the energy any more, or the steps that keep every cell from turning over
    /// have become too small; the residual force is still above the tolerance.
    Stalled,
    /// A tension, position or energy is not a finite number, or there are not as many tensions as muscles.
    NotFinite,
}

/// What a solve did; the positions are in the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solution {
    /// How it ended.
    pub status: Status,
    /// Newton iterations.
    pub iterations: usize,
    /// Factorisations, failed ones included.
    pub factorisations: usize,
    /// Evaluations of the energy.
    pub energy_evaluations: usize,
    /// Iterations in which the exact stiffness was not positive definite and a safeguarded one was used.
    pub safeguarded: usize,
    /// Largest force on a free node, N.
    pub max_residual_force: f64,
    /// Potential energy, J.
    pub energy: f64,
}

/// All that a solve writes to. One for each thread and system; reused from solve to solve without allocating.
#[derive(Debug, Clone)]
pub struct Workspace<const D: usize> {
    /// Positions of all nodes, m: the start before a solve, the result after it.
    positions: Vec<SVector<f64, D>>,
    tensions: Vec<f64>,
    trial: Vec<SVector<f64, D>>,
    force: Vec<SVector<f64, D>>,
    /// The step of every node, m (zero where fixed).
    step: Vec<SVector<f64, D>>,
    /// One vector for each unknown, in elimination order.
    unknowns: Vec<SVector<f64, D>>,
    stiffness: BlockMatrix<D>,
    factor: Factor<D>,
    /// Whether `factor` holds that of a stiffness near the present positions.
    factor_ready: bool,
}

impl<const D: usize> Workspace<D> {
    /// A workspace for `system`, with the positions at rest.
    pub fn new(system: &System<D>) -> Self {
        let zeros = vec![SVector::zeros(); system.rest().len()];
        Self {
            positions: system.rest().to_vec(),
            tensions: vec![0.0; system.muscle_count()],
            trial: zeros.clone(),
            force: zeros.clone(),
            step: zeros,
            unknowns: vec![SVector::zeros(); system.pattern().unknowns()],
            stiffness: BlockMatrix::zeros(system.pattern()),
            factor: Factor::new(system.pattern()),
            factor_ready: false,
        }
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
        self.factor_ready = false;
    }

    /// Starts the next solve from given positions, m, one for each node: those of a solved neighbour, whose stiffness is taken
    /// to be like that of the last solve.
    ///
    /// # Panics
    /// If there are not as many positions as nodes.
    pub fn start_from(&mut self, positions: &[SVector<f64, D>]) {
        self.positions.copy_from_slice(positions);
    }
}
