//! One equilibrium, with what there is to doubt in it.

use tongue_core::statics::{self, Solution, SolveSettings, Workspace};
use tongue_core::system::System;
use tongue_infer::inverse::alarms::{self, Alarm};

use crate::report::{AlarmRecord, SimulationRecord};

/// An equilibrium at given tensions (activations in space); its positions are in the workspace.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    pub solution: Solution,
    /// The branch of equilibria from rest, if it was followed.
    pub branch: Option<statics::Trace>,
    pub alarms: Vec<Alarm>,
}

impl Equilibrium {
    /// The equilibrium at the tensions (activations in space) of all muscles, from where the workspace is.
    /// Unless it is solved for `direct`ly, the equilibria from rest are followed as they grow, to check that
    /// it lies on their branch.
    pub fn of<const D: usize>(
        system: &System<D>,
        workspace: &mut Workspace<D>,
        pulls: &[f64],
        direct: bool,
    ) -> Self {
        let settings = SolveSettings::default();
        if direct {
            let solution = statics::solve(system, workspace, pulls, &settings);
            let alarms = alarms::barrier(solution.guarded).into_iter().collect();
            return Self { solution, branch: None, alarms };
        }
        let found = statics::solve_and_trace(system, workspace, pulls, &settings, statics::TRACE_STEPS);
        let alarms = alarms::of_equilibrium(&found.solution, found.critical);
        Self { solution: found.solution, branch: Some(found), alarms }
    }

    pub fn told(&self) -> Vec<AlarmRecord> {
        self.alarms.iter().map(AlarmRecord::from).collect()
    }

    /// Its record in the plane: of muscles with these names and tensions, N per metre of thickness, after a
    /// solve of `wall_s` seconds.
    pub fn record(
        &self,
        (system, workspace): (&System<2>, &Workspace<2>),
        names: &[String],
        tensions: &[f64],
        wall_s: f64,
    ) -> SimulationRecord {
        let positions = workspace.positions();
        let record = SimulationRecord::new(system, names, &self.solution, tensions, positions, wall_s);
        SimulationRecord { branch: self.branch, alarms: self.told(), ..record }
    }
}
