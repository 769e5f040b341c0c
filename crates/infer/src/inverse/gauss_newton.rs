//! One start of a damped Gauss-Newton method with bounds, which uses the exact sensitivities of the equilibrium.
//!
//! With residuals `r`, their Jacobian `J` and effort `c` for each unit of tension, the cost `r·r + c sum F` has the gradient `2 Jᵀr + c`
//! and the Hessian `2 (JᵀJ + S)`, `S = sum r_i d²r_i/dF²`. Where the target is met, `S` vanishes (Levenberg 1944, Marquardt 1963). Where
//! ratios leave a direction undetermined, only `S` determines the point of the curve with the smallest sum of tensions; it is approximated
//! by the secant of Dennis, Gay and Welsch (1981, eqs. 2.8-2.10). Unknowns that the gradient pushes against a bound stay on it (Bertsekas
//! 1982).

use nalgebra::{DMatrix, DVector};

use super::forward::{FAILED, Forward, Linearised};
use super::problem::Unknown;
use super::start::{Start, same_cost_by_newton};
use crate::least_squares::{self, Descent, Rule, TrialStep};

/// Damping of the first step, as a part of the largest diagonal entry of `2 JᵀJ`.
const FIRST_DAMPING: f64 = 1e-3;
/// Largest damping, as a part of that entry; with more, a step is lost in rounding.
const MOST_DAMPING: f64 = 1e12;

struct EvaluatedPoint {
    x: DVector<f64>,
    linear: Linearised,
    gradient: DVector<f64>,
    cost: f64,
    /// An approximation of `S`.
    secant: DMatrix<f64>,
}

impl EvaluatedPoint {
    fn new<const D: usize>(forward: &mut Forward<'_, D>, x: DVector<f64>) -> Option<Self> {
        let linear = forward.linearise(x.as_slice())?;
        let effort = forward.effort;
        let mut gradient = linear.jacobian.tr_mul(&linear.residuals) * 2.0;
        let mut tensions = 0.0;
        for (i, _) in forward.problem.unknowns.iter().enumerate().filter(|(_, u)| u.is_tension()) {
            gradient[i] += effort;
            tensions += x[i];
        }
        let cost = linear.residuals.norm_squared() + effort * tensions;
        let secant = DMatrix::zeros(x.len(), x.len());
        cost.is_finite().then_some(Self { x, linear, gradient, cost, secant })
    }

    /// Largest diagonal entry of `2 JᵀJ`.
    fn largest_curvature(&self) -> f64 {
        2.0 * self.linear.jacobian.column_iter().map(|c| c.norm_squared()).fold(1e-12, f64::max)
    }

    /// Whether the cost would decrease if value `i` left its bound.
    fn is_free(&self, i: usize, unknown: &Unknown) -> bool {
        let (t, g) = (self.x[i], self.gradient[i]);
        (t > unknown.lower || g < 0.0) && (t < unknown.upper || g > 0.0)
    }
}

pub(super) fn run<const D: usize>(forward: &mut Forward<'_, D>, number: usize) -> Start {
    let first = forward.start(number);
    // A start without an equilibrium is replaced by the values nearest to zero within the bounds.
    let rest = forward.problem.unknowns.iter().map(|u| 0f64.clamp(u.lower, u.upper)).collect::<Vec<_>>();
    let mut start = Start::new(first, FAILED);
    let found = search(forward, DVector::from_column_slice(&start.x), &mut start.iterations)
        .or_else(|| search(forward, DVector::from_vec(rest), &mut start.iterations));
    if let Some(mut found) = found {
        (start.solved, start.cost) = forward.solved_by_newton(found.here.x.as_slice());
        // As in Nelder-Mead, the search begins again with all candidates from rest if Newton's method from rest gives another cost.
        if !same_cost_by_newton(found.here.cost, start.cost) {
            forward.forget_neighbours();
            match search(forward, found.here.x.clone(), &mut start.iterations) {
                Some(again) => found = again,
                None => found.converged = false,
            }
            (start.solved, start.cost) = forward.solved_by_newton(found.here.x.as_slice());
        }
        start.x = found.here.x.iter().copied().collect();
        start.converged = found.converged;
    }
    start.counts = forward.counts;
    start
}

/// Searches from nearly right values within the bounds. Returns the answer, at which `forward` then is, its residuals, and whether the
/// search converged; `None` if there is no equilibrium at the beginning or at the end.
pub(super) fn refit<const D: usize>(
    forward: &mut Forward<'_, D>,
    from: &[f64],
) -> Option<(Vec<f64>, DVector<f64>, bool)> {
    let found = search(forward, DVector::from_column_slice(from), &mut 0)?;
    let x: Vec<f64> = found.here.x.iter().copied().collect();
    let residuals = forward.residuals(&x)?;
    Some((x, residuals, found.converged))
}

/// Minimises from `x`, and adds the steps to `iterations`; `None` if there is no equilibrium at `x`.
fn search<const D: usize>(
    forward: &mut Forward<'_, D>,
    x: DVector<f64>,
    iterations: &mut u64,
) -> Option<Descent<EvaluatedPoint>> {
    let here = EvaluatedPoint::new(forward, x)?;
    let unknowns = &forward.problem.unknowns;
    let first = FIRST_DAMPING * here.largest_curvature();
    let rule = Rule {
        max_steps: forward.settings.max_iterations.saturating_sub(*iterations) as usize,
        decrease_tolerance: forward.settings.cost_tolerance,
        first_damping: first,
        least_damping: 0.0,
        most_damping: MOST_DAMPING / FIRST_DAMPING * first,
        damping_increase: (2.0, 2.0),
        ..Rule::UNDAMPED
    };
    let tolerance = forward.settings.tension_tolerance;
    let trial_step = if forward.settings.best_steps { best_step } else { bounded_step };
    let step = |here: &EvaluatedPoint, damping: f64| {
        let curvature = (here.linear.jacobian.tr_mul(&here.linear.jacobian) + &here.secant) * 2.0;
        let by = trial_step(here, &curvature, damping, unknowns)?;
        let predicted_decrease = -(here.gradient.dot(&by) + 0.5 * by.dot(&(&curvature * &by)));
        let size = by.amax();
        let undamped = damping <= FIRST_DAMPING * here.largest_curvature();
        let is_last = undamped && size < tolerance;
        Some(TrialStep { by, size, predicted_decrease: Some(predicted_decrease), is_last })
    };
    let moved = |here: &EvaluatedPoint, by: &DVector<f64>| {
        let mut next = EvaluatedPoint::new(forward, &here.x + by)?;
        next.secant = updated_secant(here, &next, by);
        Some(next)
    };
    let found = least_squares::descend(here, &rule, |p| p.cost, step, moved);
    *iterations += found.steps as u64;
    Some(found)
}

/// The damped step in the free unknowns, cut at the bounds; `None` if the damped Hessian is not positive definite. [`best_step`] decreases
/// the model more, but in a nearly incompressible body it leads to other minima than those of the published numbers.
fn bounded_step(
    here: &EvaluatedPoint,
    curvature: &DMatrix<f64>,
    damping: f64,
    unknowns: &[Unknown],
) -> Option<DVector<f64>> {
    let n = here.x.len();
    let mut free: Vec<usize> = (0..n).filter(|&i| here.is_free(i, &unknowns[i])).collect();
    let mut step = DVector::zeros(n);
    // Unknowns that the step would move beyond a bound are set to it, and the others are solved again.
    while !free.is_empty() {
        let mut matrix = curvature.select_rows(&free).select_columns(&free);
        for i in 0..free.len() {
            matrix[(i, i)] += damping;
        }
        let pull = curvature * &step + &here.gradient;
        let solved = matrix.cholesky()?.solve(&-pull.select_rows(&free));
        let mut inside = Vec::new();
        for (&i, by) in free.iter().zip(solved.iter()) {
            let (lower, upper) = (unknowns[i].lower, unknowns[i].upper);
            let x = here.x[i] + by;
            step[i] = x.clamp(lower, upper) - here.x[i];
            inside.extend((lower..=upper).contains(&x).then_some(i));
        }
        if inside.len() == free.len() {
            break;
        }
        inside.iter().for_each(|&i| step[i] = 0.0);
        free = inside;
    }
    Some(step)
}

/// The minimum of the damped model within the bounds by an active-set method (Nocedal and Wright 2006, 16.5) that begins at zero; `None` if
/// the damped Hessian is not positive definite.
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
    // Every change of the active set decreases the model; ten unknowns need fewer changes than this limit.
    for _ in 0..10 * n {
        let slope = &damped * &step + &here.gradient;
        let matrix = damped.select_rows(&free).select_columns(&free);
        let direction = matrix.cholesky()?.solve(&-slope.select_rows(&free));
        // Part of the direction up to the first bound, and the unknown that reaches it.
        let first = free.iter().enumerate().map(|(k, &i)| {
            let room = if direction[k] < 0.0 { lower(i) - step[i] } else { upper(i) - step[i] };
            (if direction[k] == 0.0 { f64::INFINITY } else { room / direction[k] }, k)
        });
        let first = first.min_by(|a, b| a.0.total_cmp(&b.0));
        let (part, blocked) =
            first.filter(|(part, _)| *part < 1.0).map_or((1.0, None), |(p, k)| (p, Some(k)));
        free.iter()
            .zip(direction.iter())
            .for_each(|(&i, w)| step[i] = (step[i] + part * w).clamp(lower(i), upper(i)));
        if let Some(k) = blocked {
            let i = free.remove(k);
            step[i] = if direction[k] < 0.0 { lower(i) } else { upper(i) };
            continue;
        }
        // At the minimum on the active set, the unknown with the most negative multiplier leaves its bound.
        let slope = &damped * &step + &here.gradient;
        let multiplier = |i: usize| if step[i] <= lower(i) { slope[i] } else { -slope[i] };
        let held = (0..n).filter(|i| !free.contains(i));
        match held.min_by(|&a, &b| multiplier(a).total_cmp(&multiplier(b))).filter(|&i| multiplier(i) < 0.0) {
            Some(i) => free.push(i),
            None => break,
        }
    }
    Some(step)
}

/// Symmetric rank-two update of `S` by Dennis, Gay and Welsch, with sizing, by which old information decays.
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
