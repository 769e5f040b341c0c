//! What a search sees of a problem: bounded unknowns, residuals and their derivative, and nothing of bodies.

use nalgebra::{DMatrix, DVector};

use super::unknown::Unknown;

/// Cost of a candidate without residuals: worse than any real one, and finite, because argmin's Nelder-Mead panics on errors in its
/// first simplex and gives up on NaN.
pub const FAILED: f64 = 1e6;

/// Residuals and their derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    /// A row a residual, a column an unknown.
    pub jacobian: DMatrix<f64>,
    /// Simulated less measured.
    pub residuals: DVector<f64>,
    /// The derivative of what is measured and not fitted; without rows where there is nothing.
    pub other_jacobian: DMatrix<f64>,
    /// The residuals of what is measured and not fitted.
    pub other_residuals: DVector<f64>,
}

/// How much work was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Candidates solved.
    pub evaluations: usize,
    /// Those among them without an answer.
    pub failures: usize,
    /// Factorisations of a stiffness.
    pub factorisations: usize,
}

/// A problem of nonlinear least squares in bounded unknowns.
///
/// A candidate may be solved from its neighbours that were solved before; where that can lead elsewhere than from the beginning
/// ([`Problem::residuals_from_rest`]), a search compares the two.
pub trait Problem {
    /// The unknowns, with their bounds.
    fn unknowns(&self) -> &[Unknown];

    /// Residuals of a candidate (one value an unknown); `None` where it has no answer.
    fn residuals(&mut self, x: &[f64]) -> Option<DVector<f64>>;

    /// Residuals and their derivative; `None` where there is no answer or none that is regular.
    fn linearise(&mut self, x: &[f64]) -> Option<Linear>;

    /// As [`Problem::residuals`], solved from the beginning.
    fn residuals_from_rest(&mut self, x: &[f64]) -> Option<DVector<f64>> {
        self.residuals(x)
    }

    /// Residuals of several candidates, solved at once.
    fn residuals_of_each(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<DVector<f64>>> {
        candidates.iter().map(|x| self.residuals(x)).collect()
    }

    /// From now on every candidate is solved from the beginning.
    fn forget_neighbours(&mut self) {}

    /// Whether from now on every candidate is where its tensions lead from rest as they grow together, which takes many times as
    /// long; returns whether it was so. Problems that know no such way are always as if it were.
    fn trace(&mut self, _trace: bool) -> bool {
        true
    }

    /// Whether from now on candidates are solved from the shape of the last one, and from no other.
    fn hold(&mut self, _hold: bool) {}

    /// Forgets all candidates but the best, so that [`Problem::spread`] speaks of new ones.
    fn keep_best(&mut self) {}

    /// How far the best candidates (one more than there are unknowns) lie apart, unit of the unknowns; infinite before there are
    /// so many.
    fn spread(&self) -> f64;

    /// What was done so far.
    fn counts(&self) -> Counts;

    /// Residuals of what is measured and not fitted, at the last candidate; empty where there is nothing.
    fn other_residuals(&self) -> DVector<f64>;

    /// Lengths of all muscles at the last candidate, m.
    fn lengths(&self) -> Vec<f64>;

    /// How many of the residuals are measurements: the first ones. The others are priors.
    fn measurements(&self) -> usize;

    /// What a newton of tension costs in the objective, where the measurements leave tensions open; else 0.
    fn effort(&self) -> f64;

    /// The objective of a candidate with these residuals: their squares and the effort. Finite whatever the candidate.
    fn cost(&self, x: &[f64], residuals: Option<&DVector<f64>>) -> f64 {
        let Some(r) = residuals else { return FAILED };
        let tensions = self.unknowns().iter().zip(x).filter(|(u, _)| u.is_tension()).map(|(_, x)| x);
        let cost = squares(r.iter()) + self.effort() * tensions.sum::<f64>();
        if cost.is_finite() { cost } else { FAILED }
    }

    /// Root mean square residual of the measurements; infinite where a candidate has no answer.
    fn misfit(&self, residuals: Option<&DVector<f64>>) -> f64 {
        let n = self.measurements();
        residuals.map_or(f64::INFINITY, |r| (squares(r.iter().take(n)) / n as f64).sqrt())
    }
}

fn squares<'a>(residuals: impl Iterator<Item = &'a f64>) -> f64 {
    residuals.map(|r| r.powi(2)).sum()
}
