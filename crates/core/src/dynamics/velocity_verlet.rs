//! Velocity Verlet, as in thesis eqs. 4.2 and 4.3.
//!
//! ```text
//! r_{n+1} = r_n + v_n dt + 1/2 (F_n / m) dt²                 (4.2)
//! v_{n+1} = v_n + 1/2 ((F_n + F_{n+1}) / m) dt               (4.3)
//! ```
//!
//! The thesis does not say with which velocity the dampers enter `F_{n+1}`, since `v_{n+1}` is not yet known. Here it is that predicted
//! over the full step, `v_n + F_n dt / m`; likewise the contractile elements are predicted by `c_n + dt dc/dt` and then averaged as in
//! 4.3. `F_n` is kept from the step before, so that a step costs one evaluation. The order is two, with damping too. On
//! `x'' = -w² x - d x'` it is stable up to `w dt = 2` without damping, and up to `d dt = 1` with dampers alone.

use nalgebra::{DMatrix, dmatrix};

use super::{Integrator, Motion, MotionStatus, State, StateRates, StepCounts, cut};

#[derive(Debug)]
pub struct VelocityVerlet<const D: usize> {
    dt: f64,
    now: StateRates<D>,
    next: StateRates<D>,
    known: bool,
}

impl<const D: usize> VelocityVerlet<D> {
    /// `dt`: the step, s.
    pub fn new(motion: &Motion<'_, D>, dt: f64) -> Self {
        Self { dt, now: motion.rates(), next: motion.rates(), known: false }
    }
}

impl<const D: usize> Integrator<D> for VelocityVerlet<D> {
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), MotionStatus> {
        if !self.known {
            motion.evaluate(state, &mut self.now, counts);
            self.known = true;
        }
        let (dt, end) = cut(self.dt, state.time, until);
        let nodes = motion.system.pattern().nodes();
        for &i in nodes {
            let (v, a) = (state.velocities[i], self.now.acceleration[i]);
            state.positions[i] += v * dt + a * (0.5 * dt * dt);
            state.velocities[i] = v + a * dt;
        }
        for (c, rate) in state.internal.iter_mut().zip(&self.now.internal) {
            *c += dt * rate;
        }
        state.time = end;
        motion.evaluate(state, &mut self.next, counts);
        for &i in nodes {
            state.velocities[i] += (self.next.acceleration[i] - self.now.acceleration[i]) * (0.5 * dt);
        }
        for ((c, now), next) in state.internal.iter_mut().zip(&self.now.internal).zip(&self.next.internal) {
            *c += 0.5 * dt * (next - now);
        }
        std::mem::swap(&mut self.now, &mut self.next);
        counts.steps += 1;
        Ok(())
    }

    fn explicit_step(&self) -> Option<f64> {
        Some(self.dt)
    }
}

/// The matrix by which one step multiplies the state (x, v dt, a dt²) of `x'' = -k x - c x'`, with the acceleration of the step before.
/// `stiffness` is `k dt²` and `damping` is `c dt`.
pub(super) fn amplification(stiffness: f64, damping: f64) -> DMatrix<f64> {
    let acceleration = [-stiffness, -stiffness - damping, -0.5 * stiffness - damping];
    dmatrix![
        1.0, 1.0, 0.5;
        0.5 * acceleration[0], 1.0 + 0.5 * acceleration[1], 0.5 * (1.0 + acceleration[2]);
        acceleration[0], acceleration[1], acceleration[2]
    ]
}
