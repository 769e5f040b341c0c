//! The classical Runge-Kutta method of order four (Kutta 1901) on the state (x, v, c).
//!
//! Four evaluations a step. On `x'' = -w² x - d x'` it is stable up to `w dt = 2.828` without damping and up
//! to `d dt = 2.785` with dampers alone.

use nalgebra::{DMatrix, dmatrix};

use super::{Failure, Integrator, Motion, Rates, State, StepCounts, after, cut};

/// Where each further stage lies, as a part of the step.
const NODES: [f64; 3] = [0.5, 0.5, 1.0];
/// Weight of each stage.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// RK4 with a fixed step.
#[derive(Debug)]
pub struct Rk4<const D: usize> {
    dt: f64,
    rates: Rates<D>,
    stage: State<D>,
    sum: State<D>,
}

impl<const D: usize> Rk4<D> {
    /// With steps of `dt`, s.
    pub fn new(motion: &Motion<'_, D>, dt: f64) -> Self {
        Self { dt, rates: motion.rates(), stage: motion.at_rest(), sum: motion.at_rest() }
    }
}

/// `sum += weight * rates(stage)`.
fn accumulate<const D: usize>(
    nodes: &[usize],
    sum: &mut State<D>,
    weight: f64,
    stage: &State<D>,
    rates: &Rates<D>,
) {
    for &i in nodes {
        sum.positions[i] += stage.velocities[i] * weight;
        sum.velocities[i] += rates.acceleration[i] * weight;
    }
    sum.internal.iter_mut().zip(&rates.internal).for_each(|(s, r)| *s += weight * r);
}

impl<const D: usize> Integrator<D> for Rk4<D> {
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), Failure> {
        let nodes = motion.system().pattern().nodes();
        let dt = cut(self.dt, state.time, until);
        let Self { rates, stage, sum, .. } = self;
        stage.clone_from(state);
        sum.clone_from(state);
        for (nth, weight) in WEIGHTS.into_iter().enumerate() {
            motion.evaluate(stage, rates, counts);
            accumulate(nodes, sum, weight * dt, stage, rates);
            if let Some(node) = NODES.get(nth) {
                let part = node * dt;
                for &i in nodes {
                    stage.positions[i] = state.positions[i] + stage.velocities[i] * part;
                    stage.velocities[i] = state.velocities[i] + rates.acceleration[i] * part;
                }
                for ((c, from), rate) in stage.internal.iter_mut().zip(&state.internal).zip(&rates.internal) {
                    *c = from + part * rate;
                }
                stage.time = state.time + part;
            }
        }
        sum.time = after(dt, state.time, until);
        std::mem::swap(state, sum);
        counts.steps += 1;
        Ok(())
    }

    fn explicit_step(&self) -> Option<f64> {
        Some(self.dt)
    }

    /// `1 + z + z²/2 + z³/6 + z⁴/24` of the equation's matrix.
    fn amplification(&self, stiffness: f64, damping: f64) -> Option<DMatrix<f64>> {
        let z = dmatrix![0.0, 1.0; -stiffness, -damping];
        let one = DMatrix::identity(2, 2);
        Some(&one + &z * (&one + &z * (&one + &z * (&one + &z / 4.0) / 3.0) / 2.0))
    }
}
