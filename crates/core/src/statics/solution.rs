//! Settings of a solve, and its result.

use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveSettings {
    /// Largest residual force on a free node that counts as equilibrium, N. Default 1e-9.
    pub tolerance: f64,
    /// Largest number of Newton iterations, in each load step. Default 200.
    pub max_iterations: usize,
    /// Largest number of load steps after a direct solve that failed. Default 60; with 0 there are none.
    pub load_steps: usize,
    /// Whether the exact stiffness is factorised at every solution to check its stability. Default false: the last factorisation, a step
    /// or two before the solution, shows the stability if it was exact.
    pub certify: bool,
    /// Largest number of solves of a [`trace()`](super::trace()), which then stops. Default 600.
    pub most_solves: usize,
    /// Whether a [`trace()`](super::trace()) that reaches the whole load also searches for a second stable shape: the load is doubled and
    /// reduced again, and the shapes before and after are compared. Default true; searches, which need only the shape that is reached from
    /// rest, set it to false.
    pub beyond: bool,
}

impl Default for SolveSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            max_iterations: 200,
            load_steps: 60,
            certify: false,
            most_solves: 600,
            beyond: true,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// The residual force is below the tolerance, or as small as rounding permits and negligible beside the load, and the equilibrium is
    /// not known to be unstable.
    Converged,
    /// The equilibrium is unstable, and descent from it led to no stable one.
    Unstable,
    /// The iteration limit was reached. [`Solution::load_reached`] has the part of the load that load steps reached.
    IterationLimit,
    /// No step along a descent direction lowers the energy, or the steps that invert no cell have become too small; the residual force is
    /// above the tolerance. If [`Solution::rounding_force`] is of the size of the load, the body is too uneven for double precision.
    Stalled,
    /// The equilibrium has an inverted cell; only bodies of springs alone, without incompressibility or a continuum, can have one.
    Inverted,
    /// A tension, position or energy is not finite, or there are not as many tensions as muscles.
    NotFinite,
}

/// Known signs of the eigenvalues of the stiffness of the free nodes at the solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// No equilibrium was reached, so that nothing is known.
    Unchecked,
    /// All were positive at the last factorisation, a step or two before the solution.
    Near,
    /// All are positive at the solution.
    Stable,
    /// None is negative, but some are zero to rounding: a slack chain moves without work.
    Neutral,
    /// At least one is negative.
    Unstable,
}

/// How the solution is connected to rest. Equilibria at the same load can lie on different branches, of which the body reaches one when
/// the load grows from zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Connection {
    /// Newton's method went from its start to the solution at the whole load, and every step lowered the energy.
    Direct,
    /// Load steps led to it from rest, each from the equilibrium before; with displaced bones from where the direct solve failed.
    LoadSteps,
    /// The solve descended from a state with negative curvature or an unstable equilibrium, so that the solution may lie on another branch
    /// than rest.
    Downhill,
    /// It was followed from rest and back in steps ([`super::trace()`]), so that it lies on the branch that begins at rest
    /// ([`super::FromRest::Branch`]).
    Traced,
}

/// Result and statistics of a solve, whose positions are in the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solution {
    pub status: SolveStatus,
    pub iterations: usize,
    /// Number of factorisations, failed ones included.
    pub factorisations: usize,
    pub energy_evaluations: usize,
    /// Iterations in which the exact stiffness was not positive definite and a safeguarded one was used.
    pub safeguarded: usize,
    /// Largest residual force on a free node, N.
    pub max_residual_force: f64,
    /// Rounding error of the force, N: the largest stiffness times the rounding of a coordinate. Newton's method cannot make the residual
    /// force smaller. Zero if nothing was factorised.
    pub rounding_force: f64,
    /// Potential energy, J.
    pub energy: f64,
    pub stability: Stability,
    pub connection: Connection,
    /// Part of the tensions at which the positions in the workspace are an equilibrium: 1 if converged, less if load steps stopped, 0 if
    /// no equilibrium was found.
    pub load_reached: f64,
    /// Number of load steps; 0 if the direct solve succeeded.
    pub load_steps: usize,
    /// Number of unstable equilibria from which the solve descended to another branch. They are counted only where the stability is
    /// checked at the solution.
    pub escapes: usize,
    /// Number of iterations along a direction of negative curvature.
    pub ridges: usize,
    /// Number of elements in which the barrier against inversion acts. If there are any, the solution is not one of the published law (see
    /// [`crate::effect::spring`]).
    pub guarded: usize,
}

impl Default for Solution {
    fn default() -> Self {
        Self::NONE
    }
}

impl Solution {
    /// The solution before any work, with nothing reached.
    pub const NONE: Self = Self {
        status: SolveStatus::IterationLimit,
        iterations: 0,
        factorisations: 0,
        energy_evaluations: 0,
        safeguarded: 0,
        max_residual_force: f64::INFINITY,
        rounding_force: 0.0,
        energy: f64::NAN,
        stability: Stability::Unchecked,
        connection: Connection::Direct,
        load_reached: 0.0,
        load_steps: 0,
        escapes: 0,
        ridges: 0,
        guarded: 0,
    };

    /// Adds the counts of work of `other`.
    pub(super) fn add_cost(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.factorisations += other.factorisations;
        self.energy_evaluations += other.energy_evaluations;
        self.safeguarded += other.safeguarded;
        self.load_steps += other.load_steps;
        self.escapes += other.escapes;
        self.ridges += other.ridges;
    }

    /// This result with the counts of work of `earlier` added.
    pub(super) fn with_earlier(mut self, earlier: &Self) -> Self {
        self.add_cost(earlier);
        if earlier.connection == Connection::Downhill {
            self.connection = Connection::Downhill;
        }
        self
    }
}

/// Tolerance of the residual force between two partial displacements of bones, N.
pub(super) const BONE_STEP_TOLERANCE: f64 = 1e-4;
/// Largest number of partial displacements of bones. Opening the jaw of the reference tongue by 10 degrees takes 12.
pub(super) const MOST_BONE_STEPS: usize = 1000;
/// Shortest part of the remaining displacement of bones that is tried.
pub(super) const SHORTEST_BONE_STEP: f64 = 1e-6;
