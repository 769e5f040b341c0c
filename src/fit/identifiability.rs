//! What the data say of the tensions, and what they leave open.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::equilibrium::length_sensitivities;
use crate::muscle::Muscle;
use crate::target::TargetKind;

use super::objective::Forward;

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
    /// Tensions of the active muscles at the end reached against the direction, N.
    pub from_n: Vec<f64>,
    /// Tensions of the active muscles at the end reached along the direction, N.
    pub to_n: Vec<f64>,
}

/// A singular value below this part of the largest leaves its direction undetermined: over the whole range of tensions it
/// would move the ratios by less than their rounding.
const UNDETERMINED: f64 = 1e-3;
/// Length of a step along an undetermined direction, N.
const STRIDE: f64 = 5.0;
/// Most steps to either side.
const MOST_STRIDES: usize = 100;

/// Singular values and undetermined directions at `tensions` (N, active muscles), each direction followed as far as the
/// misfit stays within the tolerance and the tensions within their bounds. `None` where the equilibrium was not found or is
/// singular.
pub fn analyse(forward: &mut Forward<'_>, tensions: &[f64]) -> Option<Identifiability> {
    let (jacobian, _) = linearise(forward, tensions)?;
    let (singular_values, directions) = decompose(&jacobian)?;
    let open = singular_values.iter().map(|s| *s < UNDETERMINED * singular_values[0]);
    let mut null_directions = Vec::new();
    for (direction, _) in directions.iter().zip(open).filter(|(_, open)| *open) {
        null_directions.push(NullDirection {
            direction: direction.iter().copied().collect(),
            from_n: follow(forward, tensions, &-direction),
            to_n: follow(forward, tensions, direction),
        });
    }
    Some(Identifiability { singular_values, null_directions })
}

/// d(fitted value)/d(tension), 1/N, and the residuals of the fitted values, at the equilibrium of `tensions`.
pub(super) fn linearise(forward: &mut Forward<'_>, tensions: &[f64]) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let lengths = forward.evaluate(tensions).lengths?;
    forward.count_factorisation();
    let per_tension = length_sensitivities(forward.system, &mut forward.workspace).ok()?;
    let target = forward.target;
    let rest = forward.rest_lengths();
    let simulated = target.simulated(&lengths, &rest);
    let gga = forward.number(Muscle::GGa);
    let mut jacobian = DMatrix::zeros(target.fitted.len(), target.active.len());
    let mut residuals = DVector::zeros(target.fitted.len());
    for (row, m) in target.fitted.iter().enumerate() {
        let (i, number) = (m.index(), forward.number(*m));
        residuals[row] = simulated[i] - target.values[i];
        for column in 0..target.active.len() {
            let change = per_tension[(number, column)];
            jacobian[(row, column)] = match target.kind {
                TargetKind::Stretch => change / rest[i],
                TargetKind::Ratio => {
                    let base = lengths[Muscle::GGa.index()];
                    (change - simulated[i] * per_tension[(gga, column)]) / base
                }
            };
        }
    }
    Some((jacobian, residuals))
}

/// Singular values, largest first, and for each its direction in the space of tensions; null directions included.
fn decompose(jacobian: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<DVector<f64>>)> {
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

/// Walks from `start` along `direction` and on along the valley, and returns where it ends: at a bound, or where the misfit
/// leaves the tolerance.
fn follow(forward: &mut Forward<'_>, start: &[f64], direction: &DVector<f64>) -> Vec<f64> {
    let bound = forward.settings.upper_bound;
    let tolerance = forward.settings.misfit_tolerance.max(forward.evaluate(start).misfit * 1.01);
    let mut here = DVector::from_column_slice(start);
    let mut along = direction.clone();
    for _ in 0..MOST_STRIDES {
        let room = room(&here, &along, bound);
        if room <= 0.0 {
            break;
        }
        let mut next = &here + &along * room.min(STRIDE);
        let Some((jacobian, residuals)) = linearise(forward, next.as_slice()) else { break };
        // Back into the valley: the smallest correction that meets the targets to first order.
        if let Ok(inverse) = jacobian.clone().pseudo_inverse(1e-9) {
            next -= inverse * residuals;
        }
        next.apply(|t| *t = t.clamp(0.0, bound));
        let misfit = forward.evaluate(next.as_slice()).misfit;
        let gained = (&next - &here).dot(&along);
        if misfit.is_nan() || misfit > tolerance || gained < 1e-6 {
            break;
        }
        here = next;
        if room <= STRIDE {
            break;
        }
        // The valley bends: go on along its direction here, the way that leads on.
        if let Some((_, directions)) = decompose(&jacobian)
            && let Some(d) =
                directions.iter().max_by(|a, b| a.dot(&along).abs().total_cmp(&b.dot(&along).abs()))
        {
            along = d * d.dot(&along).signum();
        }
    }
    here.iter().copied().collect()
}

/// How far one can go before a tension leaves its bounds, N.
fn room(here: &DVector<f64>, along: &DVector<f64>, bound: f64) -> f64 {
    here.iter()
        .zip(along.iter())
        .map(|(t, d)| match d {
            d if *d < -1e-12 => t / -d,
            d if *d > 1e-12 => (bound - t) / d,
            _ => f64::INFINITY,
        })
        .fold(f64::INFINITY, f64::min)
}
