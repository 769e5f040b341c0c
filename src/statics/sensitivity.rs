//! How the muscles' lengths answer to their tensions, exactly, at an equilibrium.

use nalgebra::{DMatrix, SVector};

use crate::effect::{Configuration, Tangent};
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::system::System;

use super::Workspace;

/// `d length / d tension`, m/N: a row for every muscle of the mesh, a column for each of the system's contracting muscles.
///
/// From `K dx = (df/dF) dF` at the equilibrium that the last solve left in `workspace`: one factorisation and one solve a
/// column.
///
/// # Errors
/// [`NotPositiveDefinite`] where the equilibrium is not a stable one, or singular (a slack free chain).
pub fn length_sensitivities<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
) -> Result<DMatrix<f64>, NotPositiveDefinite> {
    let w = workspace;
    let pattern = system.pattern();
    let at = Configuration { positions: &w.positions, tensions: &w.tensions };
    w.stiffness.clear();
    system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut w.stiffness));
    w.factor_ready = false;
    w.factor.factorise(pattern, &w.stiffness)?;
    w.factor_ready = true;
    w.factor_is_exact = true;
    let mut out = DMatrix::zeros(system.muscle_count(), system.contracting().len());
    for (column, &muscle) in system.contracting().iter().enumerate() {
        w.step.fill(SVector::zeros());
        system.effects().iter().for_each(|e| e.add_force_per_tension(at, muscle, &mut w.step));
        for (u, &node) in w.unknowns.iter_mut().zip(pattern.nodes()) {
            *u = w.step[node];
        }
        w.factor.solve(pattern, &mut w.unknowns);
        w.step.fill(SVector::zeros());
        for (u, &node) in w.unknowns.iter().zip(pattern.nodes()) {
            w.step[node] = *u;
        }
        for row in 0..system.muscle_count() {
            let [a, b] = system.muscle_ends(row);
            let way = at.positions[b] - at.positions[a];
            out[(row, column)] = way.dot(&(w.step[b] - w.step[a])) / way.norm();
        }
    }
    Ok(out)
}
