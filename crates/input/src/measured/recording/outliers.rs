//! Points of a recording that jump, are in the wrong order or lie beyond the palate, which are removed before anything is fitted, and
//! reported.

use serde::{Deserialize, Serialize};

use tongue_core::geometry::Point;

use super::flat::median_point;
use super::measures::length;
use super::{AlignedFrame, AlignedRecording, Mark};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// A point is far from its position in the neighbouring frames.
    Jumped,
    OutOfOrder,
    BeyondPalate,
    /// A bone was not seen; its position is taken from the nearest frames.
    BoneMissing,
    /// A point is farther from the fitted surface than its noise explains.
    FarFromFit,
}

impl FaultKind {
    pub fn label(self) -> &'static str {
        match self {
            Self::Jumped => "jumped",
            Self::OutOfOrder => "exchanged",
            Self::BeyondPalate => "beyond the palate",
            Self::BoneMissing => "not seen",
            Self::FarFromFit => "far from the fit, left out",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    pub kind: FaultKind,
    pub points: Vec<String>,
}

pub type RecordingFaults = Vec<Vec<Fault>>;

/// Number of frames on either side from which the position of a point is predicted.
const FRAMES_AROUND: usize = 3;
/// Smallest distance from the predicted position that counts as a jump, m.
const JUMP_M: f64 = 12e-3;
/// A jump is also faster than this from frame to frame, m/s; the tip reaches about 0.5 m/s.
const FASTEST_M_S: f64 = 1.2;
/// Smallest jump and speed of a bone, m and m/s: bones move less.
const BONE_JUMP_M: f64 = 8e-3;
const BONE_FASTEST_M_S: f64 = 0.6;
/// Smallest jump of a point relative to the middle of its neighbours on the contour, m.
const SPIKE_M: f64 = 6e-3;
/// Smallest residual of an outlier, in standard deviations of the noise.
const MOST_SD: f64 = 4.0;
/// The order of points is not checked in contours with more points, which are not of keypoints.
const MOST_ORDERED: usize = 40;

/// Removes implausible points and returns the faults of each frame. `palate` is a line of points from front to back, m.
pub fn remove_outliers(recording: &mut AlignedRecording, palate: Option<&[Point]>) -> RecordingFaults {
    let names: Vec<String> = recording.names().cloned().collect();
    let mut faults: RecordingFaults = vec![Vec::new(); recording.frames.len()];
    // Removes the points of one fault from all frames. `found` has their numbers for each frame.
    let mut remove = |recording: &mut AlignedRecording, kind: FaultKind, found: Vec<Vec<usize>>| {
        for ((frame, faults), points) in recording.frames.iter_mut().zip(&mut faults).zip(found) {
            points.iter().for_each(|p| frame.remove_point(*p));
            let points: Vec<String> = points.into_iter().map(|p| names[p].clone()).collect();
            faults.extend((!points.is_empty()).then_some(Fault { kind, points }));
        }
    };
    let out_of_order = recording.frames.iter().map(exchanged).collect();
    remove(recording, FaultKind::OutOfOrder, out_of_order);
    let jumped = (0..recording.frames.len()).map(|f| {
        let spikes = spikes(recording, f);
        (0..names.len()).filter(|p| has_jumped(recording, f, *p) || spikes.contains(p)).collect()
    });
    let jumped = jumped.collect();
    let beyond = recording.frames.iter().map(|frame| {
        let marks = frame.points().enumerate().filter_map(|(p, mark)| Some((p, mark?)));
        let over = marks.filter_map(|(p, mark)| (above(palate?, mark.at)? > 2.0 * mark.sd).then_some(p));
        over.collect()
    });
    let beyond = beyond.collect();
    remove(recording, FaultKind::Jumped, jumped);
    remove(recording, FaultKind::BeyondPalate, beyond);
    for (frame, faults) in recording.frames.iter().zip(&mut faults) {
        let unseen =
            recording.bones.iter().zip(&frame.bones).filter(|(_, at)| at.is_none()).map(|(name, _)| name);
        let points: Vec<String> =
            unseen.filter(|name| !faults.iter().any(|f| f.points.contains(name))).cloned().collect();
        if !points.is_empty() {
            faults.push(Fault { kind: FaultKind::BoneMissing, points });
        }
    }
    faults
}

/// Distance of a position from its median over the frames around, m, and the time to the nearest of these, s; `None` if it is unknown
/// in this frame or in all but one of those around.
fn departure(
    recording: &AlignedRecording,
    frame: usize,
    position: impl Fn(usize) -> Option<Point>,
) -> Option<(f64, f64)> {
    let here = position(frame)?;
    let before = (0..frame).rev().filter_map(|f| Some((f, position(f)?))).take(FRAMES_AROUND);
    let after =
        (frame + 1..recording.frames.len()).filter_map(|f| Some((f, position(f)?))).take(FRAMES_AROUND);
    let near: Vec<(usize, Point)> = before.chain(after).collect();
    if near.len() < 2 {
        return None;
    }
    let usual = median_point(near.iter().map(|(_, p)| *p))?;
    let apart =
        near.iter().map(|(f, _)| (recording.frames[*f].time_s - recording.frames[frame].time_s).abs());
    Some(((here - usual).norm(), apart.fold(f64::INFINITY, f64::min)))
}

/// How far a point is from the middle of its neighbours on the contour, compared with the frames around, m.
fn spike_height(recording: &AlignedRecording, frame: usize, point: usize) -> Option<f64> {
    let neighbours = [point.checked_sub(1)?, point, point + 1];
    let departure = departure(recording, frame, |f| {
        let [before, here, after] = neighbours.map(|p| recording.frames[f].contour.get(p).copied().flatten());
        Some(here?.at - (before?.at + after?.at) / 2.0)
    });
    Some(departure?.0)
}

/// Points that stand out of the contour of a frame but not of those of the frames around; none if most points do: then the whole contour is
/// wrong, and the fit reports the frame.
fn spikes(recording: &AlignedRecording, frame: usize) -> Vec<usize> {
    let contour = &recording.frames[frame].contour;
    let heights: Vec<f64> =
        (0..contour.len()).map(|p| spike_height(recording, frame, p).unwrap_or(0.0)).collect();
    let mut out = Vec::from_iter((0..heights.len()).filter(|&p| {
        contour[p].is_some_and(|mark| heights[p] > SPIKE_M + MOST_SD * 1.5_f64.sqrt() * mark.sd)
    }));
    if 2 * out.len() > heights.len() {
        return Vec::new();
    }
    // A displaced point makes its neighbours stand out, too, by half as much.
    out.retain(|&p| {
        let mut beside = p.checked_sub(1).into_iter().chain([p + 1]).filter(|&q| q < heights.len());
        beside.all(|q| heights[q] < heights[p] && !has_jumped(recording, frame, q))
    });
    out
}

fn has_jumped(recording: &AlignedRecording, frame: usize, point: usize) -> bool {
    let mark = |f: usize| recording.frames[f].all().nth(point).flatten();
    let Some((here, (away, nearest))) = mark(frame).zip(departure(recording, frame, |f| Some(mark(f)?.at)))
    else {
        return false;
    };
    let (jump_m, fastest_m_s) = if point < recording.contour.len() + recording.sensors.len() {
        (JUMP_M, FASTEST_M_S)
    } else {
        (BONE_JUMP_M, BONE_FASTEST_M_S)
    };
    away > jump_m.max(fastest_m_s * nearest) + MOST_SD * here.sd
}

/// Two points of a contour whose exchange makes it shorter by more than noise.
fn exchanged(frame: &AlignedFrame) -> Vec<usize> {
    let points = frame.contour.iter().enumerate().filter_map(|(i, m)| Some((i, (*m)?)));
    let points: Vec<(usize, Mark)> = points.collect();
    if !(4..=MOST_ORDERED).contains(&points.len()) {
        return Vec::new();
    }
    let mut places: Vec<Point> = points.iter().map(|(_, m)| m.at).collect();
    let now = length(&places);
    let (mut most, mut i, mut j) = (f64::NEG_INFINITY, 0, 0);
    for a in 0..places.len() {
        for b in a + 1..places.len() {
            places.swap(a, b);
            let gain = now - length(&places);
            places.swap(a, b);
            if gain > most {
                (most, i, j) = (gain, a, b);
            }
        }
    }
    // A point that jumped makes the contour long in any order, and is reported as a jump.
    places.swap(i, j);
    let longest = places.windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
    let is_regular = longest < 4.0 * length(&places) / (places.len() - 1) as f64;
    let noise = points[i].1.sd.max(points[j].1.sd);
    if most > MOST_SD * noise && is_regular { vec![points[i].0, points[j].0] } else { Vec::new() }
}

/// Height of a point above the palate at its x, m; `None` in front of the palate and behind it.
pub(super) fn above(palate: &[Point], p: Point) -> Option<f64> {
    let heights = palate.windows(2).filter_map(|w| {
        let (a, b) = if w[0].x <= w[1].x { (w[0], w[1]) } else { (w[1], w[0]) };
        if !(a.x..=b.x).contains(&p.x) || a.x == b.x {
            return None;
        }
        Some(a.y + (p.x - a.x) / (b.x - a.x) * (b.y - a.y))
    });
    let roof = heights.fold(f64::NEG_INFINITY, f64::max);
    roof.is_finite().then(|| p.y - roof)
}
