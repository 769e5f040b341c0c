//! One equilibrium: bones are carried to their places, Newton's method goes to where the forces cancel, and
//! safeguards act where it fails or ends in an unstable equilibrium.
//!
//! A bone (a jaw that opens, a hyoid that rises) that is moved in one step would invert the cells beside it, and no step of Newton's method
//! could undo that. So it is moved in parts, each at most half of the step limit of the effects, and the body is solved after each.

use nalgebra::SVector;

use super::mass_spring::at_rest;
use super::safeguards::{settle, step_load};
use super::solution::{FOLLOWED, LEAST_PART, MOST_PARTS};
use super::state::SolveState;
use super::{Solution, SolveSettings, SolveStatus, Stability, Workspace};
use crate::effect::Configuration;
use crate::system::System;

/// Solves for the equilibrium at the given tensions (N, one for each muscle of the mesh; those of muscles
/// that cannot contract in the system have no effect), starting from the positions in `workspace`, and leaves
/// the result there. A mass-spring body in the plane that is at rest starts half of the way to its linear response,
/// if the energy is lower there.
///
/// Converged means a residual force below the tolerance, or below rounding if that is larger (very stiff
/// bodies, bodies far from the origin) and negligible beside the load.
///
/// Never panics and never leaves a position that is not finite: failures are in [`Solution::status`]. No
/// accepted step inverts a cell, because every step is cut so that all cells keep at least a tenth of their
/// measure. If the direct solve fails, the load is applied in steps from rest; if the equilibrium is not
/// stable, the solve continues downhill from it. Bones that the system moves from their places at rest are
/// moved first, unless they are there already.
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
        Err(in_vain) => in_vain,
    };
    for _ in 0..MOST_PARTS {
        match carry(system, workspace) {
            BoneProgress::There => return solve_held(system, workspace, tensions, settings).after(&spent),
            BoneProgress::Nowhere => break,
            BoneProgress::APart => {}
        }
        let follow =
            SolveSettings { tolerance: settings.tolerance.max(FOLLOWED), certify: false, ..*settings };
        spent = solve_held(system, workspace, tensions, &follow).after(&spent);
        if !matches!(spent.status, SolveStatus::Converged | SolveStatus::Stalled) {
            return spent;
        }
    }
    let last = solve_held(system, workspace, tensions, settings).after(&spent);
    Solution { status: SolveStatus::Stalled, ..last }
}

/// As [`solve`], with the bones where they are.
fn solve_held<const D: usize>(
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
        done = settle(system, workspace, settings, &done);
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

/// How far the bones came.
pub(super) enum BoneProgress {
    There,
    APart,
    /// They could not move at all: the cells beside them or a wall forbid it.
    Nowhere,
}

/// Moves the bones along a part of their remaining way.
pub(super) fn carry<const D: usize>(system: &System<D>, w: &mut Workspace<D>) -> BoneProgress {
    if w.carried.iter().all(|&(node, to)| w.positions[node] == to) {
        return BoneProgress::There;
    }
    w.step.fill(SVector::zeros());
    for &(node, to) in &w.carried {
        w.step[node] = to - w.positions[node];
    }
    let at = Configuration { positions: &w.positions, tensions: &w.tensions };
    let limit = system.effects().iter().map(|e| e.step_limit(at, &w.step)).fold(1.0, f64::min);
    if limit < LEAST_PART {
        w.step.fill(SVector::zeros());
        return BoneProgress::Nowhere;
    }
    for &(node, to) in &w.carried {
        if limit < 1.0 {
            w.positions[node] += w.step[node] * (0.5 * limit);
        } else {
            w.positions[node] = to;
        }
    }
    w.factor_ready = false;
    // The step belongs to unknowns only; Newton's method relies on zeros elsewhere.
    w.step.fill(SVector::zeros());
    BoneProgress::APart
}

/// Solves a mass-spring body in the plane in a lane, and leaves the result in the workspace. An error holds the work
/// done before it was clear that the body has effects of another kind or needs a safeguard; the workspace is then unchanged.
fn solve_single<const D: usize>(
    system: &System<D>,
    w: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Result<Solution, Solution> {
    let Some(single) = &mut w.single else { return Err(Solution::NONE) };
    let (elements, work) = (&*single.elements, &mut single.work);
    if single.system != Some(system.number()) {
        single.system = work.set_body(elements, 0, system).then(|| system.number());
    }
    let is_sound = tensions.len() == w.tensions.len() && tensions.iter().all(|t| t.is_finite());
    if !is_sound || single.system.is_none() {
        return Err(Solution::NONE);
    }
    work.set_load(elements, 0, tensions, &w.positions, |node| {
        w.carried.iter().find(|(n, _)| *n == node).map_or(w.positions[node], |(_, to)| *to)
    });
    if w.carried.is_empty()
        && w.positions == system.rest()
        && let Some(at_rest) = at_rest(system, elements)
    {
        work.begin_linearly(0, at_rest, tensions);
    }
    work.solve(elements, settings);
    let solution = work.solution(0).ok_or_else(|| work.spent(0))?;
    let before = (!system.keeps_cells_upright()).then(|| w.positions.clone());
    work.positions(elements, 0, &mut w.positions);
    if let Some(before) = before.filter(|_| system.cell_ratios(&w.positions).0 <= 0.0) {
        w.positions = before;
        return Err(solution);
    }
    work.forces(elements, 0, &mut w.force);
    system.place_path_nodes(&mut w.positions);
    w.tensions.copy_from_slice(tensions);
    // That of the solver for any body belongs to another shape.
    w.factor_ready = false;
    w.factor_is_exact = false;
    Ok(solution)
}
