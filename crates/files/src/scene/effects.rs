//! Effects that a scene file asks for: weight, walls, bones that move.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Effects on the body. Each is off unless it is asked for or needed for the wanted result.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// Tissue as springs on the connections (thesis 3.2.2); a body that is not a continuum needs them.
    pub springs: Option<bool>,
    /// Incompressibility: cells keep their area or volume (thesis 3.3).
    pub incompressibility: Option<bool>,
    /// Weight.
    pub gravity: Option<SceneGravity>,
    /// Palate and teeth.
    pub contact: Option<SceneContact>,
    /// A mandible that rotates about its joint and carries the origin of the genioglossus.
    pub jaw: Option<Jaw>,
    /// A displaced hyoid bone.
    pub hyoid: Option<Hyoid>,
    /// Mass; only a trajectory needs it.
    pub inertia: Option<bool>,
    /// Dampers of the tissue; only a trajectory needs them.
    pub viscosity: Option<bool>,
    /// Series spring and damper of the contractile element; only a trajectory needs them.
    pub muscle_dynamics: Option<bool>,
}

/// Weight. Give either the posture or the direction.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneGravity {
    /// Posture of the head.
    pub posture: Option<HeadPosture>,
    /// Direction of the weight: one number for each dimension, of any length.
    pub direction: Option<Vec<f64>>,
    /// Acceleration, m/s².
    #[serde(default = "default_gravity")]
    pub acceleration_m_per_s2: f64,
}

/// Posture of the head of the midsagittal model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Posture")]
pub enum HeadPosture {
    /// Standing or sitting: weight acts downwards, along -y.
    Upright,
    /// On the back, as in an MR scanner: weight acts to the back of the head, along +x.
    Supine,
    /// Face down: weight acts to the front, along -x.
    Prone,
}

/// A rigid wall that the surface of the body cannot pass.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneContact {
    /// Corners of the wall in the x-y plane, mm; by default the palate of `targets/palate.toml`.
    pub outline_mm: Option<Vec<[f64; 2]>>,
    /// Stiffness of the wall, N/m (2D: per metre of thickness); by default the spring constant of the tissue.
    pub stiffness_n_per_m: Option<f64>,
    /// Distance at which the wall begins to act, mm.
    #[serde(default = "default_reach")]
    pub reach_mm: f64,
}

/// A rotated mandible.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Jaw {
    /// Opening angle, degrees.
    pub opening_deg: f64,
    /// The joint, mm.
    #[serde(default = "default_joint")]
    pub joint_mm: [f64; 2],
}

/// A displaced hyoid bone.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hyoid {
    /// Displacement, mm: x to the back, y up.
    pub shift_mm: [f64; 2],
}

fn default_gravity() -> f64 {
    9.81
}

/// Default distance at which a wall begins to act, mm.
pub(crate) const CONTACT_REACH_MM: f64 = 1.0;

fn default_reach() -> f64 {
    CONTACT_REACH_MM
}

fn default_joint() -> [f64; 2] {
    super::JOINT_MM
}
