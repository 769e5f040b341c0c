//! State of a solve: energy, force, stiffness and its factor at the present positions.

use super::{Solution, Workspace};
use crate::effect::{Configuration, Tangent};
use crate::geometry;
use crate::system::System;

pub(super) struct SolveState<'a, const D: usize> {
    pub(super) system: &'a System<D>,
    pub(super) w: &'a mut Workspace<D>,
    pub(super) done: Solution,
    /// Number of iterations in a row in which the exact stiffness was not positive definite.
    pub(super) safeguarded_in_a_row: usize,
    /// Whether whole steps are corrected. Since this costs more, only load steps that fail without it do so.
    pub(super) corrected: bool,
    /// Largest coordinate, m.
    pub(super) extent: f64,
}

impl<'a, const D: usize> SolveState<'a, D> {
    pub(super) fn new(system: &'a System<D>, w: &'a mut Workspace<D>) -> Self {
        let extent = geometry::largest(&w.positions);
        Self { system, w, done: Solution::NONE, safeguarded_in_a_row: 0, corrected: false, extent }
    }

    pub(super) fn energy(&mut self) -> f64 {
        self.done.energy_evaluations += 1;
        self.system.energy(self.w.configuration())
    }

    pub(super) fn update_force(&mut self) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        self.system.force(at, &mut w.force);
        let nodes = self.system.pattern().nodes();
        // NaN is kept, which `f64::max` would drop.
        let squares = nodes.iter().map(|&n| w.force[n].norm_squared());
        let largest = squares.fold(0.0, |a, b: f64| if b > a || b.is_nan() { b } else { a });
        self.done.max_residual_force = largest.sqrt();
    }

    pub(super) fn assemble(&mut self, tangent: Tangent) {
        let w = &mut *self.w;
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        w.stiffness.clear();
        self.system.effects().iter().for_each(|e| e.add_stiffness(at, tangent, &mut w.stiffness));
    }

    /// Factorises the stiffness. Returns whether it is positive definite.
    pub(super) fn try_factor(&mut self) -> bool {
        self.done.factorisations += 1;
        self.w.factor_ready = self.w.factor.factorise(self.system.pattern(), &self.w.stiffness);
        self.w.factor_ready
    }

    pub(super) fn step_limit(&self) -> f64 {
        self.system.step_limit(self.w.configuration(), &self.w.step)
    }

    /// Smallest residual force that double precision allows at these positions, N: the rounding error of the largest force, and that of
    /// the positions times the stiffness.
    pub(super) fn rounding_level(&self) -> f64 {
        let w = &*self.w;
        let pull = w.tensions.iter().fold(0.0, |m: f64, t| m.max(t.abs())).max(geometry::largest(&w.force));
        let stiffness = w.stiffness.largest_diagonal(self.system.pattern());
        16.0 * f64::EPSILON * (pull + stiffness * geometry::largest(&w.positions))
    }
}
