//! Safeguards for solves in which Newton's method fails: load steps, and descent from unstable equilibria.

use super::state::SolveState;
use super::{Connection, Solution, SolveSettings, SolveStatus, Stability, Workspace};
use crate::system::System;

const SHORTEST_LOAD_STEP: f64 = 1e-5;
/// Largest number of unstable equilibria from which one solve descends.
const MOST_ESCAPES: usize = 8;

/// Applies the load in steps from rest, each solved from the equilibrium before; with displaced bones from the state in which the direct
/// solve, with the result `failed`, ended. A successful step is doubled; a failed one is solved again with corrected Newton steps, and
/// then halved. The workspace gets the last equilibrium.
pub(super) fn step_load<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
    failed: &Solution,
) -> Solution {
    let (mut reached, mut step) = (0.0, 0.25);
    let mut held = match workspace.displaced.as_slice() {
        [] => system.rest().to_vec(),
        // In the shape at rest the bones are not displaced.
        _ => workspace.positions.clone(),
    };
    let mut last = *failed;
    let (mut at_held, mut all) = (Solution { load_reached: 0.0, ..*failed }, *failed);
    let mut connection = Connection::LoadSteps;
    for taken in 1..=settings.load_steps {
        let load = f64::min(reached + step, 1.0);
        let part: Vec<f64> = tensions.iter().map(|t| t * load).collect();
        for corrected in [false, true] {
            workspace.positions.copy_from_slice(&held);
            workspace.factor_ready = false;
            let mut state = SolveState::new(system, workspace);
            state.corrected = corrected;
            last = state.run(&part, settings);
            all.add_cost(&last);
            if last.status == SolveStatus::Converged {
                break;
            }
        }
        all.load_steps = taken;
        if last.status == SolveStatus::Converged {
            held.copy_from_slice(&workspace.positions);
            at_held = last;
            reached = load;
            if last.ridges > 0 {
                connection = Connection::Downhill;
            }
            step *= 2.0;
        } else {
            step *= 0.5;
        }
        if reached == 1.0 || step < SHORTEST_LOAD_STEP {
            break;
        }
    }
    workspace.positions.copy_from_slice(&held);
    let complete = reached == 1.0;
    let stuck = if last.status == SolveStatus::Converged { SolveStatus::IterationLimit } else { last.status };
    Solution {
        status: if complete { SolveStatus::Converged } else { stuck },
        max_residual_force: at_held.max_residual_force,
        rounding_force: at_held.rounding_force,
        connection,
        energy: at_held.energy,
        stability: if reached > 0.0 { at_held.stability } else { Stability::Unchecked },
        load_reached: reached,
        ..all
    }
}

/// Checks the stability of the equilibrium in the workspace by factorising the exact stiffness. From an unstable one it descends along
/// negative curvature and solves again, until the equilibrium is stable.
pub(super) fn escape_unstable<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    settings: &SolveSettings,
    found: &Solution,
) -> Solution {
    let mut all = *found;
    let tensions = workspace.tensions.clone();
    for escapes in 0..=MOST_ESCAPES {
        let mut state = SolveState::new(system, workspace);
        state.done = all;
        let stability = state.classify();
        all = state.done;
        all.stability = stability;
        if stability != Stability::Unstable {
            break;
        }
        state.find_curvature();
        state.done.energy = state.energy();
        if escapes == MOST_ESCAPES || !state.follow_curvature() {
            all.status = SolveStatus::Unstable;
            break;
        }
        let next = SolveState::new(system, workspace).run(&tensions, settings);
        all = Solution { connection: Connection::Downhill, ..next.with_earlier(&all) };
        all.escapes += 1;
        if all.status != SolveStatus::Converged {
            break;
        }
    }
    all
}
