//! What is sampled, what it means, and where it leads.

use std::sync::Arc;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// A sampled unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in a posture: number of the posture, number of the muscle.
    Tension(usize, usize),
    /// Tension of a muscle in the baseline.
    Tone(usize),
    /// Displacement of the hyoid along an axis: number of the posture, number of the axis.
    Hyoid(usize, usize),
    /// Tilt of the hyoid for every metre that it moves back.
    Tilt,
}

/// Tensions and displacement of the hyoid in one posture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Posture {
    /// Tensions of all muscles of the body, N per metre of thickness.
    pub tensions: Vec<f64>,
    /// Displacement of the hyoid, m.
    pub hyoid: SVector<f64, 2>,
}

/// Physical quantities at a point in the space of scores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Meaning {
    /// The postures.
    pub postures: Vec<Posture>,
    /// Tensions in the baseline, N per metre of thickness.
    pub tones: Vec<f64>,
    /// Angle by which the hyoid tilts, its greater horn downwards, for every metre that it moves back, rad/m.
    pub tilt: f64,
}

impl Meaning {
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
pub struct Place {
    /// Positions of all nodes in each posture, m.
    pub postures: Vec<Arc<Vec<SVector<f64, 2>>>>,
    /// Positions of all nodes in the baseline, m.
    pub baseline: Arc<Vec<SVector<f64, 2>>>,
    /// Lengths of all muscles of the body in each posture, one after the other, m.
    pub lengths: Vec<f64>,
    /// Lengths of all muscles of the body in the baseline, m.
    pub baseline_lengths: Vec<f64>,
    /// Computed numbers of the other measurements.
    pub beside: Vec<f64>,
}
