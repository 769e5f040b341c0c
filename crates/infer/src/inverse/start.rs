//! Starting points and results of searches.

use serde::Serialize;

use super::unknown::Unknown;

/// Side of the first simplex, in units of the unknowns.
pub(super) const FIRST_SIDE: f64 = 5.0;
/// Largest relative difference of the costs of one equilibrium.
pub(super) const SAME_COST: f64 = 1e-6;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SearchCounts {
    pub evaluations: usize,
    pub failures: usize,
    pub factorisations: usize,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Start {
    /// Values of the unknowns, in their units: tensions in N.
    #[serde(rename = "tensions")]
    pub x: Vec<f64>,
    pub cost: f64,
    pub evaluations: usize,
    #[serde(skip)]
    pub failures: usize,
    pub factorisations: usize,
    /// Number of iterations, over all simplices.
    pub iterations: u64,
    pub restarts: usize,
    /// Whether the last simplex shrank to the tolerance and confirmed the previous one; for Gauss-Newton,
    /// whether its steps did.
    pub converged: bool,
    /// Whether the answer has an equilibrium that is reached from rest.
    #[serde(skip)]
    pub solved: bool,
}

impl Start {
    pub(super) fn at(x: Vec<f64>, cost: f64) -> Self {
        Self { x, cost, ..Self::default() }
    }

    pub(super) fn count(&mut self, counts: SearchCounts) {
        self.evaluations = counts.evaluations;
        self.failures = counts.failures;
        self.factorisations = counts.factorisations;
    }
}

/// Start number `number`: a point of Halton's sequence, which fills the box evenly and is the same on every
/// machine.
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
