//! Static equilibrium: the minimum of the potential energy, found by Newton's method.
//!
//! `minimise E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²` over the free nodes. Masses,
//! dampers, Q2 and the contractile dampers have no effect on where it lies, so none of them is computed.
//!
//! What is checked when:
//!
//! | | by [`solve`] | with [`Settings::certify`] | by [`trace()`] |
//! |---|---|---|---|
//! | forces cancel to the tolerance, or to a rounding that is of no account beside the load | always | always | always |
//! | no cell is turned over (kept so by every step; of springs alone: reported) | always | always | always |
//! | all eigenvalues of the stiffness are positive | at the last factorisation, a step or two before the solution; at the solution where that one was not exact | at the solution | at every step |
//! | the equilibrium is connected to rest by a branch of stable ones | not; [`Solution::connection`] says what is known | not | by following the branch there and back |
//!
//! A direct solve costs what one equilibrium costs and a trace about three for each of its steps. How often both agree is
//! measured over all subsets of the muscles by `tongue-fit stability` (`results/stability`).

mod carry;
mod newton;
mod rescue;
mod response;
mod stability;
mod trace;

use nalgebra::SVector;
use serde::Serialize;

use crate::effect::Configuration;
use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;
use crate::system::System;

pub use carry::solve;
pub use response::{Response, length_sensitivities};
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
    /// Whether to check the stability of every solution by a factorisation of the exact stiffness at it. Default false: the
    /// last factorisation, a step or two before the solution, is then taken for it wherever it was exact.
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
    /// The residual force is below the tolerance, or as small as rounding lets it be and of no account beside the load, and the
    /// equilibrium is not known to be unstable.
    Converged,
    /// An equilibrium was found, but an unstable one, and no way downhill from it led to a stable one.
    Unstable,
    /// The iteration limit came first. What was reached in load steps is in [`Solution::load_reached`].
    IterationLimit,
    /// No step along a descent direction lowers the energy any more, or the steps that keep every cell from turning over
    /// have become too small; the residual force is still above the tolerance. Where [`Solution::rounding_force`] is of the
    /// size of the load, the body is too uneven for double precision.
    Stalled,
    /// An equilibrium, but one in which a cell is turned over: of a body without an effect that keeps its cells upright
    /// (neither incompressibility nor finite elements), springs alone.
    Inverted,
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

/// What is known of the way from rest to the solution. Two equilibria at the same load can lie on different branches: one
/// that the body reaches when the load grows from nothing, and others that it must be thrown into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Connection {
    /// Nothing: Newton's method went from its start to the solution at the whole load, and every step lowered the energy.
    Direct,
    /// Reached from rest in load steps, each begun at the equilibrium before.
    LoadSteps,
    /// On the way a ridge or an unstable equilibrium was left downhill, so it may well lie on another branch than rest.
    Downhill,
    /// Followed from rest, there and back, in steps ([`trace()`]): it lies on the branch that begins at rest.
    Traced,
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
    /// Force of which nothing is known in double precision, N: the stiffest entry times the rounding of a coordinate. A residual
    /// below it cannot be made smaller. Zero where nothing was factorised.
    pub rounding_force: f64,
    /// Potential energy, J.
    pub energy: f64,
    /// What is known of the stability.
    pub stability: Stability,
    /// What is known of the way from rest.
    pub connection: Connection,
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
    /// Bone nodes that are to be elsewhere than at rest, and where, m.
    carried: Vec<(usize, SVector<f64, D>)>,
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
            carried: system.carried().to_vec(),
        }
    }

    /// Has the next solve bring bone nodes to where they are in the system, and `shift` (m) from there.
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
