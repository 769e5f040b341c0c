//! Newton's method on the energy, with a line search that prevents inverted cells.

use super::state::SolveState;
use super::{Connection, Solution, SolveSettings, SolveStatus, Stability};
use crate::effect::Tangent;
use crate::geometry;

/// A step must achieve this part of the decrease that the slope predicts (Armijo).
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Relative difference below which two energies are equal to rounding.
pub(super) const ENERGY_NOISE: f64 = 1e-13;
/// Number of iterations in a row with a stiffness that is not positive definite after which its negative curvature is followed. Far from
/// the solution the stiffness usually becomes positive definite, but not where a straight chain is compressed.
pub(super) const MOST_INDEFINITE: usize = 3;
/// Shortest part of a step that the line search tries.
const SHORTEST_STEP: f64 = 1e-12;
/// Rounding error of the coordinates that can enter one force, over the largest coordinate.
pub(super) const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// A residual that rounding may explain is accepted if it is below this part of the load.
pub(super) const NEGLIGIBLE_RESIDUAL: f64 = 1e-6;
/// A residual that rounding may explain is also accepted if an exact Newton step moves no node by more than this part of the body's size.
const NEGLIGIBLE_STEP: f64 = 1e-9;
const MOST_CORRECTIONS: usize = 3;
/// The factor is used again while each iteration reduces the residual to less than this part. A new factor costs about three times as much
/// as an iteration with the old one.
pub(super) const REUSE_REDUCTION: f64 = 0.03;

impl<const D: usize> SolveState<'_, D> {
    /// One solve at the whole load, from the positions in the workspace.
    pub(super) fn run(mut self, tensions: &[f64], settings: &SolveSettings) -> Solution {
        if tensions.len() != self.w.tensions.len() || tensions.iter().any(|t| !t.is_finite()) {
            return Solution { status: SolveStatus::NotFinite, ..self.done };
        }
        self.w.tensions.copy_from_slice(tensions);
        self.done.energy = self.energy();
        self.update_force();
        // The factor of a solved neighbour is close to the factor at the start.
        let mut reuse = self.w.factor_ready;
        self.done.status = loop {
            let residual = self.done.max_residual_force;
            if !(residual.is_finite() && self.done.energy.is_finite()) {
                break SolveStatus::NotFinite;
            }
            if residual <= settings.tolerance
                || (residual <= self.done.rounding_force && self.residual_is_negligible())
            {
                break SolveStatus::Converged;
            }
            if self.done.iterations == settings.max_iterations {
                break SolveStatus::IterationLimit;
            }
            self.done.iterations += 1;
            if !reuse && !self.factorise() {
                break SolveStatus::Stalled;
            }
            let slope = self.find_step();
            let mut moved = self.corrected && self.take_corrected_step(slope) || self.take_step(slope);
            if self.safeguarded_in_a_row > MOST_INDEFINITE && !reuse && self.follow_curvature() {
                self.done.ridges += 1;
                moved = true;
            }
            if !moved && !reuse {
                let resolved =
                    self.done.max_residual_force <= self.rounding_level() && self.residual_is_negligible();
                break if resolved { SolveStatus::Converged } else { SolveStatus::Stalled };
            }
            reuse = moved && self.done.max_residual_force < REUSE_REDUCTION * residual;
        };
        if self.done.ridges > 0 {
            self.done.connection = Connection::Downhill;
        }
        if self.done.status == SolveStatus::Converged {
            self.done.load_reached = 1.0;
            if self.w.factor_is_exact {
                self.done.stability = Stability::Near;
            }
        }
        self.system.place_path_nodes(&mut self.w.positions);
        self.done
    }

    /// Whether a residual above the tolerance that rounding can explain is negligible: below a millionth of the load, or too small to move
    /// the body. Rounding alone is no reason, since it causes forces as large as the load in a very uneven body.
    fn residual_is_negligible(&self) -> bool {
        let w = &*self.w;
        // The reactions of the bones measure loads of any kind.
        let load = w.tensions.iter().fold(geometry::largest(&w.force), |m, t| m.max(t.abs()));
        self.done.max_residual_force <= NEGLIGIBLE_RESIDUAL * load
            || (w.factor_is_exact
                && geometry::largest(&w.step) <= NEGLIGIBLE_STEP * geometry::extent(self.system.rest()))
    }

    /// Factorises the exact stiffness; if it is not positive definite, the convex one plus a growing multiple of the unit matrix, because
    /// the convex one of a slack chain is singular.
    fn factorise(&mut self) -> bool {
        self.assemble(Tangent::Exact);
        self.done.rounding_force =
            ROUNDING * self.w.stiffness.largest_diagonal(self.system.pattern()) * self.extent;
        self.w.factor_is_exact = self.try_factor();
        if self.w.factor_is_exact {
            self.safeguarded_in_a_row = 0;
            return true;
        }
        self.done.safeguarded += 1;
        self.safeguarded_in_a_row += 1;
        if self.safeguarded_in_a_row > MOST_INDEFINITE {
            self.find_curvature();
        }
        self.assemble(Tangent::Convex);
        let pattern = self.system.pattern();
        let largest = self.w.stiffness.largest_diagonal(pattern);
        let mut shift = 1e-6 * largest;
        if self.corrected {
            // In a very uneven body a millionth of the largest stiffness would keep the softest nodes from moving.
            shift = shift.min((1e-3 * self.w.stiffness.smallest_trace(pattern)).max(1e-14 * largest));
        }
        self.w.stiffness.shift(pattern, shift);
        for _ in 0..8 {
            if self.try_factor() {
                return true;
            }
            self.w.stiffness.shift(pattern, 9.0 * shift);
            shift *= 10.0;
        }
        false
    }

    /// Solves for the step. Returns the slope of the energy along it, J, which is negative for descent.
    fn find_step(&mut self) -> f64 {
        let w = &mut *self.w;
        let pattern = self.system.pattern();
        for (u, &node) in w.unknowns.iter_mut().zip(pattern.nodes()) {
            *u = w.force[node];
        }
        w.factor.solve(pattern, &mut w.unknowns);
        let mut slope = 0.0;
        for (u, &node) in w.unknowns.iter().zip(pattern.nodes()) {
            w.step[node] = *u;
            slope -= u.dot(&w.force[node]);
        }
        slope
    }

    /// Takes the whole step and up to [`MOST_CORRECTIONS`] corrections with the same factor until the energy has fallen. In a body that is
    /// very stiff in some directions the path of descent is curved, so that only a very short part of a straight step lowers the energy
    /// (Maratos 1978; Nocedal and Wright 2006, 15.5). Returns false and restores the state if the energy does not fall.
    fn take_corrected_step(&mut self, slope: f64) -> bool {
        let (old, residual) = (self.done.energy, self.done.max_residual_force);
        let limit = self.step_limit();
        self.w.trial.copy_from_slice(&self.w.positions);
        let mut part = limit;
        for _ in 0..=MOST_CORRECTIONS {
            let w = &mut *self.w;
            for &node in self.system.pattern().nodes() {
                w.positions[node] += w.step[node] * part;
            }
            let energy = self.energy();
            self.update_force();
            if !(energy.is_finite() && self.done.max_residual_force.is_finite()) {
                break;
            }
            if energy <= old + SUFFICIENT_DECREASE * limit * slope {
                self.done.energy = energy;
                return true;
            }
            self.find_step();
            part = self.step_limit();
        }
        self.w.positions.copy_from_slice(&self.w.trial);
        self.update_force();
        self.find_step();
        self.done.max_residual_force = residual;
        false
    }

    /// Backtracking line search along the step; updates energy and force. Returns false if the energy does not fall.
    fn take_step(&mut self, slope: f64) -> bool {
        let old = self.done.energy;
        let noise = ENERGY_NOISE * old.abs();
        let mut part = self.step_limit();
        self.w.trial.copy_from_slice(&self.w.positions);
        while part > SHORTEST_STEP {
            self.place_along(part);
            let energy = self.energy();
            if energy <= old + SUFFICIENT_DECREASE * part * slope + noise {
                let before = self.done.max_residual_force;
                self.done.energy = energy;
                self.update_force();
                // If the energy changes by no more than its rounding, only the force shows whether the step is an improvement.
                return -slope * part > noise || self.done.max_residual_force < before;
            }
            part *= 0.5;
        }
        self.w.positions.copy_from_slice(&self.w.trial);
        false
    }
}
