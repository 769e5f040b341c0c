//! Backward Euler: `x' = x + dt v'`, `v' = v + dt F(x', v', c')/m`, `c' = c + dt dc/dt(x', c')`.
//!
//! First order and stable at every step. Each step is solved by Newton's method.

use nalgebra::SVector;

use super::stage::StageSolver;
use super::{Failure, Integrator, Motion, State, StepCounts, after, cut};

/// Newton's method stops at corrections below this, m.
pub(super) const SOLVED: f64 = 1e-12;

/// Backward Euler with a fixed step.
#[derive(Debug)]
pub struct BackwardEuler<const D: usize> {
    dt: f64,
    solver: StageSolver<D>,
    stage: State<D>,
    way: Vec<SVector<f64, D>>,
}

impl<const D: usize> BackwardEuler<D> {
    /// With steps of `dt`, s.
    pub fn new(motion: &Motion<'_, D>, dt: f64) -> Self {
        let stage = motion.at_rest();
        Self { dt, solver: StageSolver::new(motion), way: stage.velocities.clone(), stage }
    }
}

impl<const D: usize> Integrator<D> for BackwardEuler<D> {
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), Failure> {
        let dt = cut(self.dt, state.time, until);
        let Self { solver, stage, way, .. } = self;
        stage.clone_from(state);
        way.iter_mut().zip(&state.velocities).for_each(|(w, v)| *w = v * dt);
        StageSolver::predict(motion, stage, way);
        stage.time = after(dt, state.time, until);
        if solver.solve(motion, state, stage, dt, SOLVED, counts).is_err() {
            // The start is the old shape: after a long step, following the velocity would lead far beyond
            // the new one.
            counts.rejected += 1;
            stage.clone_from(state);
            stage.time = after(dt, state.time, until);
            if solver.solve(motion, state, stage, dt, SOLVED, counts).is_err() {
                counts.rejected += 1;
                return Err(Failure::NotSolved);
            }
        }
        std::mem::swap(state, stage);
        counts.steps += 1;
        Ok(())
    }
}
