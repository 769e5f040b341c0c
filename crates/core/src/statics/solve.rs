//! One equilibrium: bones are moved to their places, Newton's method finds where the forces cancel, and safeguards act if it fails or ends
//! in an unstable equilibrium.
//!
//! A bone (a jaw that opens, a hyoid that rises) that moved in one step would invert the cells beside it, which Newton's method cannot
//! undo. So it moves in parts, each at most half of the step limit of the effects, with a solve after each.

use nalgebra::SVector;

use super::mass_spring::at_rest;
use super::safeguards::{escape_unstable, step_load};
use super::solution::{BONE_STEP_TOLERANCE, MOST_BONE_STEPS, SHORTEST_BONE_STEP};
use super::state::SolveState;
use super::{Solution, SolveSettings, SolveStatus, Stability, Workspace};
use crate::system::System;

/// Solves for the equilibrium at the given tensions (N, one for each muscle of the mesh; those of muscles that cannot contract have no
/// effect), starting from the positions in `workspace`, which get the result. A mass-spring body in the plane that is at rest starts from
/// half of its linear response if the energy is lower there.
///
/// Converged means a residual force below the tolerance, or below rounding if that is larger (very stiff bodies, bodies far from the
/// origin) and negligible beside the load.
///
/// It never panics and never leaves a position that is not finite; [`Solution::status`] has failures. Every step is shortened so that all
/// cells keep at least a tenth of their measure, so that none is inverted. If the direct solve fails, the load is applied in steps from
/// rest; from an equilibrium that is not stable the solve descends. Bones that the system displaces are moved first, unless they are at
/// their places.
///
/// # Example
/// ```
/// use tongue_core::body::Body;
/// use tongue_core::statics::{self, SolveSettings, SolveStatus, Workspace};
/// use tongue_core::system::{Model, System};
///
/// let body = Body::tongue(5.5e-3)?;
/// let gga = body.muscle("GGa")?;
/// let system = System::new(&body.mesh, &Model::default(), &[gga])?;
/// let mut workspace = Workspace::new(&system); // at rest
/// let mut tensions = vec![0.0; body.mesh.muscles.len()];
/// tensions[gga] = 12.0; // N per metre of thickness
/// let solution = statics::solve(&system, &mut workspace, &tensions, &SolveSettings::default());
/// assert_eq!(solution.status, SolveStatus::Converged);
/// let stretch = system.length(workspace.positions(), gga) / system.length(system.rest(), gga);
/// assert!((0.85..0.95).contains(&stretch));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[inline(never)]
pub fn solve<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Solution {
    let mut spent = match solve_single(system, workspace, tensions, settings) {
        Ok(solution) => return solution,
        Err(spent) => spent,
    };
    for _ in 0..MOST_BONE_STEPS {
        match move_bones(system, workspace) {
            BoneProgress::Complete => {
                return solve_with_fixed_bones(system, workspace, tensions, settings).with_earlier(&spent);
            }
            BoneProgress::Blocked => break,
            BoneProgress::Partial => {}
        }
        let follow = SolveSettings {
            tolerance: settings.tolerance.max(BONE_STEP_TOLERANCE),
            certify: false,
            ..*settings
        };
        spent = solve_with_fixed_bones(system, workspace, tensions, &follow).with_earlier(&spent);
        if !matches!(spent.status, SolveStatus::Converged | SolveStatus::Stalled) {
            return spent;
        }
    }
    let last = solve_with_fixed_bones(system, workspace, tensions, settings).with_earlier(&spent);
    Solution { status: SolveStatus::Stalled, ..last }
}

/// [`solve`] with bones that do not move.
fn solve_with_fixed_bones<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Solution {
    let mut done = SolveState::new(system, workspace).run(tensions, settings);
    if matches!(done.status, SolveStatus::IterationLimit | SolveStatus::Stalled) && settings.load_steps > 0 {
        done = step_load(system, workspace, tensions, settings, &done);
    }
    if done.status == SolveStatus::Converged && (settings.certify || done.stability == Stability::Unchecked) {
        done = escape_unstable(system, workspace, settings, &done);
    }
    done.guarded = system.barrier_active(workspace.configuration());
    if done.status == SolveStatus::Converged
        && !system.keeps_cells_upright()
        && system.cell_ratios(workspace.positions()).0 <= 0.0
    {
        done.status = SolveStatus::Inverted;
    }
    done
}

pub(super) enum BoneProgress {
    Complete,
    Partial,
    /// They cannot move, because cells beside them or a wall prevent it.
    Blocked,
}

/// Moves the bones by a part of their remaining displacement.
pub(super) fn move_bones<const D: usize>(system: &System<D>, w: &mut Workspace<D>) -> BoneProgress {
    if w.displaced.iter().all(|&(node, to)| w.positions[node] == to) {
        return BoneProgress::Complete;
    }
    w.step.fill(SVector::zeros());
    for &(node, to) in &w.displaced {
        w.step[node] = to - w.positions[node];
    }
    let limit = system.step_limit(w.configuration(), &w.step);
    if limit < SHORTEST_BONE_STEP {
        w.step.fill(SVector::zeros());
        return BoneProgress::Blocked;
    }
    for &(node, to) in &w.displaced {
        if limit < 1.0 {
            w.positions[node] += w.step[node] * (0.5 * limit);
        } else {
            w.positions[node] = to;
        }
    }
    w.factor_ready = false;
    // Newton's method relies on a step of zero at nodes that are no unknowns.
    w.step.fill(SVector::zeros());
    BoneProgress::Partial
}

/// Solves a mass-spring body in the plane in a lane. An error, for a body with other effects or one that needs a safeguard, has the counts
/// of work and leaves the positions unchanged.
fn solve_single<const D: usize>(
    system: &System<D>,
    w: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Result<Solution, Solution> {
    let Some((elements, work)) = &mut w.single else { return Err(Solution::NONE) };
    if w.in_lane != Some(system.number) {
        w.in_lane = elements.fill(system, 0, &mut work.numbers).then_some(system.number);
    }
    let is_sound = tensions.len() == w.tensions.len() && tensions.iter().all(|t| t.is_finite());
    if !is_sound || w.in_lane.is_none() {
        return Err(Solution::NONE);
    }
    work.set_load(elements, 0, tensions, &w.positions, |node| {
        w.displaced.iter().find(|(n, _)| *n == node).map_or(w.positions[node], |(_, to)| *to)
    });
    if w.displaced.is_empty()
        && w.positions == system.rest()
        && let Some(at_rest) = at_rest(system, elements)
    {
        work.start_from_linear_response(0, at_rest, tensions);
    }
    work.solve(elements, settings);
    let solution = work.solution(0)?;
    let before = (!system.keeps_cells_upright()).then(|| w.positions.clone());
    elements.take_from_lane(0, &work.positions, &mut w.positions);
    if let Some(before) = before.filter(|_| system.cell_ratios(&w.positions).0 <= 0.0) {
        w.positions = before;
        return Err(solution);
    }
    w.force.fill(SVector::zeros());
    elements.take_from_lane(0, &work.force, &mut w.force);
    system.place_path_nodes(&mut w.positions);
    w.tensions.copy_from_slice(tensions);
    // The factor of the solver for any body belongs to another shape.
    w.factor_ready = false;
    w.factor_is_exact = false;
    Ok(solution)
}
