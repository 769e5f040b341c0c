//! Starting points of searches, and the best solved candidates as starts for their neighbours.

use std::ops::AddAssign;

use nalgebra::SVector;
use serde::Serialize;

use super::problem::Unknown;
use tongue_core::statistics::least_by;

/// Side of the first simplex, in units of the unknowns.
pub(super) const FIRST_SIDE: f64 = 5.0;
/// Costs that differ by at most this part belong to one equilibrium; costs below this number count as this number.
const SAME_COST: f64 = 1e-6;

/// Whether a candidate solved from a neighbour has the cost that Newton's method from rest gives, `by_newton`; shapes are not compared,
/// because a search keeps only costs.
pub(super) fn same_cost_by_newton(cost: f64, by_newton: f64) -> bool {
    (by_newton - cost).abs() <= SAME_COST * cost.abs().max(SAME_COST)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SearchCounts {
    /// Number of equilibria solved.
    pub evaluations: usize,
    #[serde(skip)]
    pub failures: usize,
    pub factorisations: usize,
}

impl AddAssign for SearchCounts {
    fn add_assign(&mut self, more: Self) {
        self.evaluations += more.evaluations;
        self.failures += more.failures;
        self.factorisations += more.factorisations;
    }
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Start {
    /// Values of the unknowns where the search ended, in their units: tensions in N. The answer is the best of them, moved onto the target
    /// and along the solution curve where there is one.
    #[serde(rename = "tensions")]
    pub x: Vec<f64>,
    pub cost: f64,
    #[serde(flatten)]
    pub counts: SearchCounts,
    /// Number of iterations, over all simplices.
    pub iterations: u64,
    pub restarts: usize,
    /// Whether a restart confirmed the answer of a converged simplex; for Gauss-Newton, whether its steps converged.
    pub converged: bool,
    /// Whether the answer has an equilibrium when solved without neighbours.
    #[serde(skip)]
    pub solved: bool,
}

impl Start {
    pub(super) fn new(x: Vec<f64>, cost: f64) -> Self {
        Self { x, cost, ..Self::default() }
    }
}

/// Start number `number`: a point of Halton's sequence (1960), which fills the box evenly.
pub(super) fn starting_point(number: usize, unknowns: &[Unknown]) -> Vec<f64> {
    let point = primes().zip(unknowns).map(|(prime, u)| {
        let part = radical_inverse(number + 1, prime);
        let range = u.started_in * (u.upper - u.lower);
        if u.lower == 0.0 { range * part } else { 0.5 * (u.lower + u.upper) + range * (part - 0.5) }
    });
    point.collect()
}

fn primes() -> impl Iterator<Item = usize> {
    (2..).filter(|n| (2..*n).take_while(|d| d * d <= *n).all(|d| n % d != 0))
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

#[derive(Debug, Clone)]
pub(super) struct SolvedCandidate<const D: usize> {
    pub x: Vec<f64>,
    pub cost: f64,
    pub positions: Vec<SVector<f64, D>>,
}

/// The best candidates, at most as many as a simplex has corners.
#[derive(Debug, Clone)]
pub(super) struct WarmStarts<const D: usize> {
    most: usize,
    list: Vec<SolvedCandidate<D>>,
}

impl<const D: usize> WarmStarts<D> {
    pub fn new(dimension: usize) -> Self {
        Self { most: dimension + 1, list: Vec::with_capacity(dimension + 1) }
    }

    /// Keeps a candidate in place of the worst one if there is room or it is better.
    pub(crate) fn remember(&mut self, x: &[f64], cost: f64, positions: &[SVector<f64, D>]) {
        if self.list.len() < self.most {
            self.list.push(SolvedCandidate { x: x.to_vec(), cost, positions: positions.to_vec() });
        } else if let Some(worst) = self.list.iter_mut().max_by(|a, b| a.cost.total_cmp(&b.cost))
            && cost < worst.cost
        {
            worst.x.copy_from_slice(x);
            worst.cost = cost;
            worst.positions.copy_from_slice(positions);
        }
    }

    pub fn best(&self) -> Option<&SolvedCandidate<D>> {
        self.list.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    pub fn nearest(&self, x: &[f64]) -> Option<&SolvedCandidate<D>> {
        least_by(&self.list, |known| distance_squared(&known.x, x))
    }

    /// Largest distance of a candidate from the best one, in units of the unknowns; infinite with fewer than a simplex has corners.
    pub fn spread(&self) -> f64 {
        let Some(best) = self.best().filter(|_| self.list.len() == self.most) else { return f64::INFINITY };
        let distances = self.list.iter().map(|k| distance_squared(&k.x, &best.x));
        distances.fold(0.0, f64::max).sqrt()
    }

    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Removes all but the best, so that [`WarmStarts::spread`] is that of a new simplex.
    pub(crate) fn keep_best(&mut self) {
        let best = self.best().cloned();
        self.list.clear();
        self.list.extend(best);
    }
}

pub(super) fn distance_squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}
