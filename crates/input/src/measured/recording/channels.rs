//! The courses of the channels of a recording over its frames, before their points are sorted into contour, coils and bones.

use tongue_core::geometry::{Point, Similarity};
use tongue_core::statistics::upper_median;

/// Usual distance of the first coil behind the tip, m.
pub const FIRST_COIL_M: f64 = 8e-3;
/// Usual ratio of the distance of neighbouring coils along the surface to their straight distance.
pub const LONGER_THAN_CHORD: f64 = 1.03;

pub(super) fn median_point(points: impl Iterator<Item = Point>) -> Option<Point> {
    let all: Vec<Point> = points.collect();
    let [x, y] = [0, 1].map(|axis| upper_median(all.iter().map(|p| p[axis])));
    Some(Point::new(x?, y?))
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

/// The steepest line of the bones to the horizontal, degrees.
pub(super) const STEEPEST_BONES_DEG: f64 = 60.0;

pub(super) fn steep_deg(apart: Point) -> f64 {
    apart.y.abs().atan2(apart.x.abs()).to_degrees()
}
