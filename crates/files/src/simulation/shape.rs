//! Equilibria by name: a shape of a body (the positions of its nodes, with the solve that found them), the solver that finds it, and a
//! motion.

use std::sync::Arc;

use nalgebra::SVector;

use super::error::check_number;
use super::{Assembly, SimulationError};
use crate::report::{self, ReportError, SectionPicture, SimulationRecord, Svg, Vtu};
use crate::run::{Equilibrium, STEP_ERROR_MM, SampledMotion, Solved};
use tongue_core::dynamics::{Control, IntegrationMethod, Motion, SHORTEST_S, Tensions};
use tongue_core::statics::{self, Connection, SolveSettings, SolveStatus, Workspace};

/// A shape of a body under tensions, independent of the solver.
#[derive(Debug, Clone)]
pub struct Shape<const D: usize> {
    /// The equilibrium with its alarms, and the trace if it was followed from rest. `wall_s` is NaN.
    pub solved: Solved<D>,
    pub assembly: Assembly<D>,
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
        self.assembly.mean_length(muscle, self.assembly.system.rest())
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
        self.solved.record(&self.assembly.body, None)
    }

    pub fn vtu(&self) -> Result<Vtu<'_, D>, ReportError> {
        Vtu::of(&self.assembly.body, self.positions(), &self.solved.pulls)
    }
}

impl Shape<2> {
    /// A picture: the tissue at rest and deformed, and the muscles with their names.
    pub fn picture(&self, title: &str) -> Result<Svg, ReportError> {
        let (body, pulls) = (&self.assembly.body, &self.solved.pulls);
        let palate = body.palate.as_deref().unwrap_or_default();
        report::tongue(&SectionPicture::new(&body.mesh, self.positions(), pulls, palate, title))
    }
}

impl Shape<3> {
    /// A picture: the shaded surface over the edges of the body at rest.
    pub fn picture(&self, title: &str) -> Result<Svg, ReportError> {
        report::solid(&self.assembly.body.mesh, self.positions(), title)
    }
}

/// Solves equilibria of an [`Assembly`], one after another. Each thread needs one of its own, since a solve writes to its memory.
#[derive(Debug)]
pub struct Solver<const D: usize> {
    pub settings: SolveSettings,
    assembly: Assembly<D>,
    workspace: Workspace<D>,
}

impl<const D: usize> Solver<D> {
    /// The equilibrium at these tensions (N; 2D: per metre of thickness), solved from rest. All other muscles have no tension. The result
    /// does not depend on earlier solves.
    ///
    /// # Errors
    /// A name that the body does not have, that was not assembled, or that is given twice; a tension that is negative or not finite.
    /// [`Shape::is_converged`] says whether there is an equilibrium.
    pub fn equilibrium(&mut self, tensions: &[(&str, f64)]) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        self.workspace.start_from_rest(&self.assembly.system);
        Ok(self.solve(tensions))
    }

    /// Like [`Solver::equilibrium`], but starts from an earlier shape, for small changes of the tensions. Of several equilibria one near
    /// that shape is found.
    pub fn equilibrium_from(
        &mut self,
        start: &Shape<D>,
        tensions: &[(&str, f64)],
    ) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        self.check_body(start)?;
        self.workspace.start_from_rest(&self.assembly.system);
        self.workspace.start_from(start.positions());
        Ok(self.solve(tensions))
    }

    /// Like [`Solver::equilibrium`], and also follows the equilibria from rest as the tensions grow, to check that the shape lies on that
    /// branch ([`Shape::is_traced`]). For the cost see [`statics::trace()`].
    pub fn follow_from_rest(&mut self, tensions: &[(&str, f64)]) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        let (system, w) = (&self.assembly.system, &mut self.workspace);
        w.start_from_rest(system);
        let trace = statics::solve_and_trace(system, w, &tensions, &self.settings);
        Ok(Shape::new(&self.assembly, trace.into(), tensions, w.positions().to_vec()))
    }

    /// Derivatives of the positions of the nodes of an equilibrium by each tension, m/N (2D: per newton per metre of thickness): a list for
    /// each contracting muscle, in their order, with an entry for each node. `None` if the shape is not a stable equilibrium.
    pub fn position_rates(
        &mut self,
        shape: &Shape<D>,
    ) -> Result<Option<Vec<Vec<SVector<f64, D>>>>, SimulationError> {
        self.check_body(shape)?;
        if !shape.is_converged() {
            return Ok(None);
        }
        let muscles = self.assembly.contracting().into_iter().map(|m| self.assembly.fibres(m));
        let muscles = muscles.collect::<Result<Vec<_>, _>>()?;
        let (system, at) = (&self.assembly.system, (shape.positions(), &shape.solved.pulls[..]));
        Ok(statics::position_rates(system, &mut self.workspace, at, &muscles))
    }

    fn check_body(&self, shape: &Shape<D>) -> Result<(), SimulationError> {
        let (given, nodes) = (shape.positions().len(), self.workspace.positions().len());
        (given == nodes).then_some(()).ok_or_else(|| {
            SimulationError::Refused(format!(
                "the shape to start from has {given} nodes, the body {nodes}; take a shape of the same body"
            ))
        })
    }

    /// Displaces a bone by `shift` (m) from its place at rest in all later solves.
    pub fn shift_bone(&mut self, bone: &str, shift: SVector<f64, D>) -> Result<(), SimulationError> {
        let nodes = self.assembly.bone(bone)?;
        for &part in shift.iter() {
            check_number(&format!("the shift of {bone}"), part, part.is_finite(), "finite")?;
        }
        self.workspace.displace_bone(&self.assembly.system, nodes, shift);
        Ok(())
    }

    fn solve(&mut self, tensions: Vec<f64>) -> Shape<D> {
        let solution = statics::solve(&self.assembly.system, &mut self.workspace, &tensions, &self.settings);
        Shape::new(&self.assembly, solution.into(), tensions, self.workspace.positions().to_vec())
    }
}

impl<const D: usize> Assembly<D> {
    /// A solver of this assembly; each thread needs its own.
    pub fn solver(&self) -> Solver<D> {
        let workspace = Workspace::new(&self.system);
        Solver { settings: SolveSettings::default(), assembly: self.clone(), workspace }
    }

    /// The motion from rest while the tensions (N; 2D: per metre of thickness) grow for `ramp_s` (s) and then stay, until `t_end_s` (s), at
    /// `samples` equidistant times, by TR-BDF2 with an error of 1e-6 mm a step.
    ///
    /// # Errors
    /// For names and tensions that [`Solver::equilibrium`] refuses, times out of range, and tissue without
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
        let motion = Motion::new(&self.system, tensions)?;
        let mut integrator =
            IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-3 * STEP_ERROR_MM))?;
        let integrator = integrator.as_mut();
        Ok(SampledMotion::follow(&motion, None, t_end_s, [samples, 1], integrator, &mut |_| ()))
    }
}
