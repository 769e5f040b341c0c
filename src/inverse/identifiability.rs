//! What the data say of the tensions, and what they leave open.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::measured::TargetKind;
use crate::muscle::Muscle;
use crate::statics::length_sensitivities;

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
/// Longest step along an undetermined direction, N.
const STRIDE: f64 = 5.0;
/// Shortest step: an end is known to about this, N.
const SHORTEST_STRIDE: f64 = 0.05;
/// Most steps to either side.
const MOST_STRIDES: usize = 200;
/// A misfit that is none.
const IN_THE_VALLEY: f64 = 1e-10;
/// Most corrections that move an answer into the valley.
const MOST_CORRECTIONS: usize = 8;

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

/// Walks from `start` along `direction` and on along the valley, and returns where it ends: at a bound, or where the misfit
/// leaves the tolerance however short the step.
fn follow(forward: &mut Forward<'_>, start: &[f64], direction: &DVector<f64>) -> Vec<f64> {
    let bound = forward.settings.upper_bound;
    let tolerance = forward.settings.misfit_tolerance.max(forward.evaluate(start).misfit * 1.01);
    let mut here = DVector::from_column_slice(start);
    let mut along = direction.clone();
    let mut stride = STRIDE;
    for _ in 0..MOST_STRIDES {
        let room = room(&here, &along, bound);
        if room <= 1e-9 || stride < SHORTEST_STRIDE {
            break;
        }
        let mut next = &here + &along * room.min(stride);
        let jacobian = correct(forward, &mut next, bound);
        let misfit = forward.evaluate(next.as_slice()).misfit;
        let gained = (&next - &here).dot(&along);
        let Some(jacobian) = jacobian.filter(|_| misfit <= tolerance && gained > 0.5 * room.min(stride))
        else {
            stride *= 0.5;
            continue;
        };
        here = next;
        if room <= stride {
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

/// Moves `tensions` by the smallest correction that meets the targets to first order, within the bounds: tensions that would
/// leave them are held there and the others corrected anew. Returns the sensitivities used.
fn correct(forward: &mut Forward<'_>, tensions: &mut DVector<f64>, bound: f64) -> Option<DMatrix<f64>> {
    let (jacobian, residuals) = linearise(forward, tensions.as_slice())?;
    let start = tensions.clone();
    let mut free = jacobian.clone();
    for _ in 0..tensions.len() {
        let inverse = free.clone().pseudo_inverse(1e-9).ok()?;
        let left = &residuals + &jacobian * (&*tensions - &start);
        let next = &*tensions - inverse * left;
        let out = |t: f64| !(0.0..=bound).contains(&t);
        let leaving: Vec<usize> =
            (0..next.len()).filter(|&i| out(next[i]) && next[i] != tensions[i]).collect();
        if leaving.is_empty() {
            *tensions = next;
            break;
        }
        for i in leaving {
            tensions[i] = next[i].clamp(0.0, bound);
            free.column_mut(i).fill(0.0);
        }
    }
    Some(jacobian)
}

/// Moves an answer that the effort term holds a little beside the valley into it: the nearest tensions that meet the targets.
/// Returns the answer itself where that makes nothing better.
pub(super) fn into_the_valley(forward: &mut Forward<'_>, answer: &[f64]) -> Vec<f64> {
    let bound = forward.settings.upper_bound;
    let mut best = (forward.evaluate(answer).misfit, answer.to_vec());
    let mut here = DVector::from_column_slice(answer);
    for _ in 0..MOST_CORRECTIONS {
        if best.0 < IN_THE_VALLEY {
            break;
        }
        let mut target = here.clone();
        if correct(forward, &mut target, bound).is_none() {
            break;
        }
        // A whole step where the valley is straight; less where it is not.
        let step = target - &here;
        let better = (0..6).find_map(|halvings| {
            let next = &here + &step * 0.5f64.powi(halvings);
            let misfit = forward.evaluate_from_rest(next.as_slice()).misfit;
            (misfit < 0.95 * best.0).then_some((misfit, next))
        });
        let Some((misfit, next)) = better else { break };
        best = (misfit, next.iter().copied().collect());
        here = next;
    }
    best.1
}

/// How far one can go before a tension leaves its bounds, N.
pub(super) fn room(here: &DVector<f64>, along: &DVector<f64>, bound: f64) -> f64 {
    here.iter()
        .zip(along.iter())
        .map(|(t, d)| match d {
            d if *d < -1e-12 => t / -d,
            d if *d > 1e-12 => (bound - t) / d,
            _ => f64::INFINITY,
        })
        .fold(f64::INFINITY, f64::min)
}
