//! Results for a frame: tensions and their courses with 95 % intervals, displacements of bones, and alarms.

use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

use super::draws::{FrameDraws, Means};
use super::formants::{self, TrackedFormant};
use super::frame::{self, FrameSolver};
use super::interval::{Interval, interval};
use super::reachability::Reachability;
use super::settings::TrackSettings;
use super::smoother::SmoothedRecording;
use crate::error_model::Along;
use crate::inverse::BONE_SD_M;
use tongue_input::measured::recording::Fault;

/// Largest root mean square residual of a result, in standard deviations of the points; above it a fit is poor. In standard deviations that
/// include the errors of the body, the frame is out of reach above it.
const MISSED_SD: f64 = 3.0;
/// Largest root mean square distance of the observations from the placed body, m: twice the standard deviation of its place, beyond which
/// the linearisation does not hold.
const REACH_M: f64 = 10e-3;
/// Tensions above this multiple of the scale are reported as at the bound.
const BOUND: f64 = 5.4;
/// A direction of tensions is resolved if its standard deviation is below this part of the prior's.
const RESOLVED: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    Converged,
    /// A tension is at its upper bound.
    AtBound,
    /// The frame and its neighbours resolve no direction of the tensions, so the result is that of the prior.
    Unresolved,
    /// There are no observations, so tensions follow from the frames around it and the prior.
    Gap,
    /// The shape misses the observations by more than three standard deviations.
    PoorFit,
    /// The observations cannot be reached by this body, or are wrong.
    OutOfReach,
    /// The equilibrium was reached neither from rest, with muscles together or some before others, nor from a neighbouring frame, and no
    /// shape that was reached meets the observations as well.
    /// JSON keeps the older key `off_branch`, although a jump off the branch does not count as one.
    #[serde(rename = "off_branch")]
    NotReached,
}

impl FrameStatus {
    /// Whether the intervals of a frame can be trusted; those of an unresolved frame and of a gap are wide.
    pub fn is_trusted(self) -> bool {
        matches!(self, Self::Converged | Self::Unresolved | Self::Gap)
    }
}

/// Addition to the distance from the observations, m, up to which a reached shape replaces one that is not; less than a point's noise.
const AS_WELL_M: f64 = 0.3e-3;

/// Displacement found for a bone that was not observed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    pub shift_m: [f64; 2],
    /// Lower ends of the ranges of 95 % of the draws of both coordinates, m. On a known body they hold 88 to 96 % of the true values
    /// (docs/model.md, Coverage).
    pub low_m: [f64; 2],
    pub high_m: [f64; 2],
}

/// Distance of a held-out point from its predicted place, with the interval of that prediction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldOutPrediction {
    pub point: String,
    /// Distance of the point from its predicted place, m: across the contour, or along an axis for a coil, which is reported for each axis.
    pub missed_m: f64,
    /// 95 % interval of that distance, m; `None` where too few points beside it were seen.
    pub interval_m: Option<[f64; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tracked {
    pub time_s: f64,
    pub status: FrameStatus,
    /// Tensions of the contracting muscles, N per metre of thickness.
    #[serde(rename = "levels")]
    pub tensions: Vec<Interval>,
    /// Tensions less their mean over the recording in the same draw, N per metre of thickness.
    pub courses: Vec<Interval>,
    pub bones: Vec<Displacement>,
    /// Root mean square distance of the fitted observations from the most probable shape, m; `None` without observations.
    pub rms_m: Option<f64>,
    /// Root mean square residual in standard deviations of the observations.
    pub rms_sd: Option<f64>,
    pub hidden: Vec<HeldOutPrediction>,
    /// Number of directions of the tensions whose standard deviation is below half of the prior's.
    pub resolved: usize,
    /// Whether the shape is reached in another way than by growing all tensions together.
    pub other_way: bool,
    /// Where the shape cannot be reached: root mean square distance of the fitted observations from the nearest shape that is, m. If that
    /// meets them as well, positions and formants are those of it, and its tensions differ a little from `tensions`.
    pub reached_rms_m: Option<f64>,
    /// Positions of all nodes, m; empty where they are not wanted ([`TrackSettings::shapes`]).
    pub positions: Vec<SVector<f64, 2>>,
    /// The lowest formants, if they are wanted ([`add_formants()`](super::add_formants())); empty where the tract is closed or the frame
    /// has no data.
    pub formants: Vec<TrackedFormant>,
    /// Faults that the fit found in the observations.
    pub faults: Vec<Fault>,
}

impl Tracked {
    /// Medians of the tensions, N per metre of thickness.
    pub fn tensions_n(&self) -> Vec<f64> {
        self.tensions.iter().map(|l| l.median).collect()
    }
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackedRecording {
    /// Positions of all nodes of the displayed body at rest, m.
    pub rest: Vec<SVector<f64, 2>>,
    pub frames: Vec<Tracked>,
    pub segments: Vec<LabelMean>,
    /// Draws of the means over labels that are compared.
    pub compared: Vec<LabelDraws>,
    /// Draws of the tensions over labels, where they are wanted ([`TrackSettings::kept_draws`]).
    pub label_courses: Vec<LabelCourse>,
}

pub(super) struct FrameSolution<'a> {
    /// Its recording on the body with the most probable shape, and its number there.
    pub recording: &'a SmoothedRecording,
    pub t: usize,
    /// Its unknowns on that body.
    pub x: &'a DVector<f64>,
    /// Positions of all nodes of the placed body, m.
    pub placed: Option<&'a [SVector<f64, 2>]>,
    pub reachability: Option<&'a Reachability>,
    /// Whether its observations cannot be right.
    pub lost: bool,
    pub means: &'a Means,
}

/// Results for a frame, without its hidden points and faults.
pub(super) fn frame_result(
    solver: &mut FrameSolver<'_>,
    found: &FrameSolution<'_>,
    draws: &FrameDraws,
    settings: &TrackSettings,
) -> Tracked {
    let &FrameSolution { recording, t, x, placed, lost, means, .. } = found;
    let (frame, here) = (&recording.frames[t], &recording.here[t]);
    let tensions = &draws.tensions;
    let courses = tensions
        .iter()
        .zip(&means.0)
        .map(|(draws, means)| Interval::of(draws.iter().zip(means).map(|(d, mean)| f64::from(*d) - mean)))
        .collect();
    let shifts: Vec<Interval> = draws.bones.iter().map(|d| interval(d)).collect();
    let bones = shifts.chunks_exact(2).map(|pair| {
        let ends = |end: fn(&Interval) -> f64| [end(&pair[0]) * BONE_SD_M, end(&pair[1]) * BONE_SD_M];
        Displacement { shift_m: ends(|r| r.median), low_m: ends(|r| r.low), high_m: ends(|r| r.high) }
    });
    let solved = match &here.linear {
        Some(linear) => Some(linear.positions.to_vec()),
        None => solver.solve(frame, x, here.positions.as_deref()).map(<[_]>::to_vec),
    };
    let is_solved = solved.is_some();
    let mut positions = solved.unwrap_or_else(|| solver.system.rest().to_vec());
    let residuals = frame::residuals(frame, &positions);
    let rms = |residuals: &DVector<f64>| {
        let squares =
            residuals.iter().zip(&frame.observations).map(|(r, o)| (r / o.observation.weight).powi(2));
        (squares.sum::<f64>() / residuals.len() as f64).sqrt()
    };
    let in_sd = |residuals: &DVector<f64>, sd: &dyn Fn(&Along) -> f64| {
        let far = residuals.iter().zip(&frame.observations);
        let squares: f64 = far.map(|(r, o)| (1e3 * r / o.observation.weight / sd(&o.along)).powi(2)).sum();
        (squares / residuals.len().max(1) as f64).sqrt()
    };
    let is_seen = !frame.observations.is_empty();
    let rms_m = is_seen.then(|| rms(&residuals));
    let is_near = placed.is_none_or(|p| residuals.is_empty() || rms(&frame::residuals(frame, p)) < REACH_M);
    let is_met = in_sd(&residuals, &|a| settings.errors.sd(a)) <= MISSED_SD;
    let resolved = resolved(tensions, settings.link.prior_sd_n());
    let nearest = match found.reachability {
        Some(Reachability::Nearest(there)) => Some((there, frame::residuals(frame, there))),
        _ => None,
    };
    let reached_rms_m = nearest.as_ref().map(|(_, residuals)| rms(residuals));
    let is_lost = matches!(found.reachability, Some(Reachability::Lost));
    let as_well = !is_lost && reached_rms_m.zip(rms_m).is_none_or(|(there, own)| there <= own + AS_WELL_M);
    let nearest = nearest.filter(|_| as_well);
    let rms_sd = in_sd(nearest.as_ref().map_or(&residuals, |(_, there)| there), &|a| a.sd_mm);
    if let Some((there, _)) = nearest {
        positions.clone_from(there);
    }
    let status = if lost || !is_solved || !is_near || !is_met {
        FrameStatus::OutOfReach
    } else if here.linear.is_none() {
        FrameStatus::Gap
    } else if !as_well {
        FrameStatus::NotReached
    } else if rms_sd > MISSED_SD {
        FrameStatus::PoorFit
    } else if draws.intervals.iter().any(|l| l.median >= BOUND * settings.link.scale_n()) {
        FrameStatus::AtBound
    } else if resolved == 0 {
        FrameStatus::Unresolved
    } else {
        FrameStatus::Converged
    };
    Tracked {
        time_s: frame.time_s,
        status,
        courses,
        bones: bones.collect(),
        rms_m: if status == FrameStatus::NotReached { rms_m } else { reached_rms_m.or(rms_m) },
        rms_sd: is_seen.then_some(rms_sd),
        other_way: matches!(found.reachability, Some(Reachability::OtherWay)),
        reached_rms_m,
        hidden: Vec::new(),
        resolved,
        tensions: draws.intervals.clone(),
        formants: formants::tracked_formants(frame, &positions, &draws.formants),
        positions: if settings.is_shown(t, recording.frames.len()) { positions } else { Vec::new() },
        faults: Vec::new(),
    }
}

fn resolved(tensions: &[Vec<f32>], prior_sd_n: f64) -> usize {
    let n = tensions.len();
    let count = tensions.first().map_or(1, Vec::len).max(1) as f64;
    let sum = |draws: &Vec<f32>| draws.iter().map(|d| f64::from(*d)).sum::<f64>();
    let means: Vec<f64> = tensions.iter().map(|draws| sum(draws) / count).collect();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let pairs = tensions[i].iter().zip(&tensions[j]);
        let sum: f64 = pairs.map(|(a, b)| (f64::from(*a) - means[i]) * (f64::from(*b) - means[j])).sum();
        sum / count / prior_sd_n.powi(2)
    });
    covariance.symmetric_eigenvalues().iter().filter(|v| **v < RESOLVED * RESOLVED).count()
}

/// Mean tensions over the trusted frames of a label. A body that differs from the speaker's errs in every repetition alike, so repetitions
/// do not make the mean more certain: each draw deviates from it as one of the repetitions does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelDraws {
    /// Its number among the labels that are compared.
    pub compared: usize,
    pub repetitions: usize,
    pub frames: usize,
    /// Mean over frames and draws of every contracting muscle, N per metre of thickness.
    pub means: Vec<f64>,
    /// For every muscle and draw, the mean over one repetition less its mean over all draws, N per metre of thickness.
    pub deviations: Vec<Vec<f32>>,
}

/// Mean tensions over the frames of a label less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    pub label: usize,
    pub frames: usize,
    /// Of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Interval>,
}

/// Draws of the tensions from the first frame of a label to its last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelCourse {
    pub label: usize,
    /// At most eleven of its frames, evenly spread; untrusted frames are left out.
    pub points: Vec<LabelPoint>,
}

/// Draws of a frame of a label for each muscle, N per metre of thickness, in the order of the draws of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelPoint {
    pub time_s: f64,
    /// Place in the label: 0 at its first frame, 1 at its last.
    pub part: f64,
    pub tensions: Vec<Vec<f32>>,
    /// Tensions less their mean over the recording in the same draw.
    pub courses: Vec<Vec<f32>>,
}
