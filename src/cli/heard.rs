//! A tongue whose sound was computed, in the plane or in space.

use std::collections::BTreeMap;

use nalgebra::SVector;
use tongue_fit::body::Mesh;
use tongue_fit::measured::ByMuscle;
use tongue_fit::report::SoundRecord;
use tongue_fit::system::TissueModel;

/// A shape in the midsagittal plane.
pub struct Shown {
    /// The section at rest.
    pub mesh: Mesh<2>,
    /// Positions of its nodes, m.
    pub positions: Vec<SVector<f64, 2>>,
}

/// A tongue that was heard.
pub struct Heard {
    pub title: String,
    pub converged: bool,
    pub tissue: TissueModel,
    pub tensions_n: Option<BTreeMap<String, f64>>,
    pub activations: Option<ByMuscle<f64>>,
    pub sound: SoundRecord,
    pub wall_s: f64,
    pub shown: Shown,
}
