//! Identifiability: which tensions the data determine and which they do not, by the sensitivity along directions of the unknowns.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::FitSettings;
use super::forward::{Forward, Linearised};
use super::solution_curve::{self, SolutionCurve};

/// Local analysis at the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identifiability {
    /// Singular values of d(fitted ratio or stretch)/d(tension), largest first, one for each active muscle
    /// (zero if there are fewer equations), 1/N.
    pub singular_values: Vec<f64>,
    pub null_directions: Vec<NullDirection>,
}

/// A direction in the space of tensions along which the fit remains as good.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NullDirection {
    /// Unit vector over the active muscles, in their order; its largest entry is positive.
    pub direction: Vec<f64>,
    /// The curve along it through the answer; `None` if the answer itself does not meet the target.
    pub valley: Option<SolutionCurve>,
}

/// Singular values and undetermined directions at `tensions` (N, active muscles), each direction followed as
/// long as the target is met ([`super::solution_curve`]); a curve `followed` before is used if `x` is on it. `None` if the
/// equilibrium was not found or is singular.
pub(super) fn analyse<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    x: &[f64],
    followed: Option<SolutionCurve>,
) -> Option<Identifiability> {
    let Linearised { jacobian, residuals, .. } = problem.linearise(x)?;
    let on_target = problem.misfit(Some(&residuals)) <= settings.misfit_tolerance;
    let (singular_values, directions) = decompose(&jacobian)?;
    let open = singular_values.iter().map(|s| *s < UNDETERMINED * singular_values[0]);
    let open: Vec<_> = directions.iter().zip(open).filter(|(_, open)| *open).map(|(d, _)| d).collect();
    let mut followed = followed.filter(|_| open.len() == 1);
    let mut null_directions = Vec::new();
    for direction in open {
        let valley = on_target.then(|| {
            let again = followed.take().and_then(|valley| valley.through(problem, x, direction));
            again.unwrap_or_else(|| solution_curve::follow(problem, settings, x, direction))
        });
        null_directions.push(NullDirection { direction: direction.iter().copied().collect(), valley });
    }
    Some(Identifiability { singular_values, null_directions })
}

/// Singular values below this part of the largest leave their directions undetermined: over the whole range
/// of tensions such a direction changes the ratios by less than their rounding.
pub(super) const UNDETERMINED: f64 = 1e-3;

/// Orthonormal columns that span the null space of a matrix, to the tolerance [`UNDETERMINED`].
pub(super) fn null_space(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (values, directions) = decompose(matrix)?;
    let columns: Vec<DVector<f64>> = directions
        .iter()
        .zip(&values)
        .filter(|(_, v)| **v <= UNDETERMINED * values[0])
        .map(|(d, _)| d.clone())
        .collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}

/// Singular values, largest first, each with its direction in the space of tensions; null directions
/// included.
pub(super) fn decompose(jacobian: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<DVector<f64>>)> {
    let n = jacobian.ncols();
    // With rows of zeros the decomposition returns all directions, also those without an equation.
    let padded = jacobian.clone().resize_vertically(jacobian.nrows().max(n), 0.0);
    let svd = padded.try_svd(false, true, f64::EPSILON, 10_000)?;
    let v_t = svd.v_t?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let directions = order
        .iter()
        .map(|&i| {
            let v = v_t.row(i).transpose();
            let largest = v.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m });
            if largest < 0.0 { -v } else { v }
        })
        .collect();
    Some((order.iter().map(|&i| svd.singular_values[i]).collect(), directions))
}
