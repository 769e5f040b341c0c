//! One start of argmin's Nelder-Mead, with what it lacks: bounds, a stop on the spread of the tensions, and a fresh simplex
//! where the old one degenerated.

use std::cell::RefCell;

use argmin::core::{
    CostFunction, Error, Executor, IterState, KV, Problem, Solver, State, TerminationReason,
    TerminationStatus,
};
use argmin::solver::neldermead::NelderMead;
use serde::Serialize;

use super::objective::Forward;
use super::{FitError, Settings};
use crate::muscle::PerMuscle;

/// Side of the first simplex, N.
const FIRST_SIDE: f64 = 5.0;
/// Side of the simplex with which the search is begun anew around its answer, N.
const FRESH_SIDE: f64 = 0.1;
/// Most fresh simplices.
const MOST_RESTARTS: usize = 5;
/// A fresh simplex that moves the answer by less than this confirms it, N.
const CONFIRMED: f64 = 1e-3;
/// Costs that differ by less than this part belong to the same equilibrium.
pub(super) const SAME_COST: f64 = 1e-6;
/// Part of the upper bound within which starts are spread.
pub(super) const START_RANGE: f64 = 0.3;

/// Where one start ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Start {
    /// Tensions of the active muscles, N.
    pub tensions: Vec<f64>,
    /// Objective there.
    pub cost: f64,
    /// Equilibria solved.
    pub evaluations: usize,
    /// Candidates for which no equilibrium was found.
    #[serde(skip)]
    pub failures: usize,
    /// Factorisations of a stiffness.
    pub factorisations: usize,
    /// Iterations, over all simplices where there are any.
    pub iterations: u64,
    /// Fresh simplices after the first.
    pub restarts: usize,
    /// Whether the last simplex shrank to the tolerance and confirmed the one before; of Gauss-Newton, whether its steps did.
    pub converged: bool,
    /// Lengths of the eight muscles at the answer as the search found it, m; `None` where no candidate had an equilibrium.
    #[serde(skip)]
    pub lengths: Option<PerMuscle<f64>>,
}

impl Start {
    /// A search that stands at its starting point and has found nothing yet.
    pub(super) fn at(tensions: Vec<f64>, cost: f64) -> Self {
        Self {
            tensions,
            cost,
            evaluations: 0,
            failures: 0,
            factorisations: 0,
            iterations: 0,
            restarts: 0,
            converged: false,
            lengths: None,
        }
    }
}

type NmState = IterState<Vec<f64>, (), (), (), (), f64>;

/// The objective as argmin sees it: unbounded parameters, folded into the bounds.
struct Folded<'a, 'b> {
    forward: &'b RefCell<Forward<'a>>,
    upper_bound: f64,
    /// Corners of the first simplex, solved beforehand in parallel, with their costs.
    solved: Vec<(Vec<f64>, f64)>,
}

impl CostFunction for Folded<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, parameters: &Vec<f64>) -> Result<f64, Error> {
        if let Some((_, cost)) = self.solved.iter().find(|(corner, _)| corner == parameters) {
            return Ok(*cost);
        }
        let tensions = fold(parameters, self.upper_bound);
        Ok(self.forward.borrow_mut().evaluate(&tensions).cost)
    }
}

/// Reflects every parameter at 0 and at the upper bound until it lies between them. Unlike a sine or a logistic curve it keeps
/// lengths, so a simplex does not collapse at a bound.
fn fold(parameters: &[f64], upper_bound: f64) -> Vec<f64> {
    parameters
        .iter()
        .map(|p| {
            let within = p.rem_euclid(2.0 * upper_bound);
            if within > upper_bound { 2.0 * upper_bound - within } else { within }
        })
        .collect()
}

/// Nelder-Mead that also stops when the best candidates lie close together.
struct Search<'a, 'b> {
    inner: NelderMead<Vec<f64>, f64>,
    forward: &'b RefCell<Forward<'a>>,
    tension_tolerance: f64,
}

impl<'a, 'b> Solver<Folded<'a, 'b>, NmState> for Search<'a, 'b> {
    fn name(&self) -> &str {
        "Nelder-Mead method with a test on the spread of the parameters"
    }

    fn init(
        &mut self,
        problem: &mut Problem<Folded<'a, 'b>>,
        state: NmState,
    ) -> Result<(NmState, Option<KV>), Error> {
        self.inner.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<Folded<'a, 'b>>,
        state: NmState,
    ) -> Result<(NmState, Option<KV>), Error> {
        self.inner.next_iter(problem, state)
    }

    fn terminate(&mut self, state: &NmState) -> TerminationStatus {
        if self.forward.borrow().spread() < self.tension_tolerance {
            return TerminationStatus::Terminated(TerminationReason::SolverConverged);
        }
        Solver::<Folded<'a, 'b>, NmState>::terminate(&mut self.inner, state)
    }
}

/// Searches from start number `number` until a fresh simplex confirms the answer.
///
/// # Errors
/// [`FitError::Search`] should argmin refuse a setting.
pub(super) fn run(forward: Forward<'_>, number: usize) -> Result<Start, FitError> {
    let settings = forward.settings;
    let dimension = forward.target.active.len();
    let forward = RefCell::new(forward);
    let mut corner = starting_point(number, dimension, START_RANGE * settings.upper_bound);
    let mut side = FIRST_SIDE.min(0.25 * settings.upper_bound);
    let mut start = Start::at(corner.clone(), f64::INFINITY);
    for restarts in 0..=MOST_RESTARTS {
        let (found, cost, iterations, stopped) = one_simplex(&forward, settings, &corner, side)?;
        start.iterations += iterations;
        // A candidate that was reached from a neighbour may lie on another branch of equilibria than the one that
        // leads to it from rest. Then the search goes on from rest only, and what it had found does not count.
        let from_rest = forward.borrow_mut().evaluate_from_rest(&found);
        if (from_rest.cost - cost).abs() > SAME_COST * cost.abs().max(SAME_COST) {
            forward.borrow_mut().forget_neighbours();
            start.cost = f64::INFINITY;
            corner = found;
            side = FIRST_SIDE.min(0.25 * settings.upper_bound);
            continue;
        }
        let moved = found.iter().zip(&start.tensions).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        start.restarts = restarts;
        if cost < start.cost {
            start.tensions = found;
            start.cost = cost;
            start.lengths = from_rest.lengths;
        }
        start.converged = stopped && restarts > 0 && moved < CONFIRMED && from_rest.lengths.is_some();
        if start.converged {
            break;
        }
        corner = start.tensions.clone();
        side = FRESH_SIDE.min(0.1 * settings.upper_bound);
        forward.borrow_mut().begin_simplex();
    }
    start.evaluations = forward.borrow().evaluations();
    start.failures = forward.borrow().failures();
    start.factorisations = forward.borrow().factorisations();
    Ok(start)
}

/// One run of argmin: tensions, cost, iterations, and whether it stopped by itself.
fn one_simplex(
    forward: &RefCell<Forward<'_>>,
    settings: &Settings,
    corner: &[f64],
    side: f64,
) -> Result<(Vec<f64>, f64, u64, bool), FitError> {
    let failed = |e: Error| FitError::Search(e.to_string());
    let mut simplex = vec![corner.to_vec()];
    for i in 0..corner.len() {
        let mut vertex = corner.to_vec();
        // Away from the upper bound, so that folding does not lay two corners on each other.
        vertex[i] += if vertex[i] + side <= settings.upper_bound { side } else { -side };
        simplex.push(vertex);
    }
    // Every corner lies within the bounds, so it needs no folding.
    let costs = forward.borrow_mut().evaluate_in_parallel(&simplex);
    let solved = simplex.iter().cloned().zip(costs).collect();
    let inner = NelderMead::new(simplex).with_sd_tolerance(settings.cost_tolerance).map_err(failed)?;
    let problem = Folded { forward, upper_bound: settings.upper_bound, solved };
    let solver = Search { inner, forward, tension_tolerance: settings.tension_tolerance };
    let result = Executor::new(problem, solver)
        .configure(|state| state.max_iters(settings.max_iterations))
        .timer(false)
        .run()
        .map_err(failed)?;
    let state = result.state;
    let best = state.get_best_param().map_or_else(|| corner.to_vec(), Vec::clone);
    let stopped = state.get_termination_reason() == Some(&TerminationReason::SolverConverged);
    Ok((fold(&best, settings.upper_bound), state.get_best_cost(), state.get_iter(), stopped))
}

/// Start number `number`: a point of Halton's sequence, which fills the box evenly and is the same everywhere.
pub(super) fn starting_point(number: usize, dimension: usize, range: f64) -> Vec<f64> {
    const PRIMES: [usize; crate::muscle::COUNT] = [2, 3, 5, 7, 11, 13, 17, 19];
    (0..dimension).map(|d| range * radical_inverse(number + 1, PRIMES[d % PRIMES.len()])).collect()
}

fn radical_inverse(mut n: usize, base: usize) -> f64 {
    let (mut value, mut place) = (0.0, 1.0 / base as f64);
    while n > 0 {
        value += (n % base) as f64 * place;
        n /= base;
        place /= base as f64;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_keeps_the_bounds_and_keeps_lengths() {
        assert_eq!(fold(&[-1.0, 0.0, 3.0, 10.0, 12.0, 21.0], 10.0), [1.0, 0.0, 3.0, 10.0, 8.0, 1.0]);
    }

    #[test]
    fn starts_are_halton_points_within_the_range() {
        assert_eq!(starting_point(0, 3, 30.0), [15.0, 10.0, 6.0]);
        assert_eq!(starting_point(1, 2, 36.0), [9.0, 24.0]);
        assert!((0..100).all(|n| starting_point(n, 8, 1.0).iter().all(|t| (0.0..1.0).contains(t))));
    }
}
