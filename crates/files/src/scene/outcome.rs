//! The result of a scene: lengths, forces, times and positions.

use serde::Serialize;

use super::loads::PointsFit;
use super::plan::ScenePlan;
use crate::report::{OperationRecord, SoundRecord};
use tongue_core::body::Body;
use tongue_core::dynamics::{self, StepCounts};
use tongue_core::statics::Solution;
use tongue_infer::inverse::{self, alarms::Alarm};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pull {
    /// Its tension, N (2D: per metre of thickness).
    TensionN(f64),
    Activation(f64),
}

impl Pull {
    pub fn value(self) -> f64 {
        match self {
            Self::TensionN(value) | Self::Activation(value) => value,
        }
    }
}

/// How hard every muscle of the mesh pulls.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pulls<T = Vec<f64>> {
    /// Tensions, N (2D: per metre of thickness).
    TensionsN(T),
    /// Activations, 0 to 1, in a tongue in space.
    Activations(T),
}

impl<T> Pulls<T> {
    pub fn of<const D: usize>(body: &Body<D>, values: T) -> Self {
        if body.is_activated() { Self::Activations(values) } else { Self::TensionsN(values) }
    }

    pub fn values(&self) -> &T {
        match self {
            Self::TensionsN(values) | Self::Activations(values) => values,
        }
    }
}

/// Length of a muscle; for muscles of one name the mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MuscleLength {
    pub muscle: String,
    #[serde(flatten)]
    pub pull: Pull,
    /// Its 95 % interval, if points were fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_n: Option<[f64; 2]>,
    pub rest_mm: f64,
    pub length_mm: f64,
    /// Length over that at rest.
    pub stretch: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactForce {
    /// Force of the body on the wall, N (2D: per metre of thickness).
    pub on_wall_n: Vec<f64>,
    pub largest_n: f64,
    pub touching: usize,
    pub closest_mm: f64,
    /// Whether a corner of the wall is between two nodes: the wall acts on nodes, not on the lines between
    /// them.
    pub edge_through_wall: bool,
}

/// Time of an effect in the solve: the measured time of each evaluation times their number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectTime {
    pub effect: &'static str,
    pub energy_us: f64,
    pub force_us: f64,
    pub stiffness_us: f64,
    /// All evaluations of the solve, microseconds.
    pub total_us: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moment {
    pub time_s: f64,
    /// Length of every muscle, mm; for muscles of one name the mean.
    pub lengths_mm: Vec<f64>,
    /// Formants, Hz, if the scene has a tract; null if its walls meet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formants_hz: Option<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneMotion {
    pub status: dynamics::MotionStatus,
    pub time_s: f64,
    /// Part of the way to its equilibrium that the body has moved; null if there is no such way.
    pub part_of_way_to_equilibrium: Option<f64>,
    pub counts: StepCounts,
    pub moments: Vec<Moment>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneOutcome {
    pub plan: ScenePlan,
    pub converged: bool,
    #[serde(flatten)]
    pub pulls: Pulls,
    /// Muscles, each name once.
    pub muscles: Vec<MuscleLength>,
    /// Smallest ratio of a cell's area or volume to that at rest.
    pub min_cell_ratio: f64,
    pub max_cell_ratio: f64,
    /// Total area, m², or volume, m³, over that at rest.
    pub measure_ratio: f64,
    pub contact: Option<ContactForce>,
    /// Force of the body on the bones, N, by dimension; null at the end of a trajectory, where dampers and
    /// masses act on them too.
    pub on_bones_n: Option<Vec<f64>>,
    pub solution: Option<Solution>,
    pub fit: Option<inverse::FitStatus>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<PointsFit>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sound: Option<SoundRecord>,
    /// What surgery changed, if there was any; everything else is after it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub operation: Option<OperationRecord>,
    pub trajectory: Option<SceneMotion>,
    /// What is wrong with the shape of a tongue in space: strained too far.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alarms: Vec<Alarm>,
    pub wall_s: f64,
    /// Time by effect, for a trajectory or the last equilibrium; the rest is mostly linear algebra.
    pub time_by_effect: Vec<EffectTime>,
    pub positions_m: Vec<Vec<f64>>,
}
