//! A measurement and its uncertainty.

use std::sync::Arc;

use nalgebra::SVector;

use super::Observable;

/// How a measurement constrains an observable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sense {
    /// It has the measured value.
    #[default]
    Equal,
    /// It is not below the measured value ("did not become shorter").
    AtLeast,
    AtMost,
}

/// Uncertainty of a measured value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Certainty {
    /// Nothing is known.
    #[default]
    Unknown,
    /// It lies between these two values, as a rounded number does.
    Between(f64, f64),
    /// Standard deviation, unit of the value.
    StandardDeviation(f64),
}

/// An observable, its measured value and the uncertainty of that.
#[derive(Debug, Clone)]
pub struct Observation<const D: usize> {
    pub observable: Arc<dyn Observable<D>>,
    /// The measured value, unit of the observable.
    pub measured: f64,
    pub sense: Sense,
    pub certainty: Certainty,
    /// Factor of its residual in a fit, in one over the unit of the observable: 1 where all quantities are
    /// of one kind, one over the standard deviation where kinds are mixed.
    pub weight: f64,
    /// Time of the measurement, s, where it is known.
    pub time_s: Option<f64>,
}

impl<const D: usize> Observation<D> {
    /// The observable has this value, with unknown uncertainty and a weight of 1.
    pub fn new(observable: impl Observable<D> + 'static, measured: f64) -> Self {
        Self {
            observable: Arc::new(observable),
            measured,
            sense: Sense::Equal,
            certainty: Certainty::Unknown,
            weight: 1.0,
            time_s: None,
        }
    }

    /// The same, known to a standard deviation (unit of the observable), by which its residual is divided.
    pub fn with_standard_deviation(self, sd: f64) -> Self {
        Self { certainty: Certainty::StandardDeviation(sd), weight: 1.0 / sd, ..self }
    }

    /// The same, known to lie between two values; the weight stays.
    pub fn between(self, low: f64, high: f64) -> Self {
        Self { certainty: Certainty::Between(low, high), ..self }
    }

    /// Weighted residual at a shape (positions of all nodes, m): simulated less measured; zero where an
    /// inequality holds.
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
        let difference = value - self.measured;
        self.weight
            * match self.sense {
                Sense::Equal => difference,
                Sense::AtLeast => difference.min(0.0),
                Sense::AtMost => difference.max(0.0),
            }
    }

    /// Rates of the residual for several motions of all nodes, into `rates`.
    pub fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        let holds = match self.sense {
            Sense::Equal => false,
            _ => self.residual(positions) == 0.0,
        };
        if holds {
            return rates.fill(0.0);
        }
        self.observable.rates(positions, motions, rates);
        rates.iter_mut().for_each(|rate| *rate *= self.weight);
    }
}
