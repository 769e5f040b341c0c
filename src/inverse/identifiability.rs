//! What the data say of the tensions, and what they leave open.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Settings;
use super::problem::{Linear, Problem};
use super::unknown::Unknown;

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
const ON_TARGET: f64 = 1e-10;
/// Most corrections that move an answer onto the target.
const MOST_CORRECTIONS: usize = 8;

/// Singular values and undetermined directions at `tensions` (N, active muscles), each direction followed as far as the
/// misfit stays within the tolerance and the tensions within their bounds. `None` where the equilibrium was not found or is
/// singular.
pub fn analyse(problem: &mut dyn Problem, settings: &Settings, x: &[f64]) -> Option<Identifiability> {
    let jacobian = problem.linearise(x)?.jacobian;
    let (singular_values, directions) = decompose(&jacobian)?;
    let open = singular_values.iter().map(|s| *s < UNDETERMINED * singular_values[0]);
    let mut null_directions = Vec::new();
    for (direction, _) in directions.iter().zip(open).filter(|(_, open)| *open) {
        null_directions.push(NullDirection {
            direction: direction.iter().copied().collect(),
            from_n: follow(problem, settings, x, &-direction),
            to_n: follow(problem, settings, x, direction),
        });
    }
    Some(Identifiability { singular_values, null_directions })
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
fn follow(
    problem: &mut dyn Problem,
    settings: &Settings,
    start: &[f64],
    direction: &DVector<f64>,
) -> Vec<f64> {
    let unknowns = problem.unknowns().to_vec();
    let at_start = problem.residuals(start);
    let tolerance = settings.misfit_tolerance.max(problem.misfit(at_start.as_ref()) * 1.01);
    let mut here = DVector::from_column_slice(start);
    let mut along = direction.clone();
    let mut stride = STRIDE;
    for _ in 0..MOST_STRIDES {
        let room = room(&here, &along, &unknowns);
        if room <= 1e-9 || stride < SHORTEST_STRIDE {
            break;
        }
        let mut next = &here + &along * room.min(stride);
        let jacobian = correct(problem, &mut next, &unknowns);
        let residuals = problem.residuals(next.as_slice());
        let misfit = problem.misfit(residuals.as_ref());
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
fn correct(problem: &mut dyn Problem, x: &mut DVector<f64>, unknowns: &[Unknown]) -> Option<DMatrix<f64>> {
    let Linear { jacobian, residuals } = problem.linearise(x.as_slice())?;
    let start = x.clone();
    let mut free = jacobian.clone();
    for _ in 0..x.len() {
        let inverse = free.clone().pseudo_inverse(1e-9).ok()?;
        let left = &residuals + &jacobian * (&*x - &start);
        let next = &*x - inverse * left;
        let out = |i: usize| !(unknowns[i].lower..=unknowns[i].upper).contains(&next[i]);
        let leaving: Vec<usize> = (0..next.len()).filter(|&i| out(i) && next[i] != x[i]).collect();
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

/// Moves an answer that the effort term holds a little beside the target onto it: the nearest values that meet the targets. Returns
/// the answer itself where that makes nothing better.
pub(super) fn onto_target(problem: &mut dyn Problem, answer: &[f64]) -> Vec<f64> {
    let unknowns = problem.unknowns().to_vec();
    let residuals = problem.residuals(answer);
    let mut best = (problem.misfit(residuals.as_ref()), answer.to_vec());
    let mut here = DVector::from_column_slice(answer);
    for _ in 0..MOST_CORRECTIONS {
        if best.0 < ON_TARGET {
            break;
        }
        let mut target = here.clone();
        if correct(problem, &mut target, &unknowns).is_none() {
            break;
        }
        // A whole step where the way is straight; less where it is not.
        let step = target - &here;
        let better = (0..6).find_map(|halvings| {
            let next = &here + &step * 0.5f64.powi(halvings);
            let residuals = problem.residuals_from_rest(next.as_slice());
            let misfit = problem.misfit(residuals.as_ref());
            (misfit < 0.95 * best.0).then_some((misfit, next))
        });
        let Some((misfit, next)) = better else { break };
        best = (misfit, next.iter().copied().collect());
        here = next;
    }
    best.1
}

/// How far one can go before a value leaves its bounds, in units.
pub(super) fn room(here: &DVector<f64>, along: &DVector<f64>, unknowns: &[Unknown]) -> f64 {
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
