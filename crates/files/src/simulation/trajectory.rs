//! The motion of a body by name.

use nalgebra::SVector;

use tongue_core::dynamics::{MotionOutcome, SHORTEST_S, Tensions};

use super::error::checked;
use super::{Assembly, SimulationError};
use crate::run::motion::follow;

/// Error allowed in a step, m.
const TOLERANCE: f64 = 1e-6;

#[derive(Debug, Clone)]
pub struct Trajectory<const D: usize> {
    pub outcome: MotionOutcome,
    /// Part of the way to equilibrium that the body has moved at the end; `None` if there is no such way.
    pub part_of_way: Option<f64>,
    pub times: Vec<f64>,
    pub positions: Vec<Vec<SVector<f64, D>>>,
    assembly: Assembly<D>,
}

impl<const D: usize> Assembly<D> {
    /// The motion from rest while the tensions (N; 2D: per metre of thickness) grow to their values in
    /// `ramp_s` (s) and then stay, until `t_end_s`, at `samples` equidistant times; by TR-BDF2 with an error
    /// of 1 µm a step.
    ///
    /// # Errors
    /// As [`Solver::equilibrium`](super::Solver::equilibrium) for names and tensions; times out of range;
    /// tissue without dampers.
    pub fn trajectory(
        &self,
        tensions: &[(&str, f64)],
        ramp_s: f64,
        t_end_s: f64,
        samples: usize,
    ) -> Result<Trajectory<D>, SimulationError> {
        let is_time = |t: f64| t.is_finite() && t >= SHORTEST_S;
        checked("the time of the ramp", ramp_s, ramp_s == 0.0 || is_time(ramp_s), "0 or at least 1 ns")?;
        checked("the time to the end", t_end_s, is_time(t_end_s), "finite and at least 1 ns")?;
        let tensions = Tensions::Ramp { to: self.tensions(tensions)?, duration: ramp_s };
        let found = follow(self.system(), tensions, None, TOLERANCE, t_end_s, samples)?;
        let (times, positions) = (found.samples.times, found.samples.positions);
        let (outcome, part_of_way) = (found.outcome, found.part_of_way);
        Ok(Trajectory { outcome, part_of_way, times, positions, assembly: self.clone() })
    }
}

impl<const D: usize> Trajectory<D> {
    /// The length of a muscle at each of the times, m; of several fibres the mean.
    pub fn lengths(&self, muscle: &str) -> Result<Vec<f64>, SimulationError> {
        let fibres = self.assembly.fibres(muscle)?;
        let system = self.assembly.system();
        let mean =
            |x: &Vec<_>| fibres.iter().map(|&m| system.length(x, m)).sum::<f64>() / fibres.len() as f64;
        Ok(self.positions.iter().map(mean).collect())
    }
}
