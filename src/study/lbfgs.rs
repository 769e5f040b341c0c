//! L-BFGS on the energy through argmin: what a general-purpose optimiser makes of the same problem.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, Executor, Gradient, State, TerminationReason};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use nalgebra::SVector;

use crate::effect::Configuration;
use crate::system::System;

/// Pairs of steps and gradient changes that it remembers.
const MEMORY: usize = 10;

/// How a minimisation went.
#[derive(Debug, Clone)]
pub struct Minimised<const D: usize> {
    /// Positions of all nodes, m; those at the start where it failed at once.
    pub positions: Vec<SVector<f64, D>>,
    /// Why it stopped before its tolerance, if it did.
    pub shortfall: Option<String>,
    /// Iterations.
    pub iterations: u64,
    /// Evaluations of energy or gradient, whichever were more.
    pub evaluations: u64,
}

struct Energy<'a, const D: usize> {
    system: &'a System<D>,
    tensions: &'a [f64],
    /// Positions and forces of all nodes.
    space: RefCell<(Vec<SVector<f64, D>>, Vec<SVector<f64, D>>)>,
}

impl<const D: usize> Energy<'_, D> {
    fn place(&self, unknowns: &[f64], positions: &mut [SVector<f64, D>]) {
        for (&node, x) in self.system.pattern().nodes().iter().zip(unknowns.chunks_exact(D)) {
            positions[node].copy_from_slice(x);
        }
    }
}

impl<const D: usize> CostFunction for Energy<'_, D> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, unknowns: &Vec<f64>) -> Result<f64, Error> {
        let (positions, _) = &mut *self.space.borrow_mut();
        self.place(unknowns, positions);
        Ok(self.system.energy(Configuration { positions, tensions: self.tensions }))
    }
}

impl<const D: usize> Gradient for Energy<'_, D> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, unknowns: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let (positions, force) = &mut *self.space.borrow_mut();
        self.place(unknowns, positions);
        self.system.force(Configuration { positions, tensions: self.tensions }, force);
        let nodes = self.system.pattern().nodes();
        Ok(nodes.iter().flat_map(|&n| force[n].iter().map(|f| -f).collect::<Vec<_>>()).collect())
    }
}

/// Minimises the energy of `system` from rest until the norm of the whole residual is below `tolerance`, N.
pub fn minimise<const D: usize>(
    system: &System<D>,
    tensions: &[f64],
    tolerance: f64,
    most_iterations: u64,
) -> Minimised<D> {
    let rest = system.rest().to_vec();
    let start: Vec<f64> =
        system.pattern().nodes().iter().flat_map(|&n| rest[n].iter().copied().collect::<Vec<_>>()).collect();
    let problem =
        Energy { system, tensions, space: RefCell::new((rest.clone(), vec![SVector::zeros(); rest.len()])) };
    let failed = |e: Error| Minimised {
        positions: rest.clone(),
        shortfall: Some(e.to_string()),
        iterations: 0,
        evaluations: 0,
    };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY)
        .with_tolerance_grad(tolerance)
        .and_then(|s| s.with_tolerance_cost(0.0));
    let run = solver.and_then(|solver| {
        Executor::new(problem, solver)
            .configure(|state| state.param(start).max_iters(most_iterations))
            .timer(false)
            .run()
    });
    let result = match run {
        Ok(result) => result,
        Err(error) => return failed(error),
    };
    let state = result.state;
    let count = |name: &str| state.get_func_counts().get(name).copied().unwrap_or(0);
    let evaluations = count("cost_count").max(count("gradient_count"));
    let shortfall = match state.get_termination_reason() {
        Some(TerminationReason::SolverConverged) => None,
        Some(reason) => Some(reason.to_string()),
        None => Some("it did not say why it stopped".into()),
    };
    let mut positions = rest.clone();
    if let Some(best) = state.get_best_param() {
        for (&node, x) in system.pattern().nodes().iter().zip(best.chunks_exact(D)) {
            positions[node].copy_from_slice(x);
        }
    }
    system.place_path_nodes(&mut positions);
    Minimised { positions, shortfall, iterations: state.get_iter(), evaluations }
}
