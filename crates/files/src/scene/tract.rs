//! The keys of the tract of a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tongue_infer::acoustics::Articulation;

/// The tract around the tongue. `effects.jaw` and `effects.hyoid` move its jaw and larynx.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneTract {
    /// Its file, from the current folder; by default the tract of the reference tongue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Height of the opening between the lips, mm.
    #[serde(default = "default_opening")]
    pub lip_opening_mm: f64,
    /// Protrusion of the lips, mm.
    #[serde(default)]
    pub lip_protrusion_mm: f64,
}

impl Default for SceneTract {
    fn default() -> Self {
        Self { file: None, lip_opening_mm: default_opening(), lip_protrusion_mm: 0.0 }
    }
}

fn default_opening() -> f64 {
    Articulation::default().lip_opening_mm
}
