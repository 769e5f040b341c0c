//! An open curve through points.

use super::plane::{self, Point};

/// A natural cubic spline through points, whose parameter is the sum of their distances (de Boor 1978, chapter IV). Its second derivative
/// is zero at both ends.
#[derive(Debug, Clone, PartialEq)]
pub struct NaturalSpline {
    /// The corners of the polygon that stands for the curve.
    pub polygon: Vec<Point>,
}

/// Number of straight pieces of the polygon for each span.
const PIECES: usize = 16;

impl NaturalSpline {
    /// The curve through `points`, m. `None` for fewer than two points, or if neighbours coincide.
    pub fn through(points: &[Point]) -> Option<Self> {
        let n = points.len();
        let lengths: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        if n < 2 || !lengths.iter().all(|l| *l > 0.0 && l.is_finite()) {
            return None;
        }
        // The tridiagonal system of the second derivatives is eliminated from front to back.
        let mut bends = vec![Point::zeros(); n];
        let mut above = vec![0.0; n];
        for i in 1..n - 1 {
            let (before, after) = (lengths[i - 1], lengths[i]);
            let turn = (points[i + 1] - points[i]) / after - (points[i] - points[i - 1]) / before;
            let pivot = (before + after) / 3.0 - before / 6.0 * above[i - 1];
            above[i] = after / 6.0 / pivot;
            bends[i] = (turn - bends[i - 1] * (before / 6.0)) / pivot;
        }
        for i in (1..n - 1).rev() {
            bends[i] = bends[i] - bends[i + 1] * above[i];
        }
        let mut polygon = Vec::with_capacity((n - 1) * PIECES + 1);
        for i in 0..n - 1 {
            for piece in 0..PIECES {
                let u = piece as f64 / PIECES as f64;
                let v = 1.0 - u;
                let bend = bends[i] * (v * v * v - v) + bends[i + 1] * (u * u * u - u);
                polygon.push(points[i] * v + points[i + 1] * u + bend * (lengths[i] * lengths[i] / 6.0));
            }
        }
        polygon.push(points[n - 1]);
        Some(Self { polygon })
    }

    /// The curve with a straight piece of this length, m, along the tangent at either end.
    pub fn extended(mut self, length: f64) -> Self {
        let n = self.polygon.len();
        let ends = [[0, 1], [n - 1, n - 2]].map(|pair| pair.map(|i| self.polygon[i]));
        let [first, last] = ends.map(|[end, before]| end + (end - before).normalize() * length);
        self.polygon.insert(0, first);
        self.polygon.push(last);
        self
    }

    pub fn distance(&self, p: Point) -> f64 {
        let squared = self.polygon.windows(2).map(|w| plane::squared_distance_to_line(p, w[0], w[1]));
        squared.fold(f64::INFINITY, f64::min).sqrt()
    }
}
