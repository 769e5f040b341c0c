//! Exact linear response of an equilibrium to small changes: `K dx = df` on the free nodes, with one factorisation for all changes.

use nalgebra::SVector;

use super::Workspace;
use super::state::SolveState;
use crate::effect::{Configuration, Tangent};
use crate::system::System;

/// The factorised equilibrium that the last solve left in a workspace, and the motion of its nodes for the last change.
#[derive(Debug)]
pub struct Response<'a, const D: usize> {
    system: &'a System<D>,
    w: &'a mut Workspace<D>,
    motion: Vec<SVector<f64, D>>,
}

impl<'a, const D: usize> Response<'a, D> {
    /// Factorises the exact stiffness at the positions and tensions of the last solve; `None` if it is not positive definite.
    #[inline(never)]
    pub fn new(system: &'a System<D>, w: &'a mut Workspace<D>) -> Option<Self> {
        let mut state = SolveState::new(system, w);
        state.assemble(Tangent::Exact);
        if !state.try_factor() {
            return None;
        }
        w.factor_is_exact = true;
        Some(Self::with_existing_factor(system, w))
    }

    /// A response with the factor that the workspace has of this equilibrium.
    pub(super) fn with_existing_factor(system: &'a System<D>, w: &'a mut Workspace<D>) -> Self {
        let motion = vec![SVector::zeros(); w.positions.len()];
        Self { system, w, motion }
    }

    /// Positions of all nodes at the equilibrium, m.
    pub fn positions(&self) -> &[SVector<f64, D>] {
        &self.w.positions
    }

    pub(super) fn configuration(&self) -> Configuration<'_, D> {
        self.w.configuration()
    }

    /// Motion of all nodes per unit of the last change, m.
    pub fn motion(&self) -> &[SVector<f64, D>] {
        &self.motion
    }

    /// Computes the response to a tension of 1 N in each of the muscles (2D: per metre of thickness).
    pub fn compute_for_tensions(&mut self, muscles: impl IntoIterator<Item = usize>) {
        let effects = self.system.effects();
        self.compute_for_load(|at, load| {
            for muscle in muscles {
                effects.iter().for_each(|e| e.add_force_per_tension(at, muscle, load));
            }
        });
    }

    /// Computes the response to a small load: `add` adds its force on every node per unit, N. Forces on bones have no effect.
    pub fn compute_for_load(&mut self, add: impl FnOnce(Configuration<'_, D>, &mut [SVector<f64, D>])) {
        let (pattern, w) = (self.system.pattern(), &mut *self.w);
        let at = Configuration { positions: &w.positions, tensions: &w.tensions };
        self.motion.fill(SVector::zeros());
        add(at, &mut self.motion);
        for (u, &node) in w.unknowns.iter_mut().zip(pattern.nodes()) {
            *u = self.motion[node];
        }
        w.factor.solve(pattern, &mut w.unknowns);
        self.motion.fill(SVector::zeros());
        for (u, &node) in w.unknowns.iter().zip(pattern.nodes()) {
            self.motion[node] = *u;
        }
        self.system.continuum.iter().for_each(|c| c.move_followers(&mut self.motion));
    }

    /// Adds a displacement of bone nodes by 1 m along an axis to the response.
    pub fn displace(&mut self, nodes: &[usize], axis: usize) {
        nodes.iter().for_each(|&n| self.motion[n][axis] += 1.0);
    }

    pub fn scale(&mut self, unit: f64) {
        if unit != 1.0 {
            self.motion.iter_mut().for_each(|m| *m *= unit);
        }
    }
}

/// Derivatives of the positions of all nodes, those of straight paths too, by tensions, m/N, at an equilibrium (positions, m, and tensions
/// of all muscles, N): one list for each of `muscles`, whose fibres have a common tension. `None` if the equilibrium is not stable, or the
/// lists do not fit the system.
#[inline(never)]
pub fn position_rates<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    (positions, tensions): (&[SVector<f64, D>], &[f64]),
    muscles: &[Vec<usize>],
) -> Option<Vec<Vec<SVector<f64, D>>>> {
    workspace.set(positions, tensions)?;
    let mut response = Response::new(system, workspace)?;
    let motions = muscles.iter().map(|fibres| {
        let mut motion = vec![SVector::zeros(); positions.len()];
        for &fibre in fibres {
            response.compute_for_tensions([fibre]);
            motion.iter_mut().zip(response.motion()).for_each(|(sum, m)| *sum += m);
        }
        system.paths().iter().for_each(|path| path.carry(positions, &mut motion));
        motion
    });
    Some(motions.collect())
}
