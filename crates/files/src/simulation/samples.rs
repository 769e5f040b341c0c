//! Sampling of a motion.

use nalgebra::SVector;

use tongue_core::dynamics::{self, Control, IntegrationMethod, Motion, MotionOutcome, Observer, Tensions};
use tongue_core::system::System;

use super::SimulationError;

const TOLERANCE: f64 = 1e-6;

/// Follows the motion of a system from rest: returns how it ended, the part of its way to equilibrium, and
/// the samples.
pub(super) fn follow<const D: usize>(
    system: &System<D>,
    tensions: Tensions,
    t_end_s: f64,
    samples: usize,
) -> Result<(MotionOutcome, Option<f64>, Samples<D>), SimulationError> {
    let motion = Motion::new(system, tensions)?;
    let mut integrator = IntegrationMethod::TrBdf2.checked(&motion, Control::Adaptive(TOLERANCE))?;
    let mut state = motion.at_rest();
    let start = state.positions.clone();
    let mut seen = Samples::default();
    let times = dynamics::sample_times(t_end_s, samples);
    let outcome = dynamics::run(&motion, integrator.as_mut(), &mut state, t_end_s, &times, &mut seen);
    Ok((outcome, motion.part_of_way(&start, &state), seen))
}

#[derive(Debug, Default)]
pub struct Samples<const D: usize> {
    pub times: Vec<f64>,
    pub positions: Vec<Vec<SVector<f64, D>>>,
}

impl<const D: usize> Observer<D> for Samples<D> {
    fn sample(&mut self, time: f64, positions: &[SVector<f64, D>]) {
        self.times.push(time);
        self.positions.push(positions.to_vec());
    }
}
