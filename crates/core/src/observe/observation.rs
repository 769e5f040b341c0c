//! A measurement and how much it counts.

use std::sync::Arc;

use nalgebra::SVector;

use super::Observable;

/// An observable, its measured value and how much that counts.
#[derive(Debug, Clone)]
pub struct Observation<const D: usize> {
    pub observable: Arc<dyn Observable<D>>,
    /// The measured value, unit of the observable.
    pub measured: f64,
    /// Factor of its residual in a fit, in one over the unit of the observable: 1 where all quantities are
    /// of one kind, one over the standard deviation where kinds are mixed.
    pub weight: f64,
}

impl<const D: usize> Observation<D> {
    /// The observable has this value, with a weight of 1.
    pub fn new(observable: impl Observable<D> + 'static, measured: f64) -> Self {
        Self { observable: Arc::new(observable), measured, weight: 1.0 }
    }

    /// The same, known to a standard deviation (unit of the observable), by which its residual is divided.
    pub fn with_standard_deviation(self, sd: f64) -> Self {
        Self { weight: 1.0 / sd, ..self }
    }

    /// Weighted residual at a shape (positions of all nodes, m): simulated less measured.
    pub fn residual(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.weighted(self.observable.value(positions))
    }

    /// The same, and for every node on which the observable depends the weighted derivative by its position.
    pub fn residual_and_slope(&self, positions: &[SVector<f64, D>]) -> (f64, Vec<(usize, SVector<f64, D>)>) {
        let mut slope = Vec::with_capacity(4);
        let mut part = |node, s: SVector<f64, D>| slope.push((node, s * self.weight));
        let value = self.observable.value_and_gradient(positions, &mut part);
        (self.weighted(value), slope)
    }

    fn weighted(&self, value: f64) -> f64 {
        self.weight * (value - self.measured)
    }

    /// Rates of the residual for several motions of all nodes, into `rates`.
    pub fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        self.observable.rates(positions, motions, rates);
        rates.iter_mut().for_each(|rate| *rate *= self.weight);
    }
}
