//! A solve that is compared with a trace.

use super::trace::{Trace, trace};
use super::{Solution, SolveSettings, SolveStatus, Workspace, solve};
use crate::body::largest_distance;
use crate::system::System;

/// Shapes are the same if their nodes, or their lengths of muscles, differ by less than this, m. At 1785 loads of `results/stability` the
/// direct and the traced solution differ by at most 3.7e-12 m or by at least 2.9e-4 m. In four posteriors equal lengths differed by at
/// most 1.4e-12 m, and those of different equilibria at the same tensions by 0.2 to 2.7 mm.
pub const SAME_SHAPE_M: f64 = 1e-8;

/// Solves as [`solve`] does and follows the equilibria from rest as [`trace()`] does. The traced shape, to which the body moves as the
/// tensions grow, is the answer if both converge to different shapes or the direct solve fails. If the trace stopped early, a direct
/// answer is kept, and [`Trace::from_rest`] says that its branch is not known.
#[inline(never)]
pub fn solve_and_trace<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Trace {
    let direct = solve(system, workspace, tensions, settings);
    trace_beside(system, workspace, &direct, tensions, settings)
}

/// [`solve_and_trace`] after a direct solve: `direct` is its result, and the workspace has its positions.
#[inline(never)]
pub fn trace_beside<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    direct: &Solution,
    tensions: &[f64],
    settings: &SolveSettings,
) -> Trace {
    let mut other = Workspace { displaced: workspace.displaced.clone(), ..Workspace::new(system) };
    let found = trace(system, &mut other, tensions, settings);
    let [direct_converged, converged] = [direct, &found.solution].map(|s| s.status == SolveStatus::Converged);
    let apart = largest_distance(workspace.positions(), other.positions()) > SAME_SHAPE_M;
    let both = direct_converged && converged;
    let factorisations = direct.factorisations + found.factorisations;
    let (another, same_by_newton) = (found.another || (apart && both), both && !apart);
    let found = Trace { another, same_by_newton, factorisations, ..found };
    let leads_there = found.from_rest.leads_here();
    if converged && (!direct_converged || (apart && leads_there)) {
        std::mem::swap(workspace, &mut other);
        return found;
    }
    let connection = if leads_there { found.solution.connection } else { direct.connection };
    Trace { solution: Solution { connection, ..*direct }, ..found }
}
