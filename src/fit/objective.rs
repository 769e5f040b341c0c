//! From candidate tensions to a cost: total, that is finite whatever the candidate.

use nalgebra::SVector;

use crate::equilibrium::{self, Status, Workspace};
use crate::muscle::{Muscle, PerMuscle};
use crate::system::System;
use crate::target::Target;

use super::Settings;

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

/// A solved candidate, kept as a start for its neighbours.
#[derive(Debug, Clone)]
struct Known {
    tensions: Vec<f64>,
    cost: f64,
    positions: Vec<SVector<f64, 2>>,
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
    known: Vec<Known>,
    evaluations: usize,
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
            known: Vec::with_capacity(target.active.len() + 1),
            evaluations: 0,
        }
    }

    /// Price of a newton of tension, 1/N; zero where the target determines the tensions.
    pub(super) fn effort(&self) -> f64 {
        self.effort
    }

    /// Lengths at rest, m.
    pub fn rest_lengths(&self) -> PerMuscle<f64> {
        self.rest_lengths
    }

    /// Equilibria solved so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
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
        self.evaluations += 1;
        for (m, t) in self.target.active.iter().zip(active) {
            self.all_tensions[self.numbers[m.index()]] = *t;
        }
        if !self.solve_from_nearest(active) && !self.solve_from_rest() {
            return Outcome { cost: FAILED, misfit: f64::INFINITY, lengths: None };
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
            return Outcome { cost: FAILED, misfit: f64::INFINITY, lengths: None };
        }
        self.remember(active, cost);
        let misfit = (squares / self.target.fitted.len() as f64).sqrt();
        Outcome { cost, misfit, lengths: Some(lengths) }
    }

    /// Largest distance of one of the best candidates (as many as a simplex has corners) from the best one, N; infinite
    /// before there are as many.
    pub fn spread(&self) -> f64 {
        if self.known.len() < self.known.capacity() {
            return f64::INFINITY;
        }
        let best = self.known.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        best.map_or(f64::INFINITY, |best| {
            self.known
                .iter()
                .map(|k| distance_squared(&k.tensions, &best.tensions))
                .fold(0.0, f64::max)
                .sqrt()
        })
    }

    /// Forgets the best candidates, so that [`Forward::spread`] speaks of a new simplex; keeps the best as a start.
    pub(super) fn begin_simplex(&mut self) {
        if let Some(best) =
            (0..self.known.len()).min_by(|&a, &b| self.known[a].cost.total_cmp(&self.known[b].cost))
        {
            self.known.swap(0, best);
            self.known.truncate(1);
        }
    }

    fn solve_from_nearest(&mut self, active: &[f64]) -> bool {
        let nearest = self.known.iter().min_by(|a, b| {
            distance_squared(&a.tensions, active).total_cmp(&distance_squared(&b.tensions, active))
        });
        let Some(nearest) = nearest else { return false };
        self.workspace.start_from(&nearest.positions);
        self.solve()
    }

    fn solve_from_rest(&mut self) -> bool {
        self.workspace.start_from_rest(self.system);
        self.solve()
    }

    fn solve(&mut self) -> bool {
        let settings = &self.settings.equilibrium;
        let solution = equilibrium::solve(self.system, &mut self.workspace, &self.all_tensions, settings);
        solution.status == Status::Converged
    }

    /// Keeps the candidate if it is among the best, in the place of the worst.
    fn remember(&mut self, active: &[f64], cost: f64) {
        let positions = self.workspace.positions();
        if self.known.len() < self.known.capacity() {
            self.known.push(Known { tensions: active.to_vec(), cost, positions: positions.to_vec() });
        } else if let Some(worst) = self.known.iter_mut().max_by(|a, b| a.cost.total_cmp(&b.cost))
            && cost < worst.cost
        {
            worst.tensions.copy_from_slice(active);
            worst.cost = cost;
            worst.positions.copy_from_slice(positions);
        }
    }
}

fn distance_squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}
