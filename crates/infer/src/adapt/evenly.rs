//! Points evenly along a line.

use tongue_core::geometry::Point;

/// This number of points evenly along a polyline; `None` for fewer than two different points.
pub(super) fn evenly(points: &[Point], count: usize) -> Option<Vec<Point>> {
    let steps: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
    let whole: f64 = steps.iter().sum();
    if points.len() < 2 || whole.is_nan() || whole <= 0.0 {
        return None;
    }
    let at = |i: usize| {
        let (mut left, mut piece) = (whole * i as f64 / (count - 1) as f64, 0);
        while piece + 1 < steps.len() && left > steps[piece] {
            left -= steps[piece];
            piece += 1;
        }
        let part = if steps[piece] > 0.0 { (left / steps[piece]).min(1.0) } else { 0.0 };
        points[piece] + (points[piece + 1] - points[piece]) * part
    };
    Some((0..count).map(at).collect())
}
