//! The record of activations that bring a body in space to where it was seen, and what a plane misses of such a motion.

use serde::Serialize;

use super::record::by_muscle;
use tongue_core::body::Body;
use tongue_infer::inverse::FitStatus;
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::in_space::{Combination, EndedSearch, OPEN_ABOVE, SpaceFit};
use tongue_input::measured::ByMuscle;

/// `tongue-fit track FILES --body space --json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpaceTrackRecord {
    #[serde(rename = "tongue")]
    pub body: String,
    /// Why frames cannot be trusted: the reason for an exit status of 3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untrusted: Option<String>,
    pub frames: Vec<SpaceFitRecord>,
    pub notes: Vec<String>,
    pub wall_s: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpaceFitRecord {
    pub recording: Option<String>,
    pub time_s: Option<f64>,
    pub status: FitStatus,
    /// Root of the mean squared distance from what was seen, mm; stretches and ratios count times the length at rest.
    pub rms_mm: f64,
    pub distances_mm: Vec<f64>,
    /// Activations, 0 to 1: of muscles, or of both sides by their common name.
    pub activations: ByMuscle<f64>,
    /// The 95 % interval of each activation, the prior and the common factor of stiffness included; empty where there is no equilibrium.
    pub interval_95: ByMuscle<[f64; 2]>,
    /// Combinations of activations that the data leave open, each with the standard deviation along it.
    pub open: Vec<Combination>,
    pub starts: Vec<EndedSearch>,
    /// Number of starts that ended at this answer.
    pub ended_here: usize,
    /// Starts that ended elsewhere and meet the data as well (misfit at most a twentieth larger).
    pub others_as_good: Vec<ByMuscle<f64>>,
    pub factorisations: usize,
    pub alarms: Vec<Alarm>,
}

/// Misfits that differ by this part are as good as each other.
const AS_GOOD: f64 = 0.05;

impl SpaceFitRecord {
    /// The record of a frame.
    pub fn new(body: &Body<3>, recording: Option<String>, time_s: Option<f64>, fit: &SpaceFit) -> Self {
        let replay = &fit.answer.replay;
        let mut alarms = alarms::of_equilibrium(&replay.solution, replay.from_rest);
        let positions = &fit.answer.positions;
        alarms.extend(alarms::of_strain(&body.mesh, body.volume_ratios(positions), positions));
        if !fit.combinations.is_empty() && fit.combinations.iter().all(|c| c.sd > OPEN_ABOVE) {
            alarms.push(Alarm::NothingResolved);
        }
        Self {
            recording,
            time_s,
            status: fit.answer.status,
            rms_mm: 1e3 * fit.rms_m,
            distances_mm: fit.distances_m.iter().map(|d| 1e3 * d).collect(),
            activations: by_muscle(&fit.names, &fit.activations_found()),
            interval_95: ByMuscle::new(&fit.names, fit.intervals_95()),
            open: fit.combinations.iter().filter(|c| c.sd > OPEN_ABOVE).cloned().collect(),
            starts: fit.starts.clone(),
            ended_here: fit.ended_here(),
            others_as_good: fit.others_as_good(AS_GOOD).map(|s| s.activations.clone()).collect(),
            factorisations: fit.factorisations,
            alarms,
        }
    }
}

/// Part of the way of the midsagittal contour that a plane misses after the best scaling: the median over the
/// muscles of the built-in body in space (`results/plane`). A test of the studies compares it with theirs.
pub const MISSED_BY_PLANE: f64 = 0.20;

pub fn limit_of_plane() -> String {
    let percent = 100.0 * MISSED_BY_PLANE;
    format!(
        "A plane misses {percent:.0} % of the motion of a tongue in space (the median muscle; results/plane)."
    )
}
