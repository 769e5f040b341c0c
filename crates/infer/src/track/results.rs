//! Results for a frame: levels and courses of tensions with their 95 % intervals, displacements of bones, and reasons for doubt.

use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

use super::draws::{FrameDraws, Means};
use super::formants::{self, TrackedFormant};
use super::frame::{self, FrameSolver};
use super::ornstein_uhlenbeck::Softplus;
use super::reachability::{Reachability, Reached};
use super::settings::TrackSettings;
use super::smoother::SmoothedRecording;
use crate::error_model::Along;
use crate::inverse::BONE_SD_M;
use tongue_core::statistics::mean_and_variance;
use tongue_input::measured::recording::Fault;

/// A frame whose points are missed by more than this is no result: root mean square distance in standard deviations of the points. The same
/// in standard deviations that include the errors of the body is out of reach.
const MISSED_SD: f64 = 3.0;
/// The same as a distance from the placed body, m: twice the standard deviation of its place. The linearisation does not hold for larger
/// distances.
const REACH_M: f64 = 10e-3;
/// Tensions from this multiple of the scale on are reported as at the bound.
const BOUND: f64 = 5.4;
/// A direction of tensions is resolved if its standard deviation is below this part of the prior's.
const RESOLVED: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    /// Tensions were found and there is no reason for doubt.
    Converged,
    /// A tension is at its upper bound.
    AtBound,
    /// The frame and its neighbours resolve no direction of the tensions: the result is that of the prior.
    Unresolved,
    /// There are no observations: the tensions follow from the frames around it and the prior.
    Gap,
    /// The most probable shape misses the observations by more than three times their standard deviation.
    PoorFit,
    /// The observations cannot be reached by this body, or are wrong.
    OutOfReach,
    /// No way was found in which a speaker could reach the equilibrium: not from rest, with all muscles together or some before the
    /// others, and not from the posture before or after it.
    #[serde(rename = "off_branch")]
    NotReached,
}

impl FrameStatus {
    /// Whether the intervals of a frame can be trusted. Those of an unresolved frame and of one without data are wide.
    pub fn is_trusted(self) -> bool {
        matches!(self, Self::Converged | Self::Unresolved | Self::Gap)
    }
}

/// A shape that is reached from rest replaces one that is not if its distance from the observations is larger by no more than this, m: less
/// than the noise of a point.
const AS_WELL_M: f64 = 0.3e-3;

/// The displacement found for a bone that was not observed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// Shift from its place at rest, m.
    pub shift_m: [f64; 2],
    /// Lower ends of the ranges of 95 % of the draws of both coordinates, m. On a body that is known they hold 76 to 97 % of the true ones
    /// (docs/model.md, Coverage).
    pub low_m: [f64; 2],
    /// Upper ends of these ranges, m.
    pub high_m: [f64; 2],
}

/// A held-out point: its distance from the place that the fit predicts, with the interval of that prediction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldOutPrediction {
    pub point: String,
    /// Distance of the point from its predicted place, m: across the contour; for a coil, which is reported once for each axis, along
    /// that axis.
    pub missed_m: f64,
    /// Ends of the 95 % interval of that distance, m; `None` where too few points beside it were seen to judge by.
    pub interval_m: Option<[f64; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tracked {
    pub time_s: f64,
    pub status: FrameStatus,
    /// Tensions of the contracting muscles, N per metre of thickness.
    pub levels: Vec<Interval>,
    /// The tensions less their mean over the recording in the same draw, N per metre of thickness.
    pub courses: Vec<Interval>,
    /// Displacements of the freed bones, m.
    pub bones: Vec<Displacement>,
    /// Root mean square distance of the fitted observations from the most probable shape, m; `None` if there are none.
    pub rms_m: Option<f64>,
    /// The same in standard deviations of the observations, as they are given.
    #[serde(default)]
    pub rms_sd: Option<f64>,
    /// The held-out points.
    pub hidden: Vec<HeldOutPrediction>,
    /// Number of directions of the tensions whose standard deviation is below half of the prior's.
    pub resolved: usize,
    /// Whether the shape is reached in another way than by growing all tensions together.
    #[serde(default)]
    pub other_way: bool,
    /// For a frame whose own shape cannot be reached: root mean square distance of the fitted observations from the nearest shape that is
    /// reached, m. If that meets them as well, the positions and formants are of it; its tensions differ a little from the levels.
    #[serde(default)]
    pub reached_rms_m: Option<f64>,
    /// Positions of all nodes, m; empty where they were not asked for ([`TrackSettings::shapes`]).
    pub positions: Vec<SVector<f64, 2>>,
    /// Its lowest formants, if they are wanted ([`add_formants()`](super::add_formants())); empty where there is no airway or the frame has
    /// no data.
    #[serde(default)]
    pub formants: Vec<TrackedFormant>,
    /// Faults that the fit found in the observations of the frame.
    pub faults: Vec<Fault>,
}

impl Tracked {
    /// Medians of the tensions, N per metre of thickness.
    pub fn tensions_n(&self) -> Vec<f64> {
        self.levels.iter().map(|l| l.median).collect()
    }
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackedRecording {
    /// Positions of all nodes of the displayed body at rest, m: the body with its most probable shape.
    pub rest: Vec<SVector<f64, 2>>,
    pub frames: Vec<Tracked>,
    pub segments: Vec<LabelMean>,
    /// Draws of the means over labels that are compared.
    #[serde(default)]
    pub compared: Vec<LabelDraws>,
    /// Draws of the tensions over labels, where they were asked for ([`TrackSettings::kept_draws`]).
    #[serde(default)]
    pub label_courses: Vec<LabelCourse>,
}

/// A frame after the search, with all that its results need.
pub(super) struct FrameSolution<'a> {
    /// Its recording, found on the body with the most probable shape, and its number there.
    pub recording: &'a SmoothedRecording,
    pub t: usize,
    /// Its unknowns on that body.
    pub x: &'a DVector<f64>,
    /// Positions of all nodes of the body as it was placed, m; hidden points are predicted with them.
    pub placed: Option<&'a [SVector<f64, 2>]>,
    /// How its shape can be reached, if that is known.
    pub way: Option<&'a Reachability>,
    /// Predictions of its hidden points, where there are enough others for them.
    pub predicted: &'a [Option<HeldOutPrediction>],
    /// Whether its observations cannot be right.
    pub lost: bool,
    /// Means over the recording.
    pub means: &'a Means,
}

/// Results for a frame, without its faults.
pub(super) fn tracked(
    solver: &mut FrameSolver<'_>,
    found: &FrameSolution<'_>,
    draws: &FrameDraws,
    settings: &TrackSettings,
) -> Tracked {
    let &FrameSolution { recording, t, x, placed, lost, means, .. } = found;
    let (frame, here) = (&recording.frames[t], &recording.here[t]);
    let tensions = &draws.tensions;
    let levels: Vec<Interval> = tensions.iter().map(|d| interval(d).or_slack(&settings.link)).collect();
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
    let nearest = match found.way {
        Some(Reachability::Nearest(there)) => Some((there, frame::residuals(frame, there))),
        _ => None,
    };
    let reached_rms_m = nearest.as_ref().map(|(_, residuals)| rms(residuals));
    let is_lost = matches!(found.way, Some(Reachability::Lost));
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
    } else if levels.iter().any(|l| l.median >= BOUND * settings.link.scale_n()) {
        FrameStatus::AtBound
    } else if resolved == 0 {
        FrameStatus::Unresolved
    } else {
        FrameStatus::Converged
    };
    let hidden = frame.hidden.iter().zip(found.predicted).map(|(hidden, predicted)| {
        let missed_m = placed.map_or(f64::NAN, |placed| hidden.observation.residual(placed));
        predicted.clone().unwrap_or_else(|| HeldOutPrediction {
            point: hidden.name.clone(),
            missed_m,
            interval_m: None,
        })
    });
    Tracked {
        time_s: frame.time_s,
        status,
        courses,
        bones: bones.collect(),
        rms_m: if status == FrameStatus::NotReached { rms_m } else { reached_rms_m.or(rms_m) },
        rms_sd: is_seen.then_some(rms_sd),
        other_way: matches!(found.way, Some(Reachability::Own(Reached::OtherWay))),
        reached_rms_m,
        hidden: hidden.collect(),
        resolved,
        levels,
        formants: formants::tracked_formants(frame, &positions, &draws.formants),
        positions: if settings.is_shown(t, recording.frames.len()) { positions } else { Vec::new() },
        faults: Vec::new(),
    }
}

fn interval(draws: &[f32]) -> Interval {
    Interval::of(draws.iter().map(|d| f64::from(*d)))
}

/// Number of directions of tensions that the draws resolve.
fn resolved(tensions: &[Vec<f32>], prior_sd_n: f64) -> usize {
    let n = tensions.len();
    let means: Vec<f64> = tensions.iter().map(|t| mean(t)).collect();
    let count = tensions.first().map_or(1, Vec::len).max(1) as f64;
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let pairs = tensions[i].iter().zip(&tensions[j]);
        let sum: f64 = pairs.map(|(a, b)| (f64::from(*a) - means[i]) * (f64::from(*b) - means[j])).sum();
        sum / count / prior_sd_n.powi(2)
    });
    covariance.symmetric_eigenvalues().iter().filter(|v| **v < RESOLVED * RESOLVED).count()
}

fn mean(draws: &[f32]) -> f64 {
    draws.iter().map(|d| f64::from(*d)).sum::<f64>() / draws.len().max(1) as f64
}

/// Probabilities of the quantiles: the lower end, the median and the upper end of a 95 % interval.
const TAILS: [f64; 3] = [0.025, 0.5, 0.975];

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    pub median: f64,
    pub low: f64,
    pub high: f64,
    pub variance: f64,
}

impl Interval {
    /// The summary of draws; all values are NaN if there are none.
    pub fn of(draws: impl Iterator<Item = f64>) -> Self {
        let mut all: Vec<f64> = draws.collect();
        let count = all.len() as f64;
        let (_, variance) = mean_and_variance(all.iter().copied());
        let mut quantiles = [f64::NAN; 3];
        // Draws below `done` are in their final order, which is all that the next quantile needs.
        let mut done = 0;
        for (quantile, part) in quantiles.iter_mut().zip(TAILS) {
            let at = (part * count - 0.5).clamp(0.0, (count - 1.0).max(0.0));
            let below = at as usize;
            for place in [below, (below + 1).min(all.len().saturating_sub(1))] {
                if place >= done && place < all.len() {
                    all[done..].select_nth_unstable_by(place - done, |a, b| a.total_cmp(b));
                    done = place + 1;
                }
            }
            let (a, b) = (all.get(below), all.get(below + 1).or(all.get(below)));
            *quantile = a.zip(b).map_or(f64::NAN, |(a, b)| a + (at - below as f64) * (b - a));
        }
        let [low, median, high] = quantiles;
        Self { median, low, high, variance }
    }

    /// For a tension: an interval that begins below the bend of the link is extended to 0. The bend keeps derivatives smooth, but a slack
    /// muscle cannot be distinguished there from one that pulls weakly.
    pub(super) fn or_slack(mut self, link: &Softplus) -> Self {
        if self.low < link.slack_n() {
            self.low = 0.0;
        }
        self
    }

    pub fn width(&self) -> f64 {
        self.high - self.low
    }

    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// Mean tensions over the frames of a label that can be trusted. A body that is not quite the speaker's errs in every repetition of a
/// posture alike, so repetitions do not make the mean more certain: each draw deviates from it as one of the repetitions does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelDraws {
    /// Its number among the labels that are compared.
    pub compared: usize,
    pub repetitions: usize,
    pub frames: usize,
    /// Mean over frames and draws of every contracting muscle, N per metre of thickness.
    pub means: Vec<f64>,
    /// For every muscle and draw, the deviation of the mean over one repetition from its mean over all draws, N per metre of thickness.
    pub deviations: Vec<Vec<f32>>,
}

/// Means of all tensions over the frames of a label, less those over the recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelMean {
    pub label: usize,
    pub frames: usize,
    /// Changes of the contracting muscles, N per metre of thickness.
    pub changes: Vec<Interval>,
}

/// Draws of the tensions over one label, from its first frame to its last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelCourse {
    /// Its number among the labels of the recording.
    pub label: usize,
    /// At most eleven of its frames, evenly spread over all of them; without those that cannot be trusted.
    pub points: Vec<LabelPoint>,
}

/// Draws of a frame of a label, N per metre of thickness, for each muscle in the order of the draws of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LabelPoint {
    pub time_s: f64,
    /// Where in the label it lies: 0 at its first frame, 1 at its last.
    pub part: f64,
    pub tensions: Vec<Vec<f32>>,
    /// The tensions less their mean over the recording in the same draw.
    pub courses: Vec<Vec<f32>>,
}
