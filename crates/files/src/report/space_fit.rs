//! The record of activations that move a body in space to measured points, and what a plane misses of such a motion.

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
    /// Why frames cannot be trusted; then the exit status is 3.
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
    /// Root mean square distance from what was measured; stretches and ratios are multiplied by the length at rest.
    pub rms_mm: f64,
    pub distances_mm: Vec<f64>,
    /// Activations, 0 to 1, of muscles, or of both sides under their common name.
    pub activations: ByMuscle<f64>,
    /// 95 % intervals that include the prior and a common factor of stiffness; empty without an equilibrium.
    pub interval_95: ByMuscle<[f64; 2]>,
    /// Combinations of activations that the data leave open, each with the standard deviation along it.
    pub open: Vec<Combination>,
    pub starts: Vec<EndedSearch>,
    /// Number of starts that ended at this answer.
    pub ended_here: usize,
    /// Answers of other starts that meet the data as well, with a misfit at most a twentieth larger.
    pub others_as_good: Vec<ByMuscle<f64>>,
    pub factorisations: usize,
    pub alarms: Vec<Alarm>,
}

/// Misfits that differ by at most this part count as equal.
const AS_GOOD: f64 = 0.05;
/// Data that a body misses by more, mm (RMS), have another unit or other axes.
const FARTHEST_MM: f64 = 15.0;

impl SpaceFitRecord {
    pub fn new(body: &Body<3>, recording: Option<String>, time_s: Option<f64>, fit: &SpaceFit) -> Self {
        let replay = &fit.answer.replay;
        let mut alarms = alarms::of_equilibrium(&replay.solution, replay.from_rest);
        let positions = &fit.answer.positions;
        alarms.extend(alarms::of_strain(&body.mesh, body.volume_ratios(positions), positions));
        if !fit.combinations.is_empty() && fit.combinations.iter().all(|c| c.sd > OPEN_ABOVE) {
            alarms.push(Alarm::NothingResolved);
        }
        let rms_mm = 1e3 * fit.rms_m;
        if rms_mm > FARTHEST_MM {
            alarms.push(Alarm::FarFromData { rms_mm });
        }
        Self {
            recording,
            time_s,
            status: fit.answer.status,
            rms_mm,
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

/// Part of the displacement of the midsagittal contour that a plane misses after the best scaling: the median over the muscles of the
/// built-in body in space (`results/plane`). A test of the studies compares it with their result.
pub const MISSED_BY_PLANE: f64 = 0.20;

pub fn limit_of_plane() -> String {
    let percent = 100.0 * MISSED_BY_PLANE;
    format!(
        "A plane misses {percent:.0} % of the motion of a tongue in space (the median muscle; results/plane)."
    )
}
