//! Draws of a posterior.

use serde::{Deserialize, Serialize};

use super::unknowns::Meaning;

/// A draw. Its lists of lengths contain all muscles of the body in the first posture, then in the second one, and so on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Draw {
    pub chain: usize,
    pub number: usize,
    pub meaning: Meaning,
    pub lengths: Vec<f64>,
    pub baseline_lengths: Vec<f64>,
    /// Computed numbers of the other measurements.
    pub beside: Vec<f64>,
    /// Logarithm of its density in the scores, up to a constant.
    pub log: f64,
    /// The contribution of the measurements to `log`.
    pub log_likelihood: f64,
}

impl Draw {
    /// The stretch in a row of the list of all muscles in all postures.
    pub fn stretch(&self, row: usize) -> f64 {
        self.lengths[row] / self.baseline_lengths[row % self.baseline_lengths.len()]
    }

    pub fn tension(&self, posture: usize, muscle: usize) -> f64 {
        self.meaning.postures[posture].tensions[muscle]
    }

    pub fn change(&self, posture: usize, muscle: usize) -> f64 {
        self.tension(posture, muscle) - self.meaning.tones[muscle]
    }
}
