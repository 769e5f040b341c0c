//! The motion of a system from a shape, sampled at equidistant times.

use nalgebra::SVector;
use tongue_core::dynamics::{
    self, Control, IntegrationMethod, Motion, MotionError, MotionOutcome, Observer, Tensions,
};
use tongue_core::system::System;

#[derive(Debug, Clone)]
pub(crate) struct Followed<const D: usize> {
    pub outcome: MotionOutcome,
    /// Part of the way to equilibrium that the body has moved at the end; `None` if there is no such way.
    pub part_of_way: Option<f64>,
    /// Positions at the end, m.
    pub end: Vec<SVector<f64, D>>,
    pub samples: Samples<D>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Samples<const D: usize> {
    pub times: Vec<f64>,
    pub positions: Vec<Vec<SVector<f64, D>>>,
}

impl<const D: usize> Observer<D> for Samples<D> {
    fn sample(&mut self, time: f64, positions: &[SVector<f64, D>]) {
        self.times.push(time);
        self.positions.push(positions.to_vec());
    }
}

/// Follows the motion from a shape, or from rest, by TR-BDF2 with this error in a step, m, until `t_end_s`.
pub(crate) fn follow<const D: usize>(
    system: &System<D>,
    tensions: Tensions,
    start: Option<&[SVector<f64, D>]>,
    tolerance_m: f64,
    t_end_s: f64,
    samples: usize,
) -> Result<Followed<D>, MotionError> {
    let motion = Motion::new(system, tensions)?;
    let mut integrator = IntegrationMethod::TrBdf2.checked(&motion, Control::Adaptive(tolerance_m))?;
    let mut state = motion.at_rest();
    state.positions.copy_from_slice(start.unwrap_or(system.rest()));
    let begin = state.positions.clone();
    let mut seen = Samples::default();
    let times = dynamics::sample_times(t_end_s, samples);
    let outcome = dynamics::run(&motion, integrator.as_mut(), &mut state, t_end_s, &times, &mut seen);
    let part_of_way = motion.part_of_way(&begin, &state);
    Ok(Followed { outcome, part_of_way, end: state.positions, samples: seen })
}
