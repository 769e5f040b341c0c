//! Newton's method on the energy, with a line search, and safeguards that act only where they are needed.

use crate::effect::{Configuration, Tangent};
use crate::system::System;

use super::{Settings, Solution, Status, Workspace};

/// Part of the decrease that the slope promises which a step must achieve (Armijo).
const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Energies nearer than this, relative to their size, cannot be told apart in double precision.
const ENERGY_NOISE: f64 = 1e-13;
/// A shorter part of a step than this is no step.
const SHORTEST_STEP: f64 = 1e-12;
/// Rounding errors of coordinates that can come together in one force, as a part of the largest coordinate.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// The factor at hand serves once more as long as the residual falls to less than this part in an iteration: a new factor costs
/// about three times what an iteration with the old one does.
const FAST_ENOUGH: f64 = 0.03;

/// Solves for the equilibrium at the given tensions (N, one for each muscle of the mesh; those of muscles that the system
/// does not let contract are without effect), starting from the positions in `workspace`, and leaves the result there.
///
/// Converged means a residual force below the tolerance, or below what rounding allows where that is more (very stiff bodies,
/// bodies far from the origin).
///
/// Never panics and never leaves a position that is not finite: what went wrong is in [`Solution::status`]. No accepted step
/// turns a cell over, because every step is cut to where all cells keep at least a tenth of their measure.
pub(super) fn solve<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &Settings,
) -> Solution {
    let extent = workspace.positions.iter().map(|p| p.amax()).fold(0.0, f64::max);
    Newton { system, w: workspace, done: Solution::EMPTY, extent, floor: 0.0 }.run(tensions, settings)
}

impl Solution {
    const EMPTY: Self = Self {
        status: Status::IterationLimit,
        iterations: 0,
        factorisations: 0,
        energy_evaluations: 0,
        safeguarded: 0,
        max_residual_force: f64::INFINITY,
        energy: f64::NAN,
    };
}

struct Newton<'a, const D: usize> {
    system: &'a System<D>,
    w: &'a mut Workspace<D>,
    done: Solution,
    /// Largest coordinate, m.
    extent: f64,
    /// Residual force below which there is only rounding, N: the stiffest entry times the rounding of a coordinate.
    floor: f64,
}

impl<const D: usize> Newton<'_, D> {
    fn run(mut self, tensions: &[f64], settings: &Settings) -> Solution {
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
            if residual <= settings.tolerance.max(self.floor) {
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
            let moved = self.take_step(slope);
            if !moved && !reuse {
                break Status::Stalled;
            }
            reuse = moved && self.done.max_residual_force < FAST_ENOUGH * residual;
        };
        self.system.place_path_nodes(&mut self.w.positions);
        self.done
    }

    fn energy(&mut self) -> f64 {
        self.done.energy_evaluations += 1;
        let w = &*self.w;
        self.system.energy(Configuration { positions: &w.positions, tensions: &w.tensions })
    }

    fn update_force(&mut self) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        self.system.force(at, &mut w.force);
        let nodes = self.system.pattern().nodes();
        let largest = nodes.iter().map(|&n| w.force[n].norm_squared()).fold(0.0, nan_or_max);
        self.done.max_residual_force = largest.sqrt();
    }

    fn assemble(&mut self, tangent: Tangent) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        w.stiffness.clear();
        self.system.effects().iter().for_each(|e| e.add_stiffness(at, tangent, &mut w.stiffness));
    }

    fn try_factor(&mut self) -> bool {
        self.done.factorisations += 1;
        self.w.factor_ready = self.w.factor.factorise(self.system.pattern(), &self.w.stiffness).is_ok();
        self.w.factor_ready
    }

    /// Factorises the exact stiffness; where that is not positive definite, the convex one, and where that is singular (a
    /// slack chain), the convex one with a growing multiple of the unit matrix.
    fn factorise(&mut self) -> bool {
        self.assemble(Tangent::Exact);
        self.floor = ROUNDING * self.w.stiffness.largest_diagonal(self.system.pattern()) * self.extent;
        if self.try_factor() {
            return true;
        }
        self.done.safeguarded += 1;
        self.assemble(Tangent::Convex);
        let pattern = self.system.pattern();
        let mut shift = 1e-6 * self.w.stiffness.largest_diagonal(pattern);
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

    /// Moves along the step as far as the energy falls; updates energy and force. False when there is no such way.
    fn take_step(&mut self, slope: f64) -> bool {
        let old = self.done.energy;
        let noise = ENERGY_NOISE * old.abs();
        let limit = {
            let w = &*self.w;
            let at = Configuration { positions: &w.positions, tensions: &w.tensions };
            self.system.effects().iter().map(|e| e.step_limit(at, &w.step)).fold(1.0, f64::min)
        };
        let mut part = limit;
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
