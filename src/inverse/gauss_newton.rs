//! One start of a damped Gauss-Newton method with bounds: what the exact sensitivities of the equilibrium allow.
//!
//! With `r` the residuals, `J` their derivative and `c` the effort, the cost `r·r + c sum F` has the gradient `2 Jᵀr + c` and the
//! second derivative `2 (JᵀJ + S)`, `S = sum r_i d²r_i/dF²`. Where the target is met, `S` vanishes and the method is
//! Levenberg's (1944) and Marquardt's (1963). Where ratios leave a direction open, only `S` says where along the valley the
//! sum of the tensions is smallest; it is then built up from the changes of `J` by the secant of Dennis, Gay and Welsch
//! (1981, eqs. 2.8-2.10). Tensions that the gradient pushes against a bound stay on it (Bertsekas 1982).

use nalgebra::{DMatrix, DVector};

use crate::muscle::PerMuscle;

use super::identifiability::linearise;
use super::objective::{FAILED, Forward};
use super::search::{SAME_COST, START_RANGE, Start, starting_point};

/// Damping of the first step as part of the largest diagonal entry of the second derivative.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping beyond which no step can be told from none, as part of the same.
const MOST_DAMPING: f64 = 1e12;
/// Least part of the predicted decrease with which a step is accepted.
const ACCEPTED: f64 = 1e-3;

/// Tensions and all that is known of the cost there.
struct Point {
    tensions: DVector<f64>,
    jacobian: DMatrix<f64>,
    residuals: DVector<f64>,
    gradient: DVector<f64>,
    cost: f64,
}

impl Point {
    fn new(forward: &mut Forward<'_>, tensions: DVector<f64>) -> Option<Self> {
        let (jacobian, residuals) = linearise(forward, tensions.as_slice())?;
        let effort = forward.effort();
        let gradient = (jacobian.tr_mul(&residuals) * 2.0).add_scalar(effort);
        let cost = residuals.norm_squared() + effort * tensions.sum();
        cost.is_finite().then_some(Self { tensions, jacobian, residuals, gradient, cost })
    }

    /// Whether the cost would fall if tension `i` left the bound that it is on.
    fn is_free(&self, i: usize, bound: f64) -> bool {
        let (t, g) = (self.tensions[i], self.gradient[i]);
        (t > 0.0 || g < 0.0) && (t < bound || g > 0.0)
    }
}

/// Searches from start number `number`. The same structure as a start of Nelder-Mead; there are no restarts.
pub(super) fn run(mut forward: Forward<'_>, number: usize) -> Start {
    let settings = forward.settings;
    let bound = settings.upper_bound;
    let n = forward.target.active.len();
    let first = starting_point(number, n, START_RANGE * bound);
    let mut start = Start::at(first, FAILED);
    // A start without an equilibrium is given up for the rest shape, which always has one.
    let point = Point::new(&mut forward, DVector::from_column_slice(&start.tensions))
        .or_else(|| Point::new(&mut forward, DVector::zeros(n)));
    if let Some(mut here) = point {
        start.converged = descend(&mut forward, &mut here, &mut start.iterations);
        let mut from_rest = forward.evaluate_from_rest(here.tensions.as_slice());
        // As in Nelder-Mead: another branch of equilibria than the one from rest does not count.
        if (from_rest.cost - here.cost).abs() > SAME_COST * here.cost.abs().max(SAME_COST) {
            forward.forget_neighbours();
            start.converged = match Point::new(&mut forward, here.tensions.clone()) {
                Some(again) => {
                    here = again;
                    descend(&mut forward, &mut here, &mut start.iterations)
                }
                None => false,
            };
            from_rest = forward.evaluate_from_rest(here.tensions.as_slice());
        }
        start.tensions = here.tensions.iter().copied().collect();
        start.cost = from_rest.cost;
        start.lengths = from_rest.lengths;
    }
    start.evaluations = forward.evaluations();
    start.failures = forward.failures();
    start.factorisations = forward.factorisations();
    start
}

/// Where a search from a given point ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Refit {
    /// Tensions of the active muscles, N.
    pub tensions: Vec<f64>,
    /// Objective there.
    pub cost: f64,
    /// Root mean square residual of the fitted muscles.
    pub misfit: f64,
    /// Lengths of the eight muscles there, m.
    pub lengths: PerMuscle<f64>,
}

/// Searches from given tensions (N, active muscles) that are nearly right, within the bounds. `None` where there is no
/// equilibrium to begin with.
pub(super) fn refit(forward: &mut Forward<'_>, from: &[f64]) -> Option<Refit> {
    let mut here = Point::new(forward, DVector::from_column_slice(from))?;
    descend(forward, &mut here, &mut 0);
    let tensions: Vec<f64> = here.tensions.iter().copied().collect();
    let outcome = forward.evaluate(&tensions);
    Some(Refit { cost: outcome.cost, misfit: outcome.misfit, lengths: outcome.lengths?, tensions })
}

/// Goes downhill from `here`, and says whether it arrived.
fn descend(forward: &mut Forward<'_>, here: &mut Point, iterations: &mut u64) -> bool {
    let settings = forward.settings;
    let mut secant = DMatrix::zeros(here.tensions.len(), here.tensions.len());
    let diagonal = |p: &Point| 2.0 * p.jacobian.column_iter().map(|c| c.norm_squared()).fold(1e-12, f64::max);
    let mut damping = FIRST_DAMPING * diagonal(here);
    let mut growth = 2.0;
    while *iterations < settings.max_iterations && damping < MOST_DAMPING * diagonal(here) {
        *iterations += 1;
        let curvature = (here.jacobian.tr_mul(&here.jacobian) + &secant) * 2.0;
        let Some(step) = bounded_step(here, &curvature, damping, settings.upper_bound) else {
            // Not downhill: the second derivative is indefinite on the free tensions.
            damping *= growth;
            growth *= 2.0;
            continue;
        };
        let promised = -(here.gradient.dot(&step) + 0.5 * step.dot(&(&curvature * &step)));
        let undamped = damping <= FIRST_DAMPING * diagonal(here);
        if step.amax() == 0.0 || promised.abs() < settings.cost_tolerance {
            return true;
        }
        let next = Point::new(forward, &here.tensions + &step);
        let gained = next.as_ref().map_or(f64::NEG_INFINITY, |p| here.cost - p.cost);
        match next {
            Some(next) if promised > 0.0 && gained > ACCEPTED * promised => {
                update_secant(&mut secant, here, &next, &step);
                *here = next;
                if undamped && step.amax() < settings.tension_tolerance {
                    return true;
                }
                // Nielsen (1999): damping follows how well the decrease was foretold, without jumps.
                damping *= (1.0 - (2.0 * gained / promised - 1.0).powi(3)).clamp(0.1, 2.0);
                growth = 2.0;
            }
            _ => {
                damping *= growth;
                growth *= 2.0;
            }
        }
    }
    false
}

/// The damped step on the free tensions, cut at the bounds; `None` where the damped second derivative is not positive
/// definite.
fn bounded_step(here: &Point, curvature: &DMatrix<f64>, damping: f64, bound: f64) -> Option<DVector<f64>> {
    let n = here.tensions.len();
    let mut free: Vec<usize> = (0..n).filter(|&i| here.is_free(i, bound)).collect();
    let mut step = DVector::zeros(n);
    // Tensions that the step would carry over a bound are put on it, and the others solved again with them there.
    while !free.is_empty() {
        let mut matrix = curvature.select_rows(&free).select_columns(&free);
        for i in 0..free.len() {
            matrix[(i, i)] += damping;
        }
        let pull = curvature * &step + &here.gradient;
        let solved = matrix.cholesky()?.solve(&-pull.select_rows(&free));
        let mut cut = false;
        for (k, &i) in free.iter().enumerate() {
            step[i] = (here.tensions[i] + solved[k]).clamp(0.0, bound) - here.tensions[i];
            cut |= step[i] != solved[k]
                && (here.tensions[i] + solved[k] < 0.0 || here.tensions[i] + solved[k] > bound);
        }
        if !cut {
            break;
        }
        let inside = |i: usize, s: f64| here.tensions[i] + s >= 0.0 && here.tensions[i] + s <= bound;
        let still: Vec<usize> =
            free.iter().zip(solved.iter()).filter(|(i, s)| inside(**i, **s)).map(|(i, _)| *i).collect();
        still.iter().for_each(|&i| step[i] = 0.0);
        free = still;
    }
    Some(step)
}

/// Dennis, Gay and Welsch's symmetric rank-two update of `S`, sized so that it forgets what no longer holds.
fn update_secant(secant: &mut DMatrix<f64>, here: &Point, next: &Point, step: &DVector<f64>) {
    let change = (&next.jacobian - &here.jacobian).tr_mul(&next.residuals);
    let y = (&next.gradient - &here.gradient) * 0.5;
    let along = y.dot(step);
    if along.abs() <= 1e-12 * y.norm() * step.norm() {
        return;
    }
    let held = step.dot(&(&*secant * step));
    if held != 0.0 {
        *secant *= (step.dot(&change) / held).abs().min(1.0);
    }
    let missing = change - &*secant * step;
    *secant += (&missing * y.transpose() + &y * missing.transpose()) / along
        - &y * y.transpose() * (missing.dot(step) / (along * along));
}
