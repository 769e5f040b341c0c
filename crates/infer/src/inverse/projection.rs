//! Moves answers onto a target, and along it to the best fit of the other measurements.

use nalgebra::{DMatrix, DVector};

use super::forward::{Forward, Linearised};
use super::problem::Unknown;

/// Misfit of an answer that is on the target.
pub(super) const ON_TARGET: f64 = 1e-10;
const MOST_CORRECTIONS: usize = 8;
const MOST_STEPS: usize = 60;
/// Steps below this end the search, in units of the unknowns.
const STILL: f64 = 1e-7;
/// A value nearer than this to a bound is on it, in units of the unknowns.
pub(super) const ON_BOUND: f64 = 1e-9;

/// Moves `x` by the smallest correction that meets the targets to first order within the bounds: unknowns that would leave their bounds are
/// set to them and the others are corrected again. Returns the Jacobian.
pub(super) fn correct<const D: usize>(
    forward: &mut Forward<'_, D>,
    x: &mut DVector<f64>,
) -> Option<DMatrix<f64>> {
    let unknowns = &forward.problem.unknowns;
    let Linearised { jacobian, residuals, .. } = forward.linearise(x.as_slice())?;
    let start = x.clone();
    let mut free = jacobian.clone();
    for _ in 0..x.len() {
        let inverse = free.clone().pseudo_inverse(1e-9).ok()?;
        let left = &residuals + &jacobian * (&*x - &start);
        let next = &*x - inverse * left;
        let moved = (0..next.len()).filter(|&i| next[i] != x[i]);
        let leaving =
            Vec::from_iter(moved.filter(|&i| !(unknowns[i].lower..=unknowns[i].upper).contains(&next[i])));
        if leaving.is_empty() {
            *x = next;
            break;
        }
        for i in leaving {
            x[i] = next[i].clamp(unknowns[i].lower, unknowns[i].upper);
            free.column_mut(i).fill(0.0);
        }
    }
    Some(jacobian)
}

/// Moves an answer that the effort keeps off the target to the nearest values that meet it. Returns `answer` where that improves nothing.
pub(super) fn onto_target<const D: usize>(forward: &mut Forward<'_, D>, answer: &[f64]) -> Vec<f64> {
    let residuals = forward.residuals(answer);
    let mut best = (forward.misfit(residuals.as_ref()), answer.to_vec());
    let mut here = DVector::from_column_slice(answer);
    for _ in 0..MOST_CORRECTIONS {
        if best.0 < ON_TARGET {
            break;
        }
        let mut target = here.clone();
        if correct(forward, &mut target).is_none() {
            break;
        }
        // Backtracking: half the step until the misfit decreases.
        let step = target - &here;
        let better = (0..6).find_map(|halvings| {
            let next = &here + &step * 0.5f64.powi(halvings);
            let residuals = forward.residuals_without_neighbours(next.as_slice());
            let misfit = forward.misfit(residuals.as_ref());
            (misfit < 0.95 * best.0).then_some((misfit, next))
        });
        let Some((misfit, next)) = better else { break };
        best = (misfit, next.iter().copied().collect());
        here = next;
    }
    best.1
}

/// Largest step before a value leaves its bounds, in units of the unknowns.
pub(super) fn largest_step(here: &DVector<f64>, along: &DVector<f64>, unknowns: &[Unknown]) -> f64 {
    here.iter()
        .zip(along.iter())
        .zip(unknowns)
        .map(|((t, d), u)| match d {
            d if *d < -1e-12 => (t - u.lower) / -d,
            d if *d > 1e-12 => (u.upper - t) / d,
            _ => f64::INFINITY,
        })
        .fold(f64::INFINITY, f64::min)
}

/// Moves values that meet the target along it to the least-squares fit of the other measurements within the bounds: Gauss-Newton in the
/// undetermined directions, each step corrected onto the target.
pub(super) fn nearest_to_others<const D: usize>(forward: &mut Forward<'_, D>, answer: &[f64]) -> Vec<f64> {
    let unknowns = &forward.problem.unknowns;
    let mut here = DVector::from_column_slice(answer);
    for _ in 0..MOST_STEPS {
        let Some(linear) = forward.linearise(here.as_slice()) else { break };
        if linear.other_residuals.is_empty() {
            break;
        }
        let Some(step) = step_along(&linear, &here, unknowns) else { break };
        let before = linear.other_residuals.norm_squared();
        let whole = largest_step(&here, &step, unknowns).min(1.0);
        let better = (0..12).find_map(|halvings| {
            let part = whole * 0.5f64.powi(halvings);
            let next = onto_target(forward, (&here + &step * part).as_slice());
            forward.residuals(&next)?;
            let next = DVector::from_vec(next);
            (forward.other_residuals().norm_squared() < before).then_some(next)
        });
        let Some(next) = better else { break };
        let moved = (&next - &here).amax();
        here = next;
        if moved < STILL {
            break;
        }
    }
    here.iter().copied().collect()
}

/// The Gauss-Newton step in the undetermined directions; unknowns that it would push beyond their bounds stay on them.
fn step_along(linear: &Linearised, here: &DVector<f64>, unknowns: &[Unknown]) -> Option<DVector<f64>> {
    let mut rows = linear.jacobian.clone();
    for _ in 0..=here.len() {
        let open = null_space(&rows)?;
        let slopes = &linear.other_jacobian * &open;
        let along = slopes.clone().pseudo_inverse(1e-12).ok()? * -&linear.other_residuals;
        let step = open * along;
        let leaving: Vec<usize> = Vec::from_iter((0..here.len()).filter(|i| {
            let (x, u) = (here[*i], unknowns[*i]);
            (x < u.lower + ON_BOUND && step[*i] < -ON_BOUND)
                || (x > u.upper - ON_BOUND && step[*i] > ON_BOUND)
        }));
        if leaving.is_empty() {
            return Some(step);
        }
        let scale = rows.amax().max(f64::MIN_POSITIVE);
        for i in leaving {
            let at = rows.nrows();
            rows = rows.insert_row(at, 0.0);
            rows[(at, i)] = scale;
        }
    }
    None
}

/// Singular values below this part of the largest leave their directions undetermined: over the whole range
/// of tensions such a direction changes the ratios by less than their rounding.
pub(super) const UNDETERMINED: f64 = 1e-3;

/// Orthonormal columns that span the null space of a matrix, to the tolerance [`UNDETERMINED`].
pub(super) fn null_space(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let (values, directions) = decompose(matrix)?;
    let open = directions.into_iter().zip(&values).filter(|(_, v)| **v <= UNDETERMINED * values[0]);
    let columns: Vec<DVector<f64>> = open.map(|(direction, _)| direction).collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}

/// Singular values, largest first, each with its unit direction in the space of unknowns; directions of the null space included.
pub(super) fn decompose(jacobian: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<DVector<f64>>)> {
    let n = jacobian.ncols();
    // Rows of zeros make the decomposition return the directions without an equation too.
    let padded = jacobian.clone().resize_vertically(jacobian.nrows().max(n), 0.0);
    let svd = padded.try_svd(false, true, f64::EPSILON, 10_000)?;
    let v_t = svd.v_t?;
    let directions = v_t.row_iter().map(|row| {
        let v = row.transpose();
        let largest = v.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m });
        if largest < 0.0 { -v } else { v }
    });
    Some((svd.singular_values.iter().copied().collect(), directions.collect()))
}
