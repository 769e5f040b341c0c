//! One equilibrium, with what there is to doubt in it.

use serde::{Serialize, Serializer};
use serde_json::json;
use tongue_core::statics::{self, Solution, SolveSettings, Workspace};
use tongue_core::system::System;
use tongue_infer::inverse::alarms::{self, Alarm};

/// An equilibrium at given tensions (activations in space); its positions are in the workspace.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Equilibrium {
    #[serde(flatten, serialize_with = "told")]
    pub solution: Solution,
    pub branch: Option<statics::Trace>,
    pub alarms: Vec<Alarm>,
}

/// What records tell of a solve: forces in N, in the plane per metre of thickness. If the barrier against inversion
/// acts in elements (`guarded`), the published law does not hold there.
fn told<S: Serializer>(solution: &Solution, serializer: S) -> Result<S::Ok, S::Error> {
    let record = json!({
        "status": solution.status,
        "max_residual_force_n": solution.max_residual_force,
        "load_reached": solution.load_reached,
        "stability": solution.stability,
        "connection": solution.connection,
        "guarded": solution.guarded,
        "iterations": solution.iterations,
        "factorisations": solution.factorisations,
    });
    record.serialize(serializer)
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
        let found = statics::solve_and_trace(system, workspace, pulls, &settings);
        let alarms = alarms::of_equilibrium(&found.solution, found.critical);
        Self { solution: found.solution, branch: Some(found), alarms }
    }
}
