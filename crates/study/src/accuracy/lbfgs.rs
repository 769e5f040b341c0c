//! L-BFGS on the energy through argmin, as an example of a general-purpose optimiser.

use std::cell::RefCell;

use argmin::core::{CostFunction, Error, Executor, Gradient, State, TerminationReason};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::LBFGS;
use nalgebra::SVector;

use tongue_core::effect::Configuration;
use tongue_core::system::System;

/// Number of pairs of steps and gradient changes in memory.
const MEMORY: usize = 10;

/// Approximate number of connections at a node: the ratio of a node's stiffness to a connection's.
const NEIGHBOURS: f64 = 6.0;
/// Finite energy that replaces an infinite one, J.
const OUT_OF_REACH: f64 = 1e6;

/// Result of a minimisation.
#[derive(Debug, Clone)]
pub struct Minimised<const D: usize> {
    /// Positions of all nodes, m; those at the start if it failed at once.
    pub positions: Vec<SVector<f64, D>>,
    /// Why it stopped before its tolerance, if it did.
    pub shortfall: Option<String>,
    /// Iterations; zero if argmin ended with an error and the number is unknown.
    pub iterations: u64,
    /// The larger of the numbers of evaluations of energy and gradient.
    pub evaluations: u64,
}

/// Maximum number of evaluations. Near rounding the line search may not end, and argmin sets it no limit.
const MOST_EVALUATIONS: u64 = 20_000;

/// Counters of the evaluations, kept here because argmin drops its state when it ends with an error.
struct Space<const D: usize> {
    positions: Vec<SVector<f64, D>>,
    force: Vec<SVector<f64, D>>,
    least: f64,
    best: Vec<SVector<f64, D>>,
    energies: u64,
    gradients: u64,
}

struct Energy<'a, const D: usize> {
    /// Root of a stiffness, √(N/m), by which positions are multiplied: the first step of the search is then
    /// about as long as a force over a stiffness, and does not invert every cell.
    scale: f64,
    system: &'a System<D>,
    tensions: &'a [f64],
    space: &'a RefCell<Space<D>>,
}

impl<const D: usize> Energy<'_, D> {
    fn place(&self, unknowns: &[f64], positions: &mut [SVector<f64, D>]) {
        for (&node, x) in self.system.pattern().nodes().iter().zip(unknowns.chunks_exact(D)) {
            positions[node] = SVector::from_fn(|d, _| x[d] / self.scale);
        }
    }
}

impl<const D: usize> CostFunction for Energy<'_, D> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, unknowns: &Vec<f64>) -> Result<f64, Error> {
        let space = &mut *self.space.borrow_mut();
        space.energies += 1;
        if space.energies > MOST_EVALUATIONS {
            return Err(Error::msg("the line search does not end: the energy changes by rounding only"));
        }
        self.place(unknowns, &mut space.positions);
        let at = Configuration { positions: &space.positions, tensions: self.tensions };
        let energy = self.system.energy(at);
        if energy < space.least {
            space.least = energy;
            space.best.copy_from_slice(&space.positions);
        }
        // Argmin's line search cannot interpolate the infinite energy of an inverted cell.
        Ok(energy.min(OUT_OF_REACH))
    }
}

impl<const D: usize> Gradient for Energy<'_, D> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, unknowns: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let Space { positions, force, gradients, .. } = &mut *self.space.borrow_mut();
        *gradients += 1;
        self.place(unknowns, positions);
        self.system.force(Configuration { positions, tensions: self.tensions }, force);
        let nodes = self.system.pattern().nodes();
        let slope = |f: &f64| if f.is_finite() { -f / self.scale } else { 0.0 };
        Ok(nodes.iter().flat_map(|&n| force[n].iter().map(slope).collect::<Vec<_>>()).collect())
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
    let scale = (NEIGHBOURS * system.coefficients().tissue_stiffness).sqrt();
    let scaled = |n: &usize| rest[*n].iter().map(|x| x * scale).collect::<Vec<_>>();
    let start: Vec<f64> = system.pattern().nodes().iter().flat_map(scaled).collect();
    let space = RefCell::new(Space {
        positions: rest.clone(),
        force: vec![SVector::zeros(); rest.len()],
        least: f64::INFINITY,
        best: rest,
        energies: 0,
        gradients: 0,
    });
    let problem = Energy { scale, system, tensions, space: &space };
    let solver = LBFGS::new(MoreThuenteLineSearch::new(), MEMORY)
        .with_tolerance_grad(tolerance / scale)
        .and_then(|s| s.with_tolerance_cost(0.0));
    let run = solver.and_then(|solver| {
        Executor::new(problem, solver)
            .configure(|state| state.param(start).max_iters(most_iterations))
            .timer(false)
            .run()
    });
    let (shortfall, iterations, last) = match run {
        Ok(result) => {
            let state = result.state;
            let shortfall = match state.get_termination_reason() {
                Some(TerminationReason::SolverConverged) => None,
                Some(reason) => Some(reason.to_string()),
                None => Some("it did not say why it stopped".into()),
            };
            (shortfall, state.get_iter(), state.get_param().cloned())
        }
        Err(error) => (Some(error.to_string()), 0, None),
    };
    let mut space = space.into_inner();
    if let Some(last) = last {
        for (&node, x) in system.pattern().nodes().iter().zip(last.chunks_exact(D)) {
            space.best[node] = SVector::from_fn(|d, _| x[d] / scale);
        }
    }
    system.place_path_nodes(&mut space.best);
    Minimised {
        positions: space.best,
        shortfall,
        iterations,
        evaluations: space.energies.max(space.gradients),
    }
}
