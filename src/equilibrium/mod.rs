//! Static equilibrium: the minimum of the potential energy, found by Newton's method.
//!
//! `minimise E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²` over the free nodes. Masses,
//! dampers, Q2 and the contractile dampers have no effect on where it lies, so none of them is computed.

mod carry;
mod newton;
mod rescue;
mod sensitivity;
mod stability;
mod trace;

use nalgebra::SVector;
use serde::Serialize;

use crate::effect::Configuration;
use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;
use crate::system::System;

pub use carry::solve;
pub use sensitivity::length_sensitivities;
pub use stability::smallest_eigenvalue;
pub use trace::{Critical, CriticalKind, Trace, trace};

/// When a solve stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest residual force on a free node that counts as equilibrium, N. Default 1e-9.
    pub tolerance: f64,
    /// Most Newton iterations. Default 200; with load steps, of each of them.
    pub max_iterations: usize,
    /// Most steps in which the load is put on where the direct solve fails. Default 60; 0 gives up at once.
    pub load_steps: usize,
    /// Whether to check the stability of every solution by a factorisation of the exact stiffness at it and to compute its
    /// smallest eigenvalue. Default false: the last factorisation, a step or two before the solution, is then taken for it
    /// wherever it was exact.
    pub certify: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-9, max_iterations: 200, load_steps: 60, certify: false }
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The residual force is below the tolerance, or as small as rounding lets it be, and the equilibrium is not known to be
    /// unstable.
    Converged,
    /// An equilibrium was found, but an unstable one, and no way downhill from it led to a stable one.
    Unstable,
    /// The iteration limit came first. What was reached in load steps is in [`Solution::load_reached`].
    IterationLimit,
    /// No step along a descent direction lowers the energy any more, or the steps that keep every cell from turning over
    /// have become too small; the residual force is still above the tolerance.
    Stalled,
    /// A tension, position or energy is not a finite number, or there are not as many tensions as muscles.
    NotFinite,
}

/// What is known of the eigenvalues of the stiffness at the solution, over the free nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// Nothing: no equilibrium was reached.
    Unchecked,
    /// All were positive at the last factorisation, a step or two before the solution.
    Near,
    /// All are positive at the solution.
    Stable,
    /// None is negative, but some are zero to rounding: a slack chain can be moved without work.
    Neutral,
    /// At least one is negative.
    Unstable,
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
    /// What is known of the stability.
    pub stability: Stability,
    /// Smallest eigenvalue of the stiffness of the free nodes, N/m; only where [`Settings::certify`] asks for it.
    pub smallest_eigenvalue: Option<f64>,
    /// Part of the tensions at which the positions left behind are an equilibrium: 1 when converged, less where load stepping
    /// stopped, 0 where no equilibrium was found.
    pub load_reached: f64,
    /// Load steps taken; 0 where the direct solve succeeded.
    pub load_steps: usize,
    /// Unstable equilibria that the solve found and left downhill: more than none means that there is another equilibrium, and
    /// that the branch left is not the one reached. Only looked for where the stability is checked at the solution.
    pub escapes: usize,
    /// Iterations that went on along a direction of negative curvature, off a ridge of the energy.
    pub ridges: usize,
    /// Elements in which the barrier against inversion acts: where there are any, the answer is not that of the published law
    /// (see [`crate::effect::barrier`]).
    pub guarded: usize,
}

/// All that a solve writes to. One for each thread and system; reused from solve to solve without allocating.
#[derive(Debug)]
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
    /// Whether the last factorisation in an iteration was one of the exact stiffness.
    factor_is_exact: bool,
    /// A direction of negative curvature, one vector for each unknown, in elimination order.
    curvature: Vec<SVector<f64, D>>,
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
            curvature: vec![SVector::zeros(); system.pattern().unknowns()],
            stiffness: BlockMatrix::zeros(system.pattern()),
            factor: Factor::new(system.pattern()),
            factor_ready: false,
            factor_is_exact: false,
        }
    }

    fn configuration(&self) -> Configuration<'_, D> {
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
        self.factor_ready = false;
        self.factor_is_exact = false;
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
