//! Newton's method on the energy, with a line search that keeps cells upright.

use nalgebra::SVector;

use crate::effect::Tangent;
use crate::geometry;

use super::state::State;
use super::{Connection, Settings, Solution, Stability, Status};

/// Part of the decrease that the slope promises which a step must achieve (Armijo).
pub(super) const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Energies nearer than this, relative to their size, cannot be told apart in double precision.
pub(super) const ENERGY_NOISE: f64 = 1e-13;
/// So many iterations in a row may find the exact stiffness not positive definite before its negative curvature is followed:
/// it passes by itself far from the solution, but not on the ridge on which a straight pushed chain sits.
pub(super) const PATIENCE: usize = 3;
/// A shorter part of a step than this is no step.
const SHORTEST_STEP: f64 = 1e-12;
/// Rounding errors of coordinates that can come together in one force, as a part of the largest coordinate.
pub(super) const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// A residual that rounding may explain is accepted up to this part of the load,
pub(super) const NEGLIGIBLE: f64 = 1e-6;
/// or where an exact Newton step moves no node by more than this part of the body's size.
const STILL: f64 = 1e-9;
/// Most corrections of a whole step.
const MOST_CORRECTIONS: usize = 3;
/// The factor at hand serves once more as long as the residual falls to less than this part in an iteration: a new factor costs
/// about three times what an iteration with the old one does.
pub(super) const FAST_ENOUGH: f64 = 0.03;

impl<const D: usize> State<'_, D> {
    /// One solve from the positions in the workspace at all of the load.
    pub(super) fn run(mut self, tensions: &[f64], settings: &Settings) -> Solution {
        if tensions.len() != self.w.tensions.len() || tensions.iter().any(|t| !t.is_finite()) {
            return Solution { status: Status::NotFinite, ..self.done };
        }
        self.w.tensions.copy_from_slice(tensions);
        self.done.energy = self.energy();
        self.update_force();
        // Near a solved neighbour the neighbour's factor is nearly right.
        let mut reuse = self.w.factor_ready;
        self.done.status = loop {
            let residual = self.done.max_residual_force;
            if !(residual.is_finite() && self.done.energy.is_finite()) {
                break Status::NotFinite;
            }
            if residual <= settings.tolerance || (residual <= self.floor && self.is_settled()) {
                break Status::Converged;
            }
            if self.done.iterations == settings.max_iterations {
                break Status::IterationLimit;
            }
            self.done.iterations += 1;
            if !reuse && !self.factorise() {
                break Status::Stalled;
            }
            let slope = self.find_step();
            let mut moved = self.corrected && self.take_corrected_step(slope) || self.take_step(slope);
            if self.safeguarded_in_a_row > PATIENCE && !reuse && self.follow_curvature() {
                self.done.ridges += 1;
                moved = true;
            }
            if !moved && !reuse {
                let resolved = self.done.max_residual_force <= self.rounding_level() && self.is_settled();
                break if resolved { Status::Converged } else { Status::Stalled };
            }
            reuse = moved && self.done.max_residual_force < FAST_ENOUGH * residual;
        };
        self.done.rounding_force = self.floor;
        if self.done.ridges > 0 {
            self.done.connection = Connection::Downhill;
        }
        if self.done.status == Status::Converged {
            self.done.load_reached = 1.0;
            if self.w.factor_is_exact {
                self.done.stability = Stability::Near;
            }
        }
        self.system.place_path_nodes(&mut self.w.positions);
        self.done
    }

    /// Whether a residual that is above the tolerance, but no larger than what rounding makes, can be neglected: a millionth of the
    /// load, or too little to move the body. In a very uneven body rounding makes forces as large as the load, and then it says
    /// nothing that the residual is no larger.
    fn is_settled(&self) -> bool {
        let w = &*self.w;
        let largest = |v: &[SVector<f64, D>]| v.iter().map(SVector::amax).fold(0.0, f64::max);
        // The reactions of the bones show what loads the body, whatever it is.
        let load = w.tensions.iter().fold(largest(&w.force), |m, t| m.max(t.abs()));
        self.done.max_residual_force <= NEGLIGIBLE * load
            || (w.factor_is_exact && largest(&w.step) <= STILL * geometry::extent(self.system.rest()))
    }

    /// Factorises the exact stiffness; where that is not positive definite, the convex one, and where that is singular (a
    /// slack chain), the convex one with a growing multiple of the unit matrix.
    fn factorise(&mut self) -> bool {
        self.assemble(Tangent::Exact);
        self.floor = ROUNDING * self.w.stiffness.largest_diagonal(self.system.pattern()) * self.extent;
        let exact = self.try_factor();
        self.w.factor_is_exact = exact.is_ok();
        let Err(failure) = exact else {
            self.safeguarded_in_a_row = 0;
            return true;
        };
        self.done.safeguarded += 1;
        self.safeguarded_in_a_row += 1;
        if self.safeguarded_in_a_row > PATIENCE {
            self.find_curvature(&failure);
        }
        self.assemble(Tangent::Convex);
        let pattern = self.system.pattern();
        let largest = self.w.stiffness.largest_diagonal(pattern);
        let mut shift = 1e-6 * largest;
        if self.corrected {
            // In a very uneven body a millionth of the stiffest holds the softest fast.
            shift = shift.min((1e-3 * self.w.stiffness.smallest_trace(pattern)).max(1e-14 * largest));
        }
        self.w.stiffness.shift(pattern, shift);
        for _ in 0..8 {
            if self.try_factor().is_ok() {
                return true;
            }
            self.w.stiffness.shift(pattern, 9.0 * shift);
            shift *= 10.0;
        }
        false
    }

    /// Solves for the step; returns the slope of the energy along it, J (negative: downhill).
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

    /// Takes the whole step, and from where it leads up to [`MOST_CORRECTIONS`] more with the same factor, until the energy has
    /// fallen. In a body that hardly gives way in some directions the way down is curved, and straight steps lower the energy over a
    /// very short part of it only (Maratos 1978; Nocedal and Wright 2006, 15.5). False, and everything as before, when the energy does not fall.
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

    /// Moves along the step as far as the energy falls; updates energy and force. False when there is no such way.
    fn take_step(&mut self, slope: f64) -> bool {
        let old = self.done.energy;
        let noise = ENERGY_NOISE * old.abs();
        let mut part = self.step_limit();
        self.w.trial.copy_from_slice(&self.w.positions);
        while part > SHORTEST_STEP {
            let w = &mut *self.w;
            for &node in self.system.pattern().nodes() {
                w.positions[node] = w.trial[node] + w.step[node] * part;
            }
            let energy = self.energy();
            if energy <= old + SUFFICIENT_DECREASE * part * slope + noise {
                let before = self.done.max_residual_force;
                self.done.energy = energy;
                self.update_force();
                // Within the noise of the energy only the force can tell whether the step was one forward.
                return -slope * part > noise || self.done.max_residual_force < before;
            }
            part *= 0.5;
        }
        self.w.positions.copy_from_slice(&self.w.trial);
        false
    }
}
