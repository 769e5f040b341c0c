//! What is sampled, what it means, and where it leads; draws.

use std::sync::Arc;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// A sampled unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in a posture: number of the posture, number of the muscle.
    Tension(usize, usize),
    Tone(usize),
    /// Displacement of the hyoid along an axis: number of the posture, number of the axis.
    Hyoid(usize, usize),
    /// Tilt of the hyoid for every metre that it moves back.
    Tilt,
}

/// Tensions and displacement of the hyoid in one posture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Posture {
    pub tensions: Vec<f64>,
    pub hyoid: SVector<f64, 2>,
}

/// Physical quantities at a point in the space of scores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterValues {
    pub postures: Vec<Posture>,
    pub tones: Vec<f64>,
    /// Angle by which the hyoid tilts, its greater horn downwards, for every metre that it moves back, rad/m.
    pub tilt: f64,
}

impl ParameterValues {
    /// The same quantities with tensions and displacements multiplied by `part`.
    pub fn scaled(&self, part: f64) -> Self {
        let times = |all: &[f64]| all.iter().map(|t| t * part).collect();
        let posture = |p: &Posture| Posture { tensions: times(&p.tensions), hyoid: p.hyoid * part };
        let postures = self.postures.iter().map(posture).collect();
        Self { postures, tones: times(&self.tones), ..*self }
    }
}

/// A solved point; nearby points are solved from its positions.
#[derive(Debug, Clone)]
pub struct WarmStart {
    pub postures: Vec<Arc<Vec<SVector<f64, 2>>>>,
    pub baseline: Arc<Vec<SVector<f64, 2>>>,
    /// Lengths of all muscles of the body in each posture, one after the other, m.
    pub lengths: Vec<f64>,
    pub baseline_lengths: Vec<f64>,
    pub beside: Vec<f64>,
}

/// A draw. Its lists of lengths contain all muscles of the body in the first posture, then in the second one, and so on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Draw {
    pub chain: usize,
    pub number: usize,
    pub meaning: ParameterValues,
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
