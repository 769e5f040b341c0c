//! What the data say of the tensions, and what they leave open.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Settings;
use super::problem::Problem;
use super::valley::{self, Valley};

/// Local analysis at the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identifiability {
    /// Singular values of d(fitted ratio or stretch)/d(tension), largest first, one for each active muscle (zero where there
    /// are fewer equations), 1/N.
    pub singular_values: Vec<f64>,
    /// One for every direction that the data leave undetermined.
    pub null_directions: Vec<NullDirection>,
}

/// A direction in the space of tensions along which the fit stays as good.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NullDirection {
    /// Unit vector over the active muscles, in their order; its largest entry is positive.
    pub direction: Vec<f64>,
    /// All that was followed of it through the answer.
    pub valley: Valley,
}

/// A singular value below this part of the largest leaves its direction undetermined: over the whole range of tensions it
/// would move the ratios by less than their rounding.
const UNDETERMINED: f64 = 1e-3;

/// Singular values and undetermined directions at `tensions` (N, active muscles), each direction followed as far as
/// the target is met ([`valley`]). `None` where the equilibrium was not found or is
/// singular.
pub fn analyse(problem: &mut dyn Problem, settings: &Settings, x: &[f64]) -> Option<Identifiability> {
    let jacobian = problem.linearise(x)?.jacobian;
    let (singular_values, directions) = decompose(&jacobian)?;
    let open = singular_values.iter().map(|s| *s < UNDETERMINED * singular_values[0]);
    let mut null_directions = Vec::new();
    for (direction, _) in directions.iter().zip(open).filter(|(_, open)| *open) {
        null_directions.push(NullDirection {
            direction: direction.iter().copied().collect(),
            valley: valley::follow(problem, settings, x, direction),
        });
    }
    Some(Identifiability { singular_values, null_directions })
}

/// Orthonormal columns that span the directions in which no row of a matrix changes anything to speak of.
pub(super) fn null_space(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (values, directions) = decompose(matrix)?;
    let open = |v: &f64| *v <= UNDETERMINED * values[0];
    let columns: Vec<DVector<f64>> =
        directions.iter().zip(&values).filter(|(_, v)| open(v)).map(|(d, _)| d.clone()).collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}

/// Singular values, largest first, and for each its direction in the space of tensions; null directions included.
pub(super) fn decompose(jacobian: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<DVector<f64>>)> {
    let n = jacobian.ncols();
    // Rows of zeros make the decomposition give every direction, those without an equation too.
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
