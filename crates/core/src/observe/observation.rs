//! What was seen, and how sure it is.

use std::sync::Arc;

use nalgebra::SVector;

use super::Observable;

/// What a measurement says of an observable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sense {
    /// It has the measured value.
    #[default]
    Equal,
    /// It is not below the measured value ("did not become shorter").
    AtLeast,
    /// It is not above it.
    AtMost,
}

/// How sure a measured value is.
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

/// An observable, its measured value, and how sure that is.
#[derive(Debug, Clone)]
pub struct Observation<const D: usize> {
    /// What was measured.
    pub observable: Arc<dyn Observable<D>>,
    /// The measured value, unit of the observable.
    pub measured: f64,
    /// What it says.
    pub sense: Sense,
    /// How sure it is.
    pub certainty: Certainty,
    /// By what its residual is multiplied in a fit, one over the unit of the observable. For quantities of one kind 1; where kinds
    /// are mixed, one over the standard deviation.
    pub weight: f64,
    /// When, s, where that is known.
    pub time_s: Option<f64>,
}

impl<const D: usize> Observation<D> {
    /// That the observable has this value; nothing is known of how sure it is, and the weight is 1.
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

    /// Weighted residual at a shape (positions of all nodes, m): simulated less measured; zero where an inequality holds.
    pub fn residual(&self, positions: &[SVector<f64, D>]) -> f64 {
        let difference = self.observable.value(positions) - self.measured;
        self.weight
            * match self.sense {
                Sense::Equal => difference,
                Sense::AtLeast => difference.min(0.0),
                Sense::AtMost => difference.max(0.0),
            }
    }

    /// Rate of the residual when every node moves with `motion`.
    pub fn rate(&self, positions: &[SVector<f64, D>], motion: &[SVector<f64, D>]) -> f64 {
        let holds = match self.sense {
            Sense::Equal => false,
            _ => self.residual(positions) == 0.0,
        };
        if holds { 0.0 } else { self.weight * self.observable.rate(positions, motion) }
    }
}
