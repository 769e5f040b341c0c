//! From candidate tensions to a cost: total, that is finite whatever the candidate.

use nalgebra::SVector;
use rayon::prelude::*;

use crate::measured::Target;
use crate::muscle::{Muscle, PerMuscle};
use crate::statics::{self, Status, Workspace};
use crate::system::System;

use super::Settings;
use super::known::{BestKnown, Known};

/// Cost of a candidate whose equilibrium was not found: worse than any real misfit, and finite, because argmin's Nelder-Mead
/// panics on errors in its first simplex and gives up on NaN.
pub(super) const FAILED: f64 = 1e6;

/// What a candidate came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Objective: sum of squared residuals of the fitted muscles, and the effort.
    pub cost: f64,
    /// Root mean square residual of the fitted muscles; infinite where no equilibrium was found.
    pub misfit: f64,
    /// Lengths of the eight muscles, m, where an equilibrium was found.
    pub lengths: Option<PerMuscle<f64>>,
}

/// Solves candidates one after another, each from the nearest of the best ones solved before.
#[derive(Debug)]
pub struct Forward<'a> {
    /// The body.
    pub(super) system: &'a System<2>,
    /// What is to be hit.
    pub(super) target: &'a Target,
    /// How.
    pub(super) settings: &'a Settings,
    /// Scratch space; holds the equilibrium of the last candidate.
    pub(super) workspace: Workspace<2>,
    numbers: PerMuscle<usize>,
    rest_lengths: PerMuscle<f64>,
    all_tensions: Vec<f64>,
    effort: f64,
    known: BestKnown,
    /// Whether candidates start from their nearest solved neighbour; else all start from rest.
    from_neighbours: bool,
    evaluations: usize,
    failures: usize,
    factorisations: usize,
}

impl<'a> Forward<'a> {
    /// A solver of candidates for `target`; `numbers` are those of the eight muscles in the mesh.
    pub fn new(
        system: &'a System<2>,
        numbers: PerMuscle<usize>,
        target: &'a Target,
        settings: &'a Settings,
    ) -> Self {
        let rest_lengths = numbers.map(|n| system.length(system.rest(), n));
        let undetermined = target.fitted.len() < target.active.len();
        Self {
            system,
            target,
            settings,
            workspace: Workspace::new(system),
            numbers,
            rest_lengths,
            all_tensions: vec![0.0; system.muscle_count()],
            effort: if undetermined { settings.effort } else { 0.0 },
            known: BestKnown::new(target.active.len()),
            from_neighbours: settings.warm_start,
            evaluations: 0,
            failures: 0,
            factorisations: 0,
        }
    }

    /// Lengths at rest, m.
    pub fn rest_lengths(&self) -> PerMuscle<f64> {
        self.rest_lengths
    }

    /// Price of a newton of tension in the objective, 1/N; zero where the target determines the tensions.
    pub(super) fn effort(&self) -> f64 {
        self.effort
    }

    /// Offers a solved shape (positions of all nodes, m) and its tensions (active muscles, N) as a start for what comes.
    pub(super) fn begin_at(&mut self, active: &[f64], positions: &[SVector<f64, 2>]) {
        self.known = BestKnown::new(active.len());
        self.known.remember(active, f64::INFINITY, positions);
    }

    /// Equilibria solved so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Candidates so far for which no equilibrium was found.
    pub fn failures(&self) -> usize {
        self.failures
    }

    /// Factorisations so far, those for sensitivities included.
    pub fn factorisations(&self) -> usize {
        self.factorisations
    }

    /// Counts a factorisation that was made outside a solve.
    pub(super) fn count_factorisation(&mut self) {
        self.factorisations += 1;
    }

    /// The eight lengths in a shape, m.
    pub fn lengths_of(&self, positions: &[SVector<f64, 2>]) -> PerMuscle<f64> {
        self.numbers.map(|n| self.system.length(positions, n))
    }

    /// Number of a muscle in the mesh.
    pub(super) fn number(&self, muscle: Muscle) -> usize {
        self.numbers[muscle.index()]
    }

    /// Tensions of all muscles of the mesh, N, from those of the active ones.
    pub fn all_tensions(&self, active: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.all_tensions.len()];
        for (m, t) in self.target.active.iter().zip(active) {
            all[self.number(*m)] = *t;
        }
        all
    }

    /// Solves the candidate (tensions of the active muscles, N) and prices it.
    pub fn evaluate(&mut self, active: &[f64]) -> Outcome {
        self.set_tensions(active);
        let warm = self.settings.warm_start && self.from_neighbours;
        let solved = (warm && self.solve_from_nearest(active)) || self.solve_from_rest();
        self.failures += usize::from(!solved);
        let outcome = self.price(active, solved);
        if outcome.lengths.is_some() {
            self.known.remember(active, outcome.cost, self.workspace.positions());
        }
        outcome
    }

    /// As [`Forward::evaluate`], but started from rest whatever is known, and not kept as a start.
    pub fn evaluate_from_rest(&mut self, active: &[f64]) -> Outcome {
        self.set_tensions(active);
        let solved = self.solve_from_rest();
        self.failures += usize::from(!solved);
        self.price(active, solved)
    }

    /// From now on every candidate starts from rest.
    pub(super) fn forget_neighbours(&mut self) {
        self.from_neighbours = false;
        self.known.clear();
    }

    fn set_tensions(&mut self, active: &[f64]) {
        self.evaluations += 1;
        for (m, t) in self.target.active.iter().zip(active) {
            self.all_tensions[self.numbers[m.index()]] = *t;
        }
    }

    /// Outcome of the candidate whose equilibrium is in the workspace, if it was found.
    fn price(&self, active: &[f64], solved: bool) -> Outcome {
        let failed = Outcome { cost: FAILED, misfit: f64::INFINITY, lengths: None };
        if !solved {
            return failed;
        }
        let lengths = self.lengths_of(self.workspace.positions());
        let simulated = self.target.simulated(&lengths, &self.rest_lengths);
        let squares: f64 = self
            .target
            .fitted
            .iter()
            .map(|m| (simulated[m.index()] - self.target.values[m.index()]).powi(2))
            .sum();
        let cost = squares + self.effort * active.iter().sum::<f64>();
        if !cost.is_finite() {
            return failed;
        }
        let misfit = (squares / self.target.fitted.len() as f64).sqrt();
        Outcome { cost, misfit, lengths: Some(lengths) }
    }

    /// Solves several candidates at once, each from rest on its own workspace, keeps them as starts, and gives their costs.
    pub(super) fn evaluate_in_parallel(&mut self, candidates: &[Vec<f64>]) -> Vec<f64> {
        let solved: Vec<(f64, usize, Option<Known>)> = candidates
            .par_iter()
            .map(|active| {
                let mut own = Forward::new(self.system, self.numbers, self.target, self.settings);
                let cost = own.evaluate(active).cost;
                (cost, own.factorisations, own.known.best().cloned())
            })
            .collect();
        self.evaluations += candidates.len();
        self.failures += solved.iter().filter(|(_, _, known)| known.is_none()).count();
        let mut costs = Vec::with_capacity(candidates.len());
        for (cost, factorisations, known) in solved {
            costs.push(cost);
            self.factorisations += factorisations;
            if let Some(known) = known {
                self.known.remember(&known.tensions, cost, &known.positions);
            }
        }
        costs
    }

    /// How far the best candidates (as many as a simplex has corners) lie apart, N.
    pub fn spread(&self) -> f64 {
        self.known.spread()
    }

    /// Forgets all but the best candidate, so that [`Forward::spread`] speaks of a new simplex.
    pub(super) fn begin_simplex(&mut self) {
        self.known.keep_best();
    }

    fn solve_from_nearest(&mut self, active: &[f64]) -> bool {
        let Some(nearest) = self.known.nearest(active) else { return false };
        self.workspace.start_from(&nearest.positions);
        self.solve()
    }

    fn solve_from_rest(&mut self) -> bool {
        self.workspace.start_from_rest(self.system);
        self.solve()
    }

    fn solve(&mut self) -> bool {
        let settings = &self.settings.equilibrium;
        let solution = statics::solve(self.system, &mut self.workspace, &self.all_tensions, settings);
        self.factorisations += solution.factorisations;
        solution.status == Status::Converged
    }
}
