//! Newton's method on the energy, with a line search, and safeguards that act only where they are needed.

use nalgebra::SVector;

use crate::effect::{Configuration, Tangent};
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::system::System;

use super::{Connection, Settings, Solution, Stability, Status, Workspace, rescue, stability};

/// Part of the decrease that the slope promises which a step must achieve (Armijo).
const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Energies nearer than this, relative to their size, cannot be told apart in double precision.
const ENERGY_NOISE: f64 = 1e-13;
/// So many iterations in a row may find the exact stiffness not positive definite before its negative curvature is followed:
/// it passes by itself far from the solution, but not on the ridge on which a straight pushed chain sits.
const PATIENCE: usize = 3;
/// A shorter part of a step than this is no step.
const SHORTEST_STEP: f64 = 1e-12;
/// Rounding errors of coordinates that can come together in one force, as a part of the largest coordinate.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// A residual that rounding may explain is accepted up to this part of the load,
const NEGLIGIBLE: f64 = 1e-6;
/// or where an exact Newton step moves no node by more than this part of the body's size.
const STILL: f64 = 1e-9;
/// Most corrections of a whole step.
const MOST_CORRECTIONS: usize = 3;
/// The factor at hand serves once more as long as the residual falls to less than this part in an iteration: a new factor costs
/// about three times what an iteration with the old one does.
const FAST_ENOUGH: f64 = 0.03;

/// As [`super::solve`], with the bones where they are.
pub(super) fn solve<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &Settings,
) -> Solution {
    let mut done = Newton::new(system, workspace).run(tensions, settings);
    if matches!(done.status, Status::IterationLimit | Status::Stalled) && settings.load_steps > 0 {
        done = rescue::step_load(system, workspace, tensions, settings, &done);
    }
    if done.status == Status::Converged && (settings.certify || done.stability == Stability::Unchecked) {
        done = stability::settle(system, workspace, settings, &done);
    }
    done.guarded = system.guarded(workspace.configuration());
    if done.status == Status::Converged
        && !system.keeps_cells_upright()
        && system.cell_ratios(workspace.positions()).0 <= 0.0
    {
        done.status = Status::Inverted;
    }
    done
}

impl Solution {
    /// Nothing was done, and nothing reached.
    pub const NONE: Self = Self {
        status: Status::IterationLimit,
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
}

pub(super) struct Newton<'a, const D: usize> {
    pub(super) system: &'a System<D>,
    pub(super) w: &'a mut Workspace<D>,
    pub(super) done: Solution,
    /// Iterations in a row in which the exact stiffness was not positive definite.
    safeguarded_in_a_row: usize,
    /// Whether whole steps are corrected where they lead; costs more, so only load steps that fail otherwise ask for it.
    pub(super) corrected: bool,
    /// Largest coordinate, m.
    extent: f64,
    /// Residual force below which there is only rounding, N: the stiffest entry times the rounding of a coordinate.
    floor: f64,
}

impl<'a, const D: usize> Newton<'a, D> {
    pub(super) fn new(system: &'a System<D>, w: &'a mut Workspace<D>) -> Self {
        let extent = w.positions.iter().map(|p| p.amax()).fold(0.0, f64::max);
        Self {
            system,
            w,
            done: Solution::NONE,
            safeguarded_in_a_row: 0,
            corrected: false,
            extent,
            floor: 0.0,
        }
    }

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

    /// Whether a residual that is above the tolerance, but no larger than what rounding makes, is of no account: a hair of the
    /// load, or too little to move the body. In a very uneven body rounding makes forces as large as the load, and then it says
    /// nothing that the residual is no larger.
    fn is_settled(&self) -> bool {
        let w = &*self.w;
        let largest = |v: &[SVector<f64, D>]| v.iter().map(SVector::amax).fold(0.0, f64::max);
        // The reactions of the bones show what loads the body, whatever it is.
        let load = w.tensions.iter().fold(largest(&w.force), |m, t| m.max(t.abs()));
        self.done.max_residual_force <= NEGLIGIBLE * load
            || (w.factor_is_exact && largest(&w.step) <= STILL * stability::extent(self.system.rest()))
    }

    pub(super) fn energy(&mut self) -> f64 {
        self.done.energy_evaluations += 1;
        let w = &*self.w;
        self.system.energy(Configuration { positions: &w.positions, tensions: &w.tensions })
    }

    pub(super) fn update_force(&mut self) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        self.system.force(at, &mut w.force);
        let nodes = self.system.pattern().nodes();
        let largest = nodes.iter().map(|&n| w.force[n].norm_squared()).fold(0.0, nan_or_max);
        self.done.max_residual_force = largest.sqrt();
    }

    pub(super) fn assemble(&mut self, tangent: Tangent) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        w.stiffness.clear();
        self.system.effects().iter().for_each(|e| e.add_stiffness(at, tangent, &mut w.stiffness));
    }

    pub(super) fn try_factor(&mut self) -> Result<(), NotPositiveDefinite> {
        self.done.factorisations += 1;
        let result = self.w.factor.factorise(self.system.pattern(), &self.w.stiffness);
        self.w.factor_ready = result.is_ok();
        result
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

    /// Largest part of the step that no effect forbids.
    pub(super) fn step_limit(&self) -> f64 {
        let at = self.w.configuration();
        self.system.effects().iter().map(|e| e.step_limit(at, &self.w.step)).fold(1.0, f64::min)
    }

    /// Takes the whole step, and from where it leads up to [`MOST_CORRECTIONS`] more with the same factor, until the energy has
    /// fallen. In a body that hardly gives way in some directions the way down is curved, and straight steps are good for a hair
    /// of it only (Maratos 1978; Nocedal and Wright 2006, 15.5). False, and everything as before, when the energy does not fall.
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

/// The larger of two numbers; a NaN is kept, where `f64::max` would drop it.
fn nan_or_max(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
