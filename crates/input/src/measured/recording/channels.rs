//! The courses of the channels of a recording over its frames, before their points are sorted into contour, coils and bones.

use tongue_core::geometry::{Point, Similarity};
use tongue_core::statistics::upper_median;

use super::Role;

/// Usual distance of the first coil behind the tip, m.
pub const FIRST_COIL_M: f64 = 8e-3;
/// Usual ratio of the distance of neighbouring coils along the surface to their straight distance.
pub const LONGER_THAN_CHORD: f64 = 1.03;

/// The incisors and the mental spine of the built-in body: from the coil below the lower incisors to the mental spine, m, in a head whose
/// axes are those of the recording.
const INCISORS_TO_SPINE_M: Point = Point::new(14e-3, -20e-3);

pub(super) fn median_x(frames: &[Vec<Option<Point>>], channel: usize) -> Option<f64> {
    upper_median(frames.iter().filter_map(|f| f[channel]).map(|p| p.x))
}

pub(super) fn median_place(frames: &[Vec<Option<Point>>], channel: usize) -> Option<Point> {
    median_point(frames.iter().filter_map(|f| f[channel]))
}

pub(super) fn median_point(points: impl Iterator<Item = Point>) -> Option<Point> {
    let all: Vec<Point> = points.collect();
    let [x, y] = [0, 1].map(|axis| upper_median(all.iter().map(|p| p[axis])));
    Some(Point::new(x?, y?))
}

/// Sorts coils from the tip backwards and returns the distance of each behind the tip, m: as measured, or the
/// usual value.
pub(super) fn places_of_coils(
    sensors: &mut [usize],
    roles: &[Role],
    frames: &[Vec<Option<Point>>],
) -> Vec<f64> {
    let nth = |c: usize| match roles[c] {
        Role::Coil(Some(nth)) => f64::from(nth),
        _ => f64::INFINITY,
    };
    let x = |c: usize| median_x(frames, c).unwrap_or(f64::INFINITY);
    if sensors.iter().any(|&c| matches!(roles[c], Role::Coil(_))) {
        sensors.sort_by(|&a, &b| nth(a).total_cmp(&nth(b)).then(x(a).total_cmp(&x(b))));
    }
    let mut out: Vec<f64> = Vec::with_capacity(sensors.len());
    for (n, &c) in sensors.iter().enumerate() {
        out.push(match (&roles[c], n.checked_sub(1)) {
            (Role::Surface(at), _) => *at,
            (_, None) => FIRST_COIL_M,
            (_, Some(before)) => {
                let gaps = frames.iter().filter_map(|f| Some((f[sensors[before]]? - f[c]?).norm()));
                out[before] + LONGER_THAN_CHORD * upper_median(gaps).unwrap_or(FIRST_COIL_M)
            }
        });
    }
    out
}

/// Whether the median motion of a channel in a tenth of a second is larger than a head's.
pub(super) fn moves_as_a_tongue(frames: &[Vec<Option<Point>>], times: &[f64], channel: usize) -> bool {
    const WINDOW_S: f64 = 0.1;
    const HEAD_MOVES_M: f64 = 3e-3;
    const FEWEST: usize = 20;
    let mut later = 0;
    let steps = (0..frames.len()).filter_map(|f| {
        while later < frames.len() && times[later] < times[f] + WINDOW_S {
            later += 1;
        }
        Some((frames.get(later)?[channel]? - frames[f][channel]?).norm())
    });
    let steps: Vec<f64> = steps.collect();
    steps.len() >= FEWEST && upper_median(steps).is_some_and(|m| m > HEAD_MOVES_M)
}

/// Moves every frame so that the reference points are where they are in the first frame that has all of them:
/// shifted for one point, shifted and turned for several. Frames that lack one are dropped.
pub(super) fn hold_head(frames: &mut [Vec<Option<Point>>], references: &[usize]) {
    if references.is_empty() {
        return;
    }
    let held = |frame: &[Option<Point>]| references.iter().map(|&r| frame[r]).collect::<Option<Vec<_>>>();
    let Some(base) = frames.iter().find_map(|f| held(f)) else { return };
    for frame in frames {
        let motion = held(frame).and_then(|here| Similarity::rigid(&here, &base));
        frame.iter_mut().for_each(|p| *p = p.zip(motion.as_ref()).map(|(p, m)| m.place(p)));
    }
}

/// From the first to the last seen point of the contour, m: the median of all frames.
pub(super) fn rise_of_contour(frames: &[Vec<Option<Point>>], contour: &[usize]) -> Option<Point> {
    median_point(frames.iter().filter_map(|frame| {
        let mut seen = contour.iter().filter_map(|&c| frame[c]);
        let first = seen.next()?;
        Some(seen.next_back()? - first)
    }))
}

/// Where several coils move with one bone, they give its rotation, too: the first of them is moved to the place that they carry along, and
/// the others are taken out of `bones`. It is the mental spine for coils on the jaw, which lies below and behind the incisors. A frame in
/// which one of them was not seen shows no bone.
pub(super) fn carry_by_coils(frames: &mut [Vec<Option<Point>>], bones: &mut Vec<usize>, roles: &[Role]) {
    let all = std::mem::take(bones);
    for &coil in &all {
        if bones.iter().any(|&b| roles[b] == roles[coil]) {
            continue;
        }
        bones.push(coil);
        let alike: Vec<usize> = all.iter().copied().filter(|&b| roles[b] == roles[coil]).collect();
        let base: Vec<(usize, Point)> =
            alike.iter().filter_map(|c| Some((*c, median_place(frames, *c)?))).collect();
        let Some(front) = base.iter().map(|(_, p)| *p).min_by(|a, b| a.x.total_cmp(&b.x)) else { continue };
        if base.len() < 2 {
            continue;
        }
        let (coils, base): (Vec<usize>, Vec<Point>) = base.into_iter().unzip();
        let carried = front + INCISORS_TO_SPINE_M;
        for frame in &mut *frames {
            let here: Option<Vec<Point>> = coils.iter().map(|&c| frame[c]).collect();
            let motion = here.and_then(|here| Similarity::rigid(&base, &here));
            frame[coil] = motion.map(|motion| motion.place(carried));
        }
    }
}

/// The steepest line of the bones to the horizontal, degrees.
pub(super) const STEEPEST_BONES_DEG: f64 = 60.0;

pub(super) fn steep_deg(apart: Point) -> f64 {
    apart.y.abs().atan2(apart.x.abs()).to_degrees()
}
