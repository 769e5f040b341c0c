//! One start of a damped Gauss-Newton method with bounds, which uses the exact sensitivities of the equilibrium.
//!
//! With `r` the residuals, `J` their derivative and `c` the effort, the cost `r·r + c sum F` has the gradient `2 Jᵀr + c` and the second
//! derivative `2 (JᵀJ + S)`, `S = sum r_i d²r_i/dF²`. If the target is met, `S` vanishes and the method is that of Levenberg (1944) and
//! Marquardt (1963). If ratios leave a direction undetermined, only `S` determines where along the curve the sum of the tensions is
//! smallest; it is then approximated from the changes of `J` by the secant of Dennis, Gay and Welsch (1981, eqs. 2.8-2.10). Tensions that
//! the gradient pushes against a bound stay on it (Bertsekas 1982).

use nalgebra::{DMatrix, DVector};

use super::FitSettings;
use super::forward::{FAILED, Forward, Linearised};
use super::problem::Unknown;
use super::start::{Start, same_cost_by_newton};
use crate::least_squares::{self, Rule, TrialStep};

/// Damping of the first step, as a part of the largest diagonal entry of the second derivative.
const FIRST_DAMPING: f64 = 1e-3;
/// Largest damping, as a part of the same entry: beyond it a step is lost in rounding.
const MOST_DAMPING: f64 = 1e12;

/// A candidate with its cost and derivatives.
#[derive(Clone)]
struct EvaluatedPoint {
    x: DVector<f64>,
    linear: Linearised,
    gradient: DVector<f64>,
    cost: f64,
    /// An approximation of `S`.
    secant: DMatrix<f64>,
}

impl EvaluatedPoint {
    fn new<const D: usize>(problem: &mut Forward<'_, D>, x: DVector<f64>) -> Option<Self> {
        let linear = problem.linearise(x.as_slice())?;
        let effort = problem.effort;
        let mut gradient = linear.jacobian.tr_mul(&linear.residuals) * 2.0;
        let mut tensions = 0.0;
        for (i, _) in problem.inverse.unknowns.iter().enumerate().filter(|(_, u)| u.is_tension()) {
            gradient[i] += effort;
            tensions += x[i];
        }
        let cost = linear.residuals.norm_squared() + effort * tensions;
        let secant = DMatrix::zeros(x.len(), x.len());
        cost.is_finite().then_some(Self { x, linear, gradient, cost, secant })
    }

    /// Largest diagonal entry of the second derivative.
    fn diagonal(&self) -> f64 {
        2.0 * self.linear.jacobian.column_iter().map(|c| c.norm_squared()).fold(1e-12, f64::max)
    }

    /// Whether the cost would decrease if value `i` left its bound.
    fn is_free(&self, i: usize, unknown: &Unknown) -> bool {
        let (t, g) = (self.x[i], self.gradient[i]);
        (t > unknown.lower || g < 0.0) && (t < unknown.upper || g > 0.0)
    }
}

/// Searches from start number `number`. The result has the structure of a Nelder-Mead start; there are no restarts.
pub(super) fn run<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    number: usize,
) -> Start {
    let first = problem.start(number);
    // A start without an equilibrium is replaced by the rest shape, which always has one.
    let rest = problem.inverse.unknowns.iter().map(|u| 0f64.clamp(u.lower, u.upper)).collect::<Vec<_>>();
    let mut start = Start::at(first, FAILED);
    let point = EvaluatedPoint::new(problem, DVector::from_column_slice(&start.x))
        .or_else(|| EvaluatedPoint::new(problem, DVector::from_vec(rest)));
    if let Some(mut here) = point {
        start.converged = descend(problem, settings, &mut here, &mut start.iterations);
        let (mut is_solved, mut cost) = problem.solved_by_newton(here.x.as_slice());
        // As in Nelder-Mead: a shape other than that of Newton's method from rest does not count.
        if !same_cost_by_newton(here.cost, cost) {
            problem.forget_neighbours();
            start.converged = match EvaluatedPoint::new(problem, here.x.clone()) {
                Some(again) => {
                    here = again;
                    descend(problem, settings, &mut here, &mut start.iterations)
                }
                None => false,
            };
            (is_solved, cost) = problem.solved_by_newton(here.x.as_slice());
        }
        start.x = here.x.iter().copied().collect();
        start.cost = cost;
        start.solved = is_solved;
    }
    start.counts = problem.counts;
    start
}

/// Searches from values that are nearly right, within the bounds; afterwards the problem is at the answer,
/// whose residuals are returned too, and whether the search converged. `None` if there is no equilibrium at the beginning or at the end.
pub(super) fn refit<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    from: &[f64],
) -> Option<(Vec<f64>, DVector<f64>, bool)> {
    let mut here = EvaluatedPoint::new(problem, DVector::from_column_slice(from))?;
    let converged = descend(problem, settings, &mut here, &mut 0);
    let x: Vec<f64> = here.x.iter().copied().collect();
    let residuals = problem.residuals(&x)?;
    Some((x, residuals, converged))
}

/// Minimises from `here`, and returns whether it converged.
fn descend<const D: usize>(
    problem: &mut Forward<'_, D>,
    settings: &FitSettings,
    here: &mut EvaluatedPoint,
    iterations: &mut u64,
) -> bool {
    let unknowns = &problem.inverse.unknowns;
    let first = FIRST_DAMPING * here.diagonal();
    let rule = Rule {
        steps: settings.max_iterations.saturating_sub(*iterations) as usize,
        promised: settings.cost_tolerance,
        first,
        least: 0.0,
        most: MOST_DAMPING / FIRST_DAMPING * first,
        more: (2.0, 2.0),
        ..Rule::UNDAMPED
    };
    let stepped = if settings.best_steps { best_step } else { bounded_step };
    let step = |here: &EvaluatedPoint, damping: f64| {
        let curvature = (here.linear.jacobian.tr_mul(&here.linear.jacobian) + &here.secant) * 2.0;
        let by = stepped(here, &curvature, damping, unknowns)?;
        let promised = -(here.gradient.dot(&by) + 0.5 * by.dot(&(&curvature * &by)));
        let size = by.amax();
        let undamped = damping <= FIRST_DAMPING * here.diagonal();
        let is_last = undamped && size < settings.tension_tolerance;
        Some(TrialStep { by, size, promised: Some(promised), is_last })
    };
    let moved = |here: &EvaluatedPoint, by: &DVector<f64>| {
        let mut next = EvaluatedPoint::new(problem, &here.x + by)?;
        next.secant = updated_secant(here, &next, by);
        Some(next)
    };
    let found = least_squares::descend(here.clone(), &rule, |p| p.cost, step, moved);
    *here = found.here;
    *iterations += found.steps as u64;
    found.converged
}

/// The damped step on the free values, cut at the bounds; `None` if the damped second derivative is not positive definite. [`best_step`]
/// decreases the model more, but in a nearly incompressible body it leads to other minima than those of the published numbers.
fn bounded_step(
    here: &EvaluatedPoint,
    curvature: &DMatrix<f64>,
    damping: f64,
    unknowns: &[Unknown],
) -> Option<DVector<f64>> {
    let n = here.x.len();
    let mut free: Vec<usize> = (0..n).filter(|&i| here.is_free(i, &unknowns[i])).collect();
    let mut step = DVector::zeros(n);
    // Values that the step would move beyond a bound are set to it, and the others are solved again.
    while !free.is_empty() {
        let mut matrix = curvature.select_rows(&free).select_columns(&free);
        for i in 0..free.len() {
            matrix[(i, i)] += damping;
        }
        let pull = curvature * &step + &here.gradient;
        let solved = matrix.cholesky()?.solve(&-pull.select_rows(&free));
        let mut cut = false;
        for (k, &i) in free.iter().enumerate() {
            let (lower, upper) = (unknowns[i].lower, unknowns[i].upper);
            step[i] = (here.x[i] + solved[k]).clamp(lower, upper) - here.x[i];
            cut |= step[i] != solved[k] && (here.x[i] + solved[k] < lower || here.x[i] + solved[k] > upper);
        }
        if !cut {
            break;
        }
        let inside =
            |i: usize, s: f64| here.x[i] + s >= unknowns[i].lower && here.x[i] + s <= unknowns[i].upper;
        let still: Vec<usize> =
            free.iter().zip(solved.iter()).filter(|(i, s)| inside(**i, **s)).map(|(i, _)| *i).collect();
        still.iter().for_each(|&i| step[i] = 0.0);
        free = still;
    }
    Some(step)
}

/// The minimum of the damped model within the bounds, by the method of active sets (Nocedal and Wright 2006, 16.5) from no step at all;
/// `None` if the damped second derivative is not positive definite.
fn best_step(
    here: &EvaluatedPoint,
    curvature: &DMatrix<f64>,
    damping: f64,
    unknowns: &[Unknown],
) -> Option<DVector<f64>> {
    let n = here.x.len();
    let damped = curvature + DMatrix::from_diagonal_element(n, n, damping);
    let lower = |i: usize| unknowns[i].lower - here.x[i];
    let upper = |i: usize| unknowns[i].upper - here.x[i];
    let mut step = DVector::<f64>::zeros(n);
    let mut free: Vec<usize> = (0..n).filter(|&i| here.is_free(i, &unknowns[i])).collect();
    // Every change of the set lowers the model, so that this many are more than enough for ten unknowns.
    for _ in 0..10 * n {
        let slope = &damped * &step + &here.gradient;
        let matrix = damped.select_rows(&free).select_columns(&free);
        let way = matrix.cholesky()?.solve(&-slope.select_rows(&free));
        // How far the way is free, and the value that stops it.
        let first = free.iter().enumerate().map(|(k, &i)| {
            let room = if way[k] < 0.0 { lower(i) - step[i] } else { upper(i) - step[i] };
            (if way[k] == 0.0 { f64::INFINITY } else { room / way[k] }, k)
        });
        let first = first.min_by(|a, b| a.0.total_cmp(&b.0));
        let (part, blocked) =
            first.filter(|(part, _)| *part < 1.0).map_or((1.0, None), |(p, k)| (p, Some(k)));
        free.iter()
            .zip(way.iter())
            .for_each(|(&i, w)| step[i] = (step[i] + part * w).clamp(lower(i), upper(i)));
        if let Some(k) = blocked {
            let i = free.remove(k);
            step[i] = if way[k] < 0.0 { lower(i) } else { upper(i) };
            continue;
        }
        // At the minimum of the set: a bound that the model pushes away from is left.
        let slope = &damped * &step + &here.gradient;
        let push = |i: usize| if step[i] <= lower(i) { slope[i] } else { -slope[i] };
        let held = (0..n).filter(|i| !free.contains(i));
        match held.min_by(|&a, &b| push(a).total_cmp(&push(b))).filter(|&i| push(i) < 0.0) {
            Some(i) => free.push(i),
            None => break,
        }
    }
    Some(step)
}

/// The symmetric rank-two update of `S` by Dennis, Gay and Welsch, with sizing, so that old information decays.
fn updated_secant(here: &EvaluatedPoint, next: &EvaluatedPoint, step: &DVector<f64>) -> DMatrix<f64> {
    let mut secant = here.secant.clone();
    let change = (&next.linear.jacobian - &here.linear.jacobian).tr_mul(&next.linear.residuals);
    let y = (&next.gradient - &here.gradient) * 0.5;
    let along = y.dot(step);
    if along.abs() <= 1e-12 * y.norm() * step.norm() {
        return secant;
    }
    let held = step.dot(&(&secant * step));
    if held != 0.0 {
        secant *= (step.dot(&change) / held).abs().min(1.0);
    }
    let missing = change - &secant * step;
    secant += (&missing * y.transpose() + &y * missing.transpose()) / along
        - &y * y.transpose() * (missing.dot(step) / (along * along));
    secant
}
