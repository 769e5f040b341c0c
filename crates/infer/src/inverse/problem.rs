//! Interface between searches and problems: bounded unknowns, residuals and their derivative, without bodies.

use nalgebra::{DMatrix, DVector};

use super::start::{SearchCounts, starting_point};
use super::unknown::Unknown;

/// Cost of a candidate without residuals: worse than any real one, and finite, because argmin's Nelder-Mead
/// panics on errors in its first simplex and gives up on NaN.
pub const FAILED: f64 = 1e6;

/// Residuals and their derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised {
    /// One row for each residual, one column for each unknown.
    pub jacobian: DMatrix<f64>,
    /// Simulated minus measured values.
    pub residuals: DVector<f64>,
    /// The derivative of the other measurements, which are not fitted; without rows if there are none.
    pub other_jacobian: DMatrix<f64>,
    pub other_residuals: DVector<f64>,
}

/// A problem of nonlinear least squares in bounded unknowns.
///
/// A candidate may be solved from its solved neighbours. The result can differ from that of a solution from rest
/// ([`Problem::residuals_from_rest`]), so a search compares the two.
pub trait Problem {
    fn unknowns(&self) -> &[Unknown];

    fn start(&mut self, number: usize) -> Vec<f64> {
        starting_point(number, self.unknowns())
    }

    /// Residuals of a candidate (one value for each unknown); `None` if it has no answer.
    fn residuals(&mut self, x: &[f64]) -> Option<DVector<f64>>;

    /// Residuals and their derivative; `None` if there is no answer or it is singular.
    fn linearise(&mut self, x: &[f64]) -> Option<Linearised>;

    /// As [`Problem::residuals`], solved from rest.
    fn residuals_from_rest(&mut self, x: &[f64]) -> Option<DVector<f64>> {
        self.residuals(x)
    }

    /// Residuals of several candidates, solved at once.
    fn residuals_of_each(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<DVector<f64>>> {
        candidates.iter().map(|x| self.residuals(x)).collect()
    }

    /// Makes every later candidate start from rest.
    fn forget_neighbours(&mut self) {}

    /// The same problem on the branch of equilibria that leads from rest: every candidate is the equilibrium to which its tensions lead
    /// from rest as they grow together, which takes many times as long. `None` for a problem that is on it already or has no such path.
    fn on_branch(&self) -> Option<Box<dyn Problem + '_>> {
        None
    }

    /// On the branch from rest: moves to the shape of the last candidate, from which alone later candidates are solved.
    fn move_on(&mut self) {}

    /// Adds work that was done for this problem elsewhere.
    fn count(&mut self, _more: SearchCounts) {}

    /// Removes all candidates but the best, so that [`Problem::spread`] is that of new ones.
    fn keep_best(&mut self) {}

    /// Spread of the best candidates (one more than there are unknowns), in units of the unknowns; infinite
    /// until there are as many.
    fn spread(&self) -> f64;

    fn counts(&self) -> SearchCounts;

    /// Residuals of the other measurements at the last candidate; empty if there are none.
    fn other_residuals(&self) -> DVector<f64>;

    /// Lengths of all muscles at the last candidate, m.
    fn lengths(&self) -> Vec<f64>;

    /// Number of residuals that are measurements: the first ones. The others are priors.
    fn measurements(&self) -> usize;

    /// Cost of a newton of tension in the objective if the measurements leave tensions undetermined; else 0.
    fn effort(&self) -> f64;

    /// The objective of a candidate with these residuals: their squares and the effort. It is always finite.
    fn cost(&self, x: &[f64], residuals: Option<&DVector<f64>>) -> f64 {
        let Some(r) = residuals else { return FAILED };
        let tensions = self.unknowns().iter().zip(x).filter(|(u, _)| u.is_tension()).map(|(_, x)| x);
        let cost = squares(r.iter()) + self.effort() * tensions.sum::<f64>();
        if cost.is_finite() { cost } else { FAILED }
    }

    /// Root mean square residual of the measurements; infinite for a candidate without an answer.
    fn misfit(&self, residuals: Option<&DVector<f64>>) -> f64 {
        let n = self.measurements();
        residuals.map_or(f64::INFINITY, |r| (squares(r.iter().take(n)) / n as f64).sqrt())
    }
}

fn squares<'a>(residuals: impl Iterator<Item = &'a f64>) -> f64 {
    residuals.map(|r| r.powi(2)).sum()
}
