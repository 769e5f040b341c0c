//! One start of argmin's Nelder-Mead with bounds, a stop on the spread of the candidates, and a new simplex around the answer.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, IterState, Problem, Solver, State};
use argmin::solver::neldermead::NelderMead;

use super::FitError;
use super::forward::Forward;
use super::problem::Unknown;
use super::start::{FIRST_SIDE, Start, same_cost_by_newton};

/// Side of the new simplex around the answer for a restart, N.
const FRESH_SIDE: f64 = 0.1;
const MOST_RESTARTS: usize = 5;
/// A restart that moves no unknown by this much confirms the answer, N.
const CONFIRMED: f64 = 1e-3;
type NmState = IterState<Vec<f64>, (), (), (), (), f64>;

/// The cost function for argmin: unbounded parameters, reflected into the bounds.
struct ReflectedCost<'a, 'i, const D: usize> {
    forward: RefCell<&'a mut Forward<'i, D>>,
    /// Corners of the first simplex and their costs, computed in parallel in advance.
    solved: Vec<(Vec<f64>, f64)>,
}

impl<const D: usize> CostFunction for ReflectedCost<'_, '_, D> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, parameters: &Vec<f64>) -> Result<f64, Error> {
        if let Some((_, cost)) = self.solved.iter().find(|(corner, _)| corner == parameters) {
            return Ok(*cost);
        }
        let mut forward = self.forward.borrow_mut();
        let x = reflect(parameters, &forward.problem.unknowns);
        let residuals = forward.residuals(&x);
        Ok(forward.cost(&x, residuals.as_ref()))
    }
}

/// Reflects every parameter at its bounds until it lies between them. Unlike a sine or a logistic function this keeps lengths, so that a
/// simplex does not collapse at a bound.
fn reflect(parameters: &[f64], unknowns: &[Unknown]) -> Vec<f64> {
    let reflected = parameters.iter().zip(unknowns).map(|(p, u)| {
        let range = u.upper - u.lower;
        let within = (p - u.lower).rem_euclid(2.0 * range);
        u.lower + if within > range { 2.0 * range - within } else { within }
    });
    reflected.collect()
}

/// Searches from start number `number` until a restart confirms the answer.
pub(super) fn run<const D: usize>(forward: &mut Forward<'_, D>, number: usize) -> Result<Start, FitError> {
    let mut corner = forward.start(number);
    let mut side = FIRST_SIDE;
    let mut start = Start::new(corner.clone(), f64::INFINITY);
    for restarts in 0..=MOST_RESTARTS {
        let (found, cost, iterations, stopped) = one_simplex(forward, &corner, side)?;
        start.iterations += iterations;
        // If Newton's method from rest gives another cost than a neighbour did, the search begins again with all candidates from rest.
        let (is_solved, by_newton) = forward.solved_by_newton(&found);
        if !same_cost_by_newton(cost, by_newton) {
            forward.forget_neighbours();
            start.cost = f64::INFINITY;
            corner = found;
            side = FIRST_SIDE;
            continue;
        }
        let moved = found.iter().zip(&start.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        start.restarts = restarts;
        if cost < start.cost {
            start.x = found;
            start.cost = cost;
            start.solved = is_solved;
        }
        start.converged = stopped && restarts > 0 && moved < CONFIRMED && is_solved;
        if start.converged {
            break;
        }
        corner = start.x.clone();
        side = FRESH_SIDE;
        forward.known.keep_best();
    }
    start.counts = forward.counts;
    Ok(start)
}

/// Runs argmin until the costs of the simplex or the best candidates are close together, or the iterations are used up: values, cost,
/// iterations, and whether it ended before the limit.
fn one_simplex<const D: usize>(
    forward: &mut Forward<'_, D>,
    corner: &[f64],
    side: f64,
) -> Result<(Vec<f64>, f64, u64, bool), FitError> {
    let failed = |e: Error| FitError::Search(e.to_string());
    let (unknowns, settings) = (&forward.problem.unknowns, forward.settings);
    let mut simplex = vec![corner.to_vec()];
    for (i, unknown) in unknowns.iter().enumerate() {
        let mut vertex = corner.to_vec();
        let largest = if side == FIRST_SIDE { 0.25 } else { 0.1 };
        let side = side.min(largest * (unknown.upper - unknown.lower));
        // Corners are not placed beyond the upper bound, where reflection could make two of them equal.
        vertex[i] += if vertex[i] + side <= unknown.upper { side } else { -side };
        simplex.push(vertex);
    }
    // Every corner lies within the bounds, so it needs no folding.
    let residuals = forward.residuals_of_each(&simplex);
    let costs = simplex.iter().zip(&residuals).map(|(x, r)| forward.cost(x, r.as_ref()));
    let solved = simplex.iter().cloned().zip(costs.collect::<Vec<_>>()).collect();
    let mut solver = NelderMead::new(simplex).with_sd_tolerance(settings.cost_tolerance).map_err(failed)?;
    let mut problem = Problem::new(ReflectedCost { forward: RefCell::new(forward), solved });
    let (mut state, _) = solver.init(&mut problem, NmState::new()).map_err(failed)?;
    state.update();
    let stopped = loop {
        let spread = problem.problem.as_ref().map(|folded| folded.forward.borrow().known.spread());
        if spread.is_some_and(|spread| spread < settings.tension_tolerance)
            || Solver::<ReflectedCost<'_, '_, D>, NmState>::terminate(&mut solver, &state).terminated()
        {
            break true;
        }
        if state.get_iter() >= settings.max_iterations {
            break false;
        }
        (state, _) = solver.next_iter(&mut problem, state).map_err(failed)?;
        state.update();
        state.increment_iter();
    };
    let best = state.get_best_param().map_or_else(|| corner.to_vec(), Vec::clone);
    Ok((reflect(&best, unknowns), state.get_best_cost(), state.get_iter(), stopped))
}
