//! Screening of recordings: points that jump, points in the wrong order, points beyond the palate. They are
//! removed before anything is fitted, and reported.

use serde::{Deserialize, Serialize};

use tongue_core::geometry::Point;
use tongue_core::statistics::median;

use super::dynamics::BONE_SD_M;
use super::{AlignedFrame, AlignedRecording};

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
    pub fn said(self) -> &'static str {
        match self {
            Self::Jumped => "jumped",
            Self::OutOfOrder => "exchanged",
            Self::BeyondPalate => "beyond the palate",
            Self::BoneMissing => "not seen",
            Self::FarFromFit => "far from the fit, left out",
        }
    }
}

/// A fault in a frame, and the points that have it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    pub kind: FaultKind,
    pub points: Vec<String>,
}

pub type Screened = Vec<Vec<Fault>>;

/// Number of frames on either side from which the position of a point is predicted.
const AROUND: usize = 3;
/// Smallest distance from the predicted position that counts as a jump, m.
const JUMP_M: f64 = 12e-3;
/// A jump must also be faster than this between two frames, m/s; the tip reaches about 0.5.
const FASTEST_M_S: f64 = 1.2;
/// The same of bones, which move less.
const BONE_JUMP_M: f64 = 8e-3;
const BONE_FASTEST_M_S: f64 = 0.6;
/// Smallest change of a point's distance from the middle between its neighbours on a contour, against the
/// frames around, that counts as a jump, m.
const SPIKE_M: f64 = 6e-3;
/// Limit of a residual, in standard deviations of the noise.
const MOST_SD: f64 = 4.0;
/// Largest number of points of a contour of keypoints; the order of longer contours is not checked.
const MOST_ORDERED: usize = 40;

/// Removes implausible points from a recording and returns the faults. `palate`: a line of points from front
/// to back, m.
pub fn screen(seen: &mut AlignedRecording, palate: Option<&[Point]>) -> Screened {
    let mut faults: Screened = vec![Vec::new(); seen.frames.len()];
    for (frame, fault) in ordered(seen).into_iter().zip(&mut faults) {
        fault.extend(frame);
    }
    let apply = |seen: &mut AlignedRecording, faults: &[Vec<Fault>]| {
        for (frame, found) in seen.frames.iter_mut().zip(faults) {
            let named = |name: &String| found.iter().any(|f| f.points.contains(name));
            for (mark, _) in frame.contour.iter_mut().zip(&seen.contour).filter(|(_, n)| named(n)) {
                *mark = None;
            }
            for (mark, _) in frame.sensors.iter_mut().zip(&seen.sensors).filter(|(_, (n, _))| named(n)) {
                *mark = None;
            }
            for (bone, _) in frame.bones.iter_mut().zip(&seen.bones).filter(|(_, n)| named(n)) {
                *bone = None;
            }
        }
    };
    apply(seen, &faults);
    let points = seen.contour.len() + seen.sensors.len();
    let sensors = seen.sensors.iter().map(|(name, _)| name);
    let names: Vec<String> = seen.contour.iter().chain(sensors).chain(&seen.bones).cloned().collect();
    let name = |p: usize| names[p].clone();
    let mut found: Vec<Vec<Fault>> = vec![Vec::new(); faults.len()];
    for (f, fault) in found.iter_mut().enumerate() {
        let spikes = spikes(seen, f);
        let has_moved = |p: &usize| has_jumped(seen, f, *p) || spikes.contains(p);
        let jumped: Vec<String> = (0..names.len()).filter(has_moved).map(name).collect();
        if !jumped.is_empty() {
            fault.push(Fault { kind: FaultKind::Jumped, points: jumped });
        }
        let beyond = |p: &usize| {
            let (Some(palate), Some(mark)) = (palate, mark(seen, f, *p)) else { return false };
            above(palate, mark.at).is_some_and(|by| by > 2.0 * mark.sd)
        };
        let beyond: Vec<String> = (0..points).filter(beyond).map(name).collect();
        if !beyond.is_empty() {
            fault.push(Fault { kind: FaultKind::BeyondPalate, points: beyond });
        }
    }
    apply(seen, &found);
    for (f, (fault, more)) in faults.iter_mut().zip(found).enumerate() {
        fault.extend(more);
        let missing: Vec<String> = (0..seen.bones.len())
            .filter(|&b| seen.frames[f].bones[b].is_none())
            .map(|b| seen.bones[b].clone())
            .filter(|name| !fault.iter().any(|f| f.points.contains(name)))
            .collect();
        if !missing.is_empty() {
            fault.push(Fault { kind: FaultKind::BoneMissing, points: missing });
        }
    }
    faults
}

/// A point of a frame: of the contour, then sensors, then bones.
fn mark(seen: &AlignedRecording, frame: usize, point: usize) -> Option<super::Mark> {
    let AlignedFrame { contour, sensors, bones, .. } = &seen.frames[frame];
    let bones = bones.iter().map(|bone| bone.map(|at| super::Mark { at, sd: BONE_SD_M }));
    contour.iter().chain(sensors).copied().chain(bones).nth(point).flatten()
}

/// How far a position in a frame is from its median over the frames around, m, and the time to the nearest of
/// these, s; `None` where it is known in fewer than two of them.
fn departure(
    seen: &AlignedRecording,
    frame: usize,
    position: impl Fn(usize) -> Option<Point>,
) -> Option<(f64, f64)> {
    let here = position(frame)?;
    let before = (0..frame).rev().filter_map(|f| Some((f, position(f)?))).take(AROUND);
    let after = (frame + 1..seen.frames.len()).filter_map(|f| Some((f, position(f)?))).take(AROUND);
    let near: Vec<(usize, Point)> = before.chain(after).collect();
    if near.len() < 2 {
        return None;
    }
    let middle = |axis: usize| median(near.iter().map(|(_, p)| p[axis]));
    let apart = |f: usize| (seen.frames[f].time_s - seen.frames[frame].time_s).abs();
    let nearest = near.iter().map(|(f, _)| apart(*f)).fold(f64::INFINITY, f64::min);
    Some(((here - Point::new(middle(0)?, middle(1)?)).norm(), nearest))
}

/// How much farther a point is from the middle between its neighbours on the contour than in the frames
/// around, m.
fn spike_height(seen: &AlignedRecording, frame: usize, point: usize) -> Option<f64> {
    let neighbours = [point.checked_sub(1)?, point, point + 1];
    let from_middle = |f: usize| {
        let [before, here, after] = neighbours.map(|p| seen.frames[f].contour.get(p).copied().flatten());
        Some(here?.at - (before?.at + after?.at) / 2.0)
    };
    Some(departure(seen, frame, from_middle)?.0)
}

/// Points that stand out of the contour of a frame but not of those of the frames around. If most points do,
/// the whole contour is wrong: none is named, and the fit reports the frame.
fn spikes(seen: &AlignedRecording, frame: usize) -> Vec<usize> {
    let contour = &seen.frames[frame].contour;
    let heights: Vec<f64> = (0..contour.len()).map(|p| spike_height(seen, frame, p).unwrap_or(0.0)).collect();
    let limit = |sd: f64| SPIKE_M + MOST_SD * 1.5_f64.sqrt() * sd;
    let mut out: Vec<usize> =
        (0..heights.len()).filter(|&p| contour[p].is_some_and(|mark| heights[p] > limit(mark.sd))).collect();
    if 2 * out.len() > heights.len() {
        return Vec::new();
    }
    // A point that is off also makes its neighbours stand out, by half as much.
    out.retain(|&p| {
        let mut beside = p.checked_sub(1).into_iter().chain([p + 1]).filter(|&q| q < heights.len());
        beside.all(|q| heights[q] < heights[p] && !has_jumped(seen, frame, q))
    });
    out
}

fn has_jumped(seen: &AlignedRecording, frame: usize, point: usize) -> bool {
    let position = |f: usize| Some(mark(seen, f, point)?.at);
    let Some((here, (away, nearest))) = mark(seen, frame, point).zip(departure(seen, frame, position)) else {
        return false;
    };
    let (jump_m, fastest_m_s) = match point < seen.contour.len() + seen.sensors.len() {
        true => (JUMP_M, FASTEST_M_S),
        false => (BONE_JUMP_M, BONE_FASTEST_M_S),
    };
    away > jump_m.max(fastest_m_s * nearest) + MOST_SD * here.sd
}

/// Frames in which exchanging two points makes the contour shorter by more than noise.
fn ordered(seen: &AlignedRecording) -> Vec<Option<Fault>> {
    let fault = |frame: &AlignedFrame| {
        let at: Vec<(usize, super::Mark)> =
            frame.contour.iter().enumerate().filter_map(|(i, m)| Some((i, (*m)?))).collect();
        if !(4..=MOST_ORDERED).contains(&at.len()) {
            return None;
        }
        let mut places: Vec<Point> = at.iter().map(|(_, m)| m.at).collect();
        let length = |p: &[Point]| p.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        let now = length(&places);
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..places.len() {
            for j in i + 1..places.len() {
                places.swap(i, j);
                let gain = now - length(&places);
                places.swap(i, j);
                if best.is_none_or(|(g, _, _)| gain > g) {
                    best = Some((gain, i, j));
                }
            }
        }
        let (gain, i, j) = best?;
        // A point that jumped makes the contour long in any order: it is reported as a jump.
        let noise = at[i].1.sd.max(at[j].1.sd);
        let mut swapped = places.clone();
        swapped.swap(i, j);
        let steps: Vec<f64> = swapped.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        let regular =
            steps.iter().fold(0.0, |a: f64, b| a.max(*b)) < 4.0 * length(&swapped) / steps.len() as f64;
        (gain > MOST_SD * noise && regular).then(|| Fault {
            kind: FaultKind::OutOfOrder,
            points: vec![seen.contour[at[i].0].clone(), seen.contour[at[j].0].clone()],
        })
    };
    seen.frames.iter().map(fault).collect()
}

/// Height of a point above a palate at its x, m; `None` in front of and behind it.
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
