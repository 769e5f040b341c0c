//! Symplectic (semi-implicit) Euler: the velocity first, then the position with the new velocity.
//!
//! `v' = v + dt F(x, v, c)/m`, `x' = x + dt v'`, `c' = c + dt dc/dt(x, c)`. First order, one evaluation a
//! step. On `x'' = -w² x - d x'` it is stable while `w² dt² + 2 d dt <= 4`.

use nalgebra::{DMatrix, dmatrix};

use super::{Failure, Integrator, Motion, Rates, State, StepCounts, after, cut};

/// Symplectic Euler with a fixed step.
#[derive(Debug)]
pub struct SymplecticEuler<const D: usize> {
    dt: f64,
    rates: Rates<D>,
}

impl<const D: usize> SymplecticEuler<D> {
    /// With steps of `dt`, s.
    pub fn new(motion: &Motion<'_, D>, dt: f64) -> Self {
        Self { dt, rates: motion.rates() }
    }
}

impl<const D: usize> Integrator<D> for SymplecticEuler<D> {
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), Failure> {
        let dt = cut(self.dt, state.time, until);
        motion.evaluate(state, &mut self.rates, counts);
        for &i in motion.system().pattern().nodes() {
            state.velocities[i] += self.rates.acceleration[i] * dt;
            state.positions[i] += state.velocities[i] * dt;
        }
        for (c, rate) in state.internal.iter_mut().zip(&self.rates.internal) {
            *c += dt * rate;
        }
        state.time = after(dt, state.time, until);
        counts.steps += 1;
        Ok(())
    }

    fn explicit_step(&self) -> Option<f64> {
        Some(self.dt)
    }

    fn amplification(&self, stiffness: f64, damping: f64) -> Option<DMatrix<f64>> {
        Some(dmatrix![1.0 - stiffness, 1.0 - damping; -stiffness, 1.0 - damping])
    }
}
