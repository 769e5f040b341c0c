//! What was found of a frame: levels and courses of tensions with their intervals, displacements of bones, and how far to believe them.

use nalgebra::{DMatrix, DVector, SVector};
use serde::{Deserialize, Serialize};

use crate::inverse::BONE_SD_M;
use tongue_input::measured::recording::Fault;

use super::branch::{Posture, Reached};
use super::consider::Draws;
use super::frame::{self, Frame, Linear, Solver};
use super::gesture::{Gesture, Segment};
use super::link::Link;
use super::settings::Settings;

/// A frame whose points are farther from the surface than this many standard deviations (root mean square) was not reached.
const REACH_SD: f64 = 3.0;
/// The same of a frame that the placed body misses by more than this (root mean square), m: twice the standard deviation of its place.
/// So far from where it was linearised the shape does not answer in straight lines.
const REACH_M: f64 = 10e-3;
/// A direction of tensions is resolved whose standard deviation is below this part of that of the prior.
const RESOLVED: f64 = 0.5;
/// Tails that a 95 % interval leaves.
const TAILS: [f64; 3] = [0.025, 0.5, 0.975];

/// How a frame ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameStatus {
    /// Found, and nothing speaks against it.
    Converged,
    /// A tension is at its upper bound.
    AtBound,
    /// The frame and its neighbours resolve no direction of the tensions: all is prior.
    Unresolved,
    /// Nothing was seen: the tensions are those of the frames around it and of the prior.
    Gap,
    /// What was seen cannot be reached by this body, or cannot be right.
    OutOfReach,
    /// No way was found on which a speaker reaches the equilibrium: not from rest, all muscles together or one before the others, and
    /// not from the posture before or after it.
    OffBranch,
}

/// A shape that is reached from rest meets what was seen of a frame off the branch if it misses it by no more than this on top, m: less
/// than the noise of a point.
const AS_WELL_M: f64 = 0.3e-3;

/// Where a bone was found that was not seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// From where it is at rest, m.
    pub shift_m: [f64; 2],
    /// Lower ends of the 95 % intervals, m.
    pub low_m: [f64; 2],
    /// Upper ends.
    pub high_m: [f64; 2],
}

/// A number with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ranged {
    /// The median of its draws.
    pub median: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Variance of the draws.
    pub variance: f64,
}

impl Ranged {
    /// Of draws; everything is NaN where there are none.
    pub fn of(draws: impl Iterator<Item = f64>) -> Self {
        let mut all: Vec<f64> = draws.collect();
        all.sort_by(f64::total_cmp);
        let count = all.len() as f64;
        let mean = all.iter().sum::<f64>() / count;
        let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
        let quantile = |part: f64| {
            let at = (part * count - 0.5).clamp(0.0, (count - 1.0).max(0.0));
            let below = at as usize;
            let (a, b) = (all.get(below), all.get(below + 1).or(all.get(below)));
            a.zip(b).map_or(f64::NAN, |(a, b)| a + (at - below as f64) * (b - a))
        };
        let [low, median, high] = TAILS.map(quantile);
        Self { median, low, high, variance }
    }

    /// Of a tension: an interval that begins where the link bends goes down to 0. The bend keeps derivatives smooth; there a slack
    /// muscle cannot be told from one that pulls a little.
    fn or_slack(mut self, link: &Link) -> Self {
        if self.low < link.slack_n() {
            self.low = 0.0;
        }
        self
    }

    /// Length of the interval.
    pub fn width(&self) -> f64 {
        self.high - self.low
    }

    /// Whether the interval holds a number.
    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// How far a held-out point was seen from where the fit predicts it, with the interval of that prediction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Foretold {
    /// Its name.
    pub point: String,
    /// Distance of the point from where it was expected, across the contour, m; of a coil, which is told once for each axis, along that.
    pub missed_m: f64,
    /// Ends of the 95 % interval of that distance, m.
    pub interval_m: [f64; 2],
}

/// What was found of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tracked {
    /// Time, s.
    pub time_s: f64,
    /// How it ended.
    pub status: FrameStatus,
    /// Tensions of the contracting muscles, N per metre of thickness.
    pub levels: Vec<Ranged>,
    /// The same less their mean over the recording, in the same draw.
    pub courses: Vec<Ranged>,
    /// Displacements of the freed bones, m.
    pub bones: Vec<Displacement>,
    /// Root mean square distance of what was fitted from the most probable shape, m; `None` where nothing was.
    pub rms_m: Option<f64>,
    /// The points that were kept back.
    pub hidden: Vec<Foretold>,
    /// Directions of the tensions whose standard deviation is below a half of the prior's.
    pub resolved: usize,
    /// Whether the shape is reached in another way than by pulling all muscles harder together.
    #[serde(default)]
    pub other_way: bool,
    /// Root mean square distance of what was fitted from the shape that is reached at the same tensions, m, of a frame whose own is not.
    #[serde(default)]
    pub reached_rms_m: Option<f64>,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, 2>>,
    /// What the fit found wrong with the frame.
    pub faults: Vec<Fault>,
}

impl Tracked {
    /// Medians of the tensions, N per metre of thickness.
    pub fn tensions_n(&self) -> Vec<f64> {
        self.levels.iter().map(|l| l.median).collect()
    }
}

/// What was found of a recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackedRecording {
    /// Every frame.
    pub frames: Vec<Tracked>,
    /// Its gestures.
    pub gestures: Vec<Gesture>,
    /// Its labelled stretches.
    pub segments: Vec<Segment>,
}

/// A frame that was found.
pub(super) struct Found<'a> {
    pub frame: &'a Frame,
    /// What it is solved with, on the body with the most probable shape.
    pub x: &'a DVector<f64>,
    /// `None` where there is no equilibrium, or no data.
    pub linear: Option<&'a Linear>,
    /// Positions of all nodes of the last equilibrium, m.
    pub positions: Option<&'a [SVector<f64, 2>]>,
    /// Positions of all nodes of the body as it was placed, with which hidden points are predicted, m.
    pub placed: Option<&'a [SVector<f64, 2>]>,
    /// The frames before and after it, with what they are solved with and their positions.
    pub neighbours: Vec<Posture<'a>>,
    /// Whether what was seen cannot be right.
    pub lost: bool,
    /// Means over the recording of the tension of every muscle, a number a draw.
    pub means: &'a [Vec<f64>],
    /// Number of the frame.
    pub number: usize,
}

/// What is to be said of it. `relaxed` is where the body rests with the bones of the frame before, and then with those of this one.
pub(super) fn tracked(
    solver: &mut Solver<'_>,
    relaxed: &mut Option<Vec<SVector<f64, 2>>>,
    found: &Found<'_>,
    draws: &Draws,
    settings: &Settings,
    faults: Vec<Fault>,
) -> Tracked {
    let &Found { frame, x, linear, placed, lost, means, number, .. } = found;
    let tensions = &draws.tensions[number];
    let of = |draws: &[f32]| Ranged::of(draws.iter().map(|d| f64::from(*d)));
    let levels: Vec<Ranged> = tensions.iter().map(|d| of(d).or_slack(&settings.link)).collect();
    let less = |(draws, means): (&Vec<f32>, &Vec<f64>)| {
        Ranged::of(draws.iter().zip(means).map(|(d, mean)| f64::from(*d) - mean))
    };
    let courses = tensions.iter().zip(means).map(less).collect();
    let shifts: Vec<Ranged> = draws.bones[number].iter().map(|d| of(d)).collect();
    let displacement = |pair: &[Ranged]| {
        let ends = |end: fn(&Ranged) -> f64| [end(&pair[0]) * BONE_SD_M, end(&pair[1]) * BONE_SD_M];
        Displacement { shift_m: ends(|r| r.median), low_m: ends(|r| r.low), high_m: ends(|r| r.high) }
    };
    let solved = match linear {
        Some(linear) => Some(linear.positions.clone()),
        None => solver.solve(frame, x, found.positions).map(<[_]>::to_vec),
    };
    let is_solved = solved.is_some();
    let mut positions = solved.unwrap_or_else(|| solver.system.rest().to_vec());
    let residuals = frame::residuals(frame, &positions);
    let rms = |residuals: &DVector<f64>| {
        let squares = residuals.iter().zip(&frame.observations).map(|(r, o)| (r / o.weight).powi(2));
        (squares.sum::<f64>() / residuals.len() as f64).sqrt()
    };
    let rms_m = (!frame.observations.is_empty()).then(|| rms(&residuals));
    let is_near = placed.is_none_or(|p| residuals.is_empty() || rms(&frame::residuals(frame, p)) < REACH_M);
    let far = residuals.iter().zip(&frame.observations).zip(&frame.along);
    let squares: f64 = far.map(|((r, o), a)| (1e3 * r / o.weight / settings.errors.sd(a)).powi(2)).sum();
    let rms_sd = (squares / residuals.len().max(1) as f64).sqrt();
    let resolved = resolved(tensions, settings.link.prior_sd_n());
    let (mut other_way, mut reached_rms_m) = (false, None);
    let mut is_off_branch = || {
        let reached = solver.reached((frame, x), &positions, &found.neighbours, relaxed);
        other_way = reached == Some(Reached::OtherWay);
        if reached.is_some() {
            return false;
        }
        let there = solver.workspace.positions();
        let missed = rms(&frame::residuals(frame, there));
        reached_rms_m = Some(missed);
        let as_well = rms_m.is_some_and(|own| missed <= own + AS_WELL_M);
        if as_well {
            positions = there.to_vec();
        }
        !as_well
    };
    let status = if lost || !is_solved || !is_near || rms_sd > REACH_SD {
        FrameStatus::OutOfReach
    } else if linear.is_none() {
        FrameStatus::Gap
    } else if settings.branch && is_off_branch() {
        FrameStatus::OffBranch
    } else if levels.iter().any(|l| l.median >= settings.upper_n) {
        FrameStatus::AtBound
    } else if resolved == 0 {
        FrameStatus::Unresolved
    } else {
        FrameStatus::Converged
    };
    let foretold = |(i, hidden): (usize, &frame::Hidden)| {
        let expected = of(&draws.hidden[number][i]);
        let seen = 1e3 * placed.map_or(f64::NAN, |placed| hidden.observation.residual(placed));
        Foretold {
            point: hidden.name.clone(),
            missed_m: 1e-3 * (seen - expected.median),
            interval_m: [expected.low, expected.high].map(|end| 1e-3 * (end - expected.median)),
        }
    };
    Tracked {
        time_s: frame.time_s,
        status,
        courses,
        bones: shifts.chunks_exact(2).map(displacement).collect(),
        rms_m: if status == FrameStatus::OffBranch { rms_m } else { reached_rms_m.or(rms_m) },
        other_way,
        reached_rms_m,
        hidden: frame.hidden.iter().enumerate().map(foretold).collect(),
        resolved,
        levels,
        positions,
        faults,
    }
}

/// Directions in which the draws of tensions lie close together.
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
