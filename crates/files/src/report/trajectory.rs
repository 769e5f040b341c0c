//! A trajectory as a record for JSON.

use serde::Serialize;

use super::ByMuscle;
use tongue_core::dynamics::{IntegrationMethod, MotionOutcome};

/// One trajectory: `tongue-fit simulate --trajectory --json`, and `trajectory.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrajectoryRecord {
    #[serde(flatten)]
    pub outcome: MotionOutcome,
    pub method: IntegrationMethod,
    /// Fixed step, s; null with error control.
    pub dt_s: Option<f64>,
    /// Error allowed in a step, mm; null with a fixed step.
    pub tolerance_mm: Option<f64>,
    pub t_end_s: f64,
    /// Part of the way to its equilibrium, under the tensions at the time reached, that the body has moved;
    /// null if there is no such way.
    pub part_of_way_to_equilibrium: Option<f64>,
    /// Elements in which the barrier against inversion acts at the end.
    pub guarded: usize,
    pub lengths_mm: ByMuscle<f64>,
    /// Smallest ratio of the tissue's area to that at rest, of a triangle or in a continuum within an element, at the end.
    pub min_area_ratio: f64,
    pub max_area_ratio: f64,
    pub wall_s: f64,
}
