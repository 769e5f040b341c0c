//! Settings of a solve, and its result.

use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveSettings {
    /// Largest residual force on a free node that counts as equilibrium, N. Default 1e-9.
    pub tolerance: f64,
    /// Largest number of Newton iterations, of each load step where there are several. Default 200.
    pub max_iterations: usize,
    /// Largest number of load steps after a direct solve that failed. Default 60; 0 gives up at once.
    pub load_steps: usize,
    /// Whether to check the stability of every solution by a factorisation of the exact stiffness at it.
    /// Default false: the last factorisation, a step or two before the solution, is then taken for it
    /// wherever it was exact.
    pub certify: bool,
    /// Most solves of a [`trace()`](super::trace()), which then stops where it is. Default 600; a branch
    /// that reaches the whole load takes about two for each of its steps, and finding where one ends about
    /// 120 more.
    pub most_solves: usize,
    /// Whether a [`trace()`](super::trace()) that reaches the whole load also looks for a second stable shape there: the load is doubled
    /// and reduced again, and the shapes before and after are compared. Default true. A search needs only the shape that is reached
    /// from rest, and leaves it out.
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
    /// The residual force is below the tolerance, or as small as rounding lets it be and negligible beside
    /// the load, and the equilibrium is not known to be unstable.
    Converged,
    /// An equilibrium was found, but an unstable one, and no way downhill from it led to a stable one.
    Unstable,
    /// The iteration limit was reached first. [`Solution::load_reached`] has the part of the load that load
    /// steps reached.
    IterationLimit,
    /// No step along a descent direction lowers the energy any more, or the steps that keep every cell from
    /// turning over have become too small; the residual force is still above the tolerance. Where
    /// [`Solution::rounding_force`] is of the size of the load, the body is too uneven for double precision.
    Stalled,
    /// An equilibrium, but one in which a cell is inverted: of a body without an effect that keeps its
    /// cells upright (neither incompressibility nor a continuum), springs alone.
    Inverted,
    /// A tension, position or energy is not a finite number, or there are not as many tensions as muscles.
    NotFinite,
}

/// Stability: known signs of the eigenvalues of the stiffness at the solution, over the free nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stability {
    /// No equilibrium was reached, so nothing is known.
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

/// Connection of the solution to rest. Two equilibria at the same load can lie on different branches: one
/// that the body reaches when the load grows from zero, and others that it does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Connection {
    /// Newton's method went from its start to the solution at the whole load, and every step lowered the energy.
    Direct,
    /// Reached in load steps from rest (where bones are displaced, from where the direct solve failed), each begun at the equilibrium
    /// before.
    LoadSteps,
    /// On the way a ridge or an unstable equilibrium was left downhill, so it may well lie on another branch
    /// than rest.
    Downhill,
    /// Followed from rest, there and back, in steps ([`super::trace()`]): it lies on the branch that begins
    /// at rest ([`super::FromRest::Branch`]).
    Traced,
}

/// What a solve did; the positions are in the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Solution {
    pub status: SolveStatus,
    pub iterations: usize,
    /// Factorisations, failed ones included.
    pub factorisations: usize,
    pub energy_evaluations: usize,
    /// Iterations in which the exact stiffness was not positive definite and a safeguarded one was used.
    pub safeguarded: usize,
    /// Largest force on a free node, N.
    pub max_residual_force: f64,
    /// Rounding error of the force in double precision, N: the largest stiffness times the rounding of a
    /// coordinate. A residual below it cannot be made smaller. Zero if nothing was factorised.
    pub rounding_force: f64,
    /// Potential energy, J.
    pub energy: f64,
    pub stability: Stability,
    /// What is known of the way from rest.
    pub connection: Connection,
    /// Part of the tensions at which the positions left behind are an equilibrium: 1 when converged, less
    /// where load stepping stopped, 0 where no equilibrium was found.
    pub load_reached: f64,
    /// Load steps taken; 0 where the direct solve succeeded.
    pub load_steps: usize,
    /// Number of unstable equilibria that the solve found and left downhill. If it is above zero there is
    /// another equilibrium, and the solution is on another branch than the one that was left. Only counted
    /// where the stability is checked at the solution.
    pub escapes: usize,
    /// Iterations along a direction of negative curvature, from a ridge of the energy.
    pub ridges: usize,
    /// Elements in which the barrier against inversion acts: where there are any, the answer is not that of
    /// the published law (see [`crate::effect::spring`]).
    pub guarded: usize,
}

impl Default for Solution {
    fn default() -> Self {
        Self::NONE
    }
}

impl Solution {
    /// The solution before any work: nothing is reached yet.
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

    /// Adds the cost of `other`: all counts of work, but not its result.
    pub(super) fn add_cost(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.factorisations += other.factorisations;
        self.energy_evaluations += other.energy_evaluations;
        self.safeguarded += other.safeguarded;
        self.load_steps += other.load_steps;
        self.escapes += other.escapes;
        self.ridges += other.ridges;
    }

    /// This result, with the cost of `all`.
    pub(super) fn with_cost(self, all: &Self) -> Self {
        let Self { iterations, factorisations, energy_evaluations, .. } = *all;
        Self { iterations, factorisations, energy_evaluations, ..self }
    }

    /// This result, with the cost of `earlier` added.
    pub(super) fn after(mut self, earlier: &Self) -> Self {
        self.add_cost(earlier);
        if earlier.connection == Connection::Downhill {
            self.connection = Connection::Downhill;
        }
        self
    }
}

/// Residual force below which bones are carried the next part of their way, N.
pub(super) const FOLLOWED: f64 = 1e-4;
/// Largest number of parts of a bone's way. The reference tongue's jaw opens by 10 degrees in 12.
pub(super) const MOST_PARTS: usize = 1000;
/// Shortest part of a bone's remaining way that is still tried.
pub(super) const LEAST_PART: f64 = 1e-6;
