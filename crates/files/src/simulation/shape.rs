//! A shape of a body (the positions of its nodes, with the solve that found them) and a motion, by names of muscles.

use std::sync::Arc;

use nalgebra::SVector;

use super::error::check_number;
use super::{Assembly, SimulationError};
use crate::report::{self, ReportError, SectionPicture, SimulationRecord, Svg, Vtu};
use crate::run::{Equilibrium, STEP_ERROR_MM, SampledMotion, Solved};
use tongue_core::dynamics::{Control, IntegrationMethod, Motion, SHORTEST_S, Tensions};
use tongue_core::statics::{Connection, SolveStatus};

/// A shape of a body under tensions, independent of the solver.
#[derive(Debug, Clone)]
pub struct Shape<const D: usize> {
    /// The equilibrium with its alarms, and the trace if it was followed from rest. `wall_s` is NaN.
    pub solved: Solved<D>,
    assembly: Assembly<D>,
}

impl<const D: usize> Shape<D> {
    pub(super) fn new(
        assembly: &Assembly<D>,
        equilibrium: Equilibrium,
        pulls: Vec<f64>,
        positions: Vec<SVector<f64, D>>,
    ) -> Self {
        let system = Arc::clone(&assembly.system);
        let solved = Solved { equilibrium, positions, pulls, system, wall_s: f64::NAN };
        Self { solved, assembly: assembly.clone() }
    }

    pub fn assembly(&self) -> &Assembly<D> {
        &self.assembly
    }

    /// Whether the shape is an equilibrium; if not, `solved.equilibrium.solution.status` says why.
    pub fn is_converged(&self) -> bool {
        self.solved.equilibrium.solution.status == SolveStatus::Converged
    }

    /// Whether the shape is known to lie on the branch of equilibria from rest.
    pub fn is_traced(&self) -> bool {
        self.solved.equilibrium.solution.connection == Connection::Traced
    }

    /// Positions of all nodes, m, in the order of the body's nodes.
    pub fn positions(&self) -> &[SVector<f64, D>] {
        &self.solved.positions
    }

    pub fn tension(&self, muscle: &str) -> Result<f64, SimulationError> {
        Ok(self.solved.pulls[self.assembly.fibres(muscle)?[0]])
    }

    /// The length of a muscle, the straight distance between its ends, m; the mean over its fibres.
    pub fn length(&self, muscle: &str) -> Result<f64, SimulationError> {
        self.assembly.mean_length(muscle, self.positions())
    }

    pub fn rest_length(&self, muscle: &str) -> Result<f64, SimulationError> {
        self.assembly.mean_length(muscle, self.assembly.system().rest())
    }

    /// The length of a muscle over its length at rest: below 1 if it shortened.
    pub fn stretch(&self, muscle: &str) -> Result<f64, SimulationError> {
        Ok(self.length(muscle)? / self.rest_length(muscle)?)
    }

    pub fn ratio(&self, muscle: &str, over: &str) -> Result<f64, SimulationError> {
        Ok(self.length(muscle)? / self.length(over)?)
    }

    /// The record that `tongue-fit simulate --json` prints, without the duration.
    pub fn record(&self) -> SimulationRecord {
        self.solved.record(self.assembly.body(), None)
    }

    pub fn vtu(&self) -> Result<Vtu<'_, D>, ReportError> {
        Vtu::of(self.assembly.body(), self.positions(), &self.solved.pulls)
    }
}

impl Shape<2> {
    /// A picture: the tissue at rest and deformed, and the muscles with their names.
    pub fn picture(&self, title: &str) -> Result<Svg, ReportError> {
        let (body, pulls) = (self.assembly.body(), &self.solved.pulls);
        let palate = body.palate.as_deref().unwrap_or_default();
        report::tongue(&SectionPicture::new(&body.mesh, self.positions(), pulls, palate, title))
    }
}

impl Shape<3> {
    /// A picture: the shaded surface over the edges of the body at rest.
    pub fn picture(&self, title: &str) -> Result<Svg, ReportError> {
        report::solid(&self.assembly.body().mesh, self.positions(), title)
    }
}

impl<const D: usize> Assembly<D> {
    /// The motion from rest while the tensions (N; 2D: per metre of thickness) grow for `ramp_s` (s) and then stay, until `t_end_s` (s), at
    /// `samples` equidistant times, by TR-BDF2 with an error of 1e-6 mm a step.
    ///
    /// # Errors
    /// For names and tensions that [`Solver::equilibrium`](super::Solver::equilibrium) refuses, times out of range, and tissue without
    /// dampers.
    pub fn trajectory(
        &self,
        tensions: &[(&str, f64)],
        ramp_s: f64,
        t_end_s: f64,
        samples: usize,
    ) -> Result<SampledMotion<D>, SimulationError> {
        let is_time = |t: f64| t.is_finite() && t >= SHORTEST_S;
        check_number("the time of the ramp", ramp_s, ramp_s == 0.0 || is_time(ramp_s), "0 or at least 1 ns")?;
        check_number("the time to the end", t_end_s, is_time(t_end_s), "finite and at least 1 ns")?;
        check_number("the time of the ramp", ramp_s, ramp_s <= t_end_s, "at most the time to the end")?;
        let tensions = Tensions::ramp(self.tensions(tensions)?, ramp_s);
        let motion = Motion::new(self.system(), tensions)?;
        let mut integrator =
            IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-3 * STEP_ERROR_MM))?;
        let integrator = integrator.as_mut();
        Ok(SampledMotion::follow(&motion, None, t_end_s, [samples, 1], integrator, &mut |_| ()))
    }
}
