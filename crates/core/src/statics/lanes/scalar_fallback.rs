//! Solves and derivatives of single loads, for bodies that the SIMD lanes cannot solve.

use nalgebra::SVector;

use super::{Adjoint, LaneEquilibrium, Load};
use crate::effect::Configuration;
use crate::geometry;
use crate::statics::{Response, Solution, SolveSettings, SolveStatus, Workspace, solve};
use crate::system::System;

pub(super) fn solve_scalar<const D: usize>(
    system: &System<D>,
    load: &Load<'_, D>,
    settings: &SolveSettings,
) -> LaneEquilibrium<D> {
    let mut w = Workspace::new(system);
    if load.start.is_some() {
        w.displace_bone(system, &system.held(), SVector::zeros());
    }
    solve_in(system, &mut w, load, settings)
}

fn solve_in<const D: usize>(
    system: &System<D>,
    w: &mut Workspace<D>,
    load: &Load<'_, D>,
    settings: &SolveSettings,
) -> LaneEquilibrium<D> {
    load.bones.iter().for_each(|(nodes, shift)| w.displace_bone(system, nodes, *shift));
    let start = load.start.unwrap_or(system.rest());
    if start.len() != w.positions().len() {
        let solution = Solution { status: SolveStatus::NotFinite, ..Solution::NONE };
        return LaneEquilibrium { solution, positions: system.rest().to_vec(), alone: true };
    }
    w.start_from(start);
    let solution = solve(system, w, &load.tensions, settings);
    LaneEquilibrium { solution, positions: w.positions().to_vec(), alone: true }
}

/// Workspace for a body that lanes cannot solve. Each solve begins with the factor of the solve before.
#[derive(Debug)]
pub(super) struct ScalarFallback<const D: usize> {
    w: Workspace<D>,
    held: Vec<usize>,
    /// Whether no cell touches a bone, so that bones can be moved in one step.
    is_free: bool,
    /// Whether the factor is that of the exact stiffness at the last equilibrium.
    is_factorised: bool,
}

impl<const D: usize> ScalarFallback<D> {
    pub fn new(system: &System<D>) -> Self {
        let held = system.held();
        let is_free = !system.cells.iter().flat_map(|(cell, _)| cell).any(|n| held.binary_search(n).is_ok());
        Self { w: Workspace::new(system), held, is_free, is_factorised: false }
    }

    pub fn solve(
        &mut self,
        system: &System<D>,
        load: &Load<'_, D>,
        settings: &SolveSettings,
    ) -> LaneEquilibrium<D> {
        self.is_factorised = false;
        if load.start.is_none() {
            self.w.start_from_rest(system);
        }
        self.w.displace_bone(system, &self.held, SVector::zeros());
        let Some(start) = load.start.filter(|start| self.is_free && start.len() == system.rest().len())
        else {
            return solve_in(system, &mut self.w, load, settings);
        };
        let mut start = start.to_vec();
        self.held.iter().for_each(|&node| start[node] = load.place(system, node));
        solve_in(system, &mut self.w, &Load { start: Some(&start), ..load.clone() }, settings)
    }

    pub fn adjoint(&mut self, system: &System<D>, gradient: &[SVector<f64, D>]) -> Option<Adjoint<D>> {
        let response = match self.is_factorised {
            true => Response::with_existing_factor(system, &mut self.w),
            false => Response::new(system, &mut self.w)?,
        };
        self.is_factorised = true;
        Some(adjoint_of(system, response, gradient, BONE_FORCE_STEP))
    }
}

/// The `part` of [`adjoint_of`] for bodies that lanes cannot solve; it is small because fibres between bone and tissue can be short.
const BONE_FORCE_STEP: f64 = 1e-4;

/// Derivatives of a function at an equilibrium; `part` is the step of the differences of forces on bones over the body's size.
pub(super) fn adjoint_of<const D: usize>(
    system: &System<D>,
    mut response: Response<'_, D>,
    gradient: &[SVector<f64, D>],
    part: f64,
) -> Adjoint<D> {
    let mut gradient = gradient.to_vec();
    system.continuum.iter().for_each(|c| c.carry_loads(&mut gradient));
    response.compute_for_load(|_, load| load.copy_from_slice(&gradient));
    let motion = response.motion();
    let at = response.configuration();
    let mut by_tension = vec![0.0; system.muscle_count()];
    let mut load = vec![SVector::zeros(); motion.len()];
    for &muscle in system.contracting() {
        load.fill(SVector::zeros());
        system.effects().iter().for_each(|e| e.add_force_per_tension(at, muscle, &mut load));
        by_tension[muscle] = load.iter().zip(motion).map(|(f, u)| f.dot(u)).sum();
    }
    // A bone's node gets the force that the motion causes there, by differences of fourth order.
    let longest = geometry::largest(motion);
    let mut by_node = motion.to_vec();
    let is_held = |n: &usize| system.pattern().unknown(*n).is_none();
    let held: Vec<usize> = (0..by_node.len()).filter(is_held).collect();
    held.iter().for_each(|&n| by_node[n] = gradient[n]);
    if longest > 0.0 {
        let touches_bone = |e: &dyn crate::effect::Effect<D>| {
            let mut touches = false;
            e.stencils(&mut |nodes| touches |= nodes.iter().any(is_held));
            touches
        };
        let effects: Vec<_> = system.effects().iter().filter(|e| touches_bone(e.as_ref())).collect();
        let step = part * geometry::extent(system.rest()) / longest;
        for (parts, weight) in [(1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)] {
            let x: Vec<_> = at.positions.iter().zip(motion).map(|(x, u)| x + u * (step * parts)).collect();
            load.fill(SVector::zeros());
            effects.iter().for_each(|e| e.add_force(Configuration { positions: &x, ..at }, &mut load));
            held.iter().for_each(|&n| by_node[n] += load[n] * (weight / (12.0 * step)));
        }
    }
    Adjoint { by_node, by_tension }
}
