//! Directions in the space of the unknowns, with the sensitivity of the measurements along each.

use nalgebra::{DMatrix, DVector};

/// Singular values below this part of the largest leave their directions undetermined: over the whole range
/// of tensions such a direction changes the ratios by less than their rounding.
pub(super) const UNDETERMINED: f64 = 1e-3;

/// Orthonormal columns that span the null space of a matrix, to the tolerance [`UNDETERMINED`].
pub(super) fn null_space(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (values, directions) = decompose(matrix)?;
    let open = |v: &f64| *v <= UNDETERMINED * values[0];
    let columns: Vec<DVector<f64>> =
        directions.iter().zip(&values).filter(|(_, v)| open(v)).map(|(d, _)| d.clone()).collect();
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
