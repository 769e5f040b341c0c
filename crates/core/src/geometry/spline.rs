//! Closed smooth curves, such as the outline of the tongue.

use nalgebra::{DMatrix, DVector};

use super::plane::{self, Point};

/// Number of straight pieces of the polygon for each span. With spans of 8 mm and a radius of 3 mm the polygon is at most 3 µm from the
/// curve.
const PIECES: usize = 32;

/// A closed cubic spline through points, twice continuously differentiable, whose parameter is the sum of the points' distances (de Boor
/// 1978, chapter IV).
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedSpline {
    /// The points that it goes through, m, counter-clockwise.
    pub points: Vec<Point>,
    /// Second derivative by the parameter at each point, 1/m.
    bends: Vec<Point>,
    /// The curve as a fine polygon, m, counter-clockwise.
    pub polygon: Vec<Point>,
    /// The distance along the polygon to each corner, m.
    distances: Vec<f64>,
    /// Length of the closed curve, m.
    pub perimeter: f64,
}

impl ClosedSpline {
    /// The curve through `points` (m, in either direction), counter-clockwise. `None` for fewer than three points, or if neighbours
    /// coincide.
    pub fn through(mut points: Vec<Point>) -> Option<Self> {
        if plane::polygon_area(&points) < 0.0 {
            points.get_mut(1..)?.reverse();
        }
        let bends = bends(&points)?;
        let mut curve = Self { points, bends, polygon: Vec::new(), distances: Vec::new(), perimeter: 0.0 };
        curve.polygon = (0..curve.points.len() * PIECES)
            .map(|i| curve.at_parameter(i / PIECES, (i % PIECES) as f64 / PIECES as f64))
            .collect();
        for (a, b) in plane::edges(&curve.polygon) {
            curve.distances.push(curve.perimeter);
            curve.perimeter += (b - a).norm();
        }
        Some(curve)
    }

    /// Area, m²: half the integral of x dy - y dx, which Gauss's rule with three points a span gives exactly.
    pub fn area(&self) -> f64 {
        let reach = (0.6_f64).sqrt() / 2.0;
        let rule = [(0.5 - reach, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + reach, 5.0 / 18.0)];
        let places = (0..self.points.len()).flat_map(|span| rule.map(|(u, weight)| (span, u, weight)));
        let parts = places.map(|(span, u, weight)| {
            0.5 * weight * self.at_parameter(span, u).perp(&self.slope_at_parameter(span, u))
        });
        parts.sum()
    }

    /// The point at `distance` (m) along the curve from its first point, modulo the perimeter.
    pub fn point(&self, distance: f64) -> Point {
        let distance = distance.rem_euclid(self.perimeter);
        let i = self.distances.partition_point(|d| *d <= distance).saturating_sub(1);
        let from = self.distances.get(i).copied().unwrap_or(0.0);
        let to = self.distances.get(i + 1).copied().unwrap_or(self.perimeter);
        let part = if to > from { (distance - from) / (to - from) } else { 0.0 };
        self.at_parameter(i / PIECES, ((i % PIECES) as f64 + part) / PIECES as f64)
    }

    /// The nearest place of the curve to `p`: its distance along the curve and its distance from `p`, m.
    pub fn nearest(&self, p: Point) -> (f64, f64) {
        let mut best = (0.0, f64::INFINITY);
        for ((a, b), start) in plane::edges(&self.polygon).zip(&self.distances) {
            let part = plane::nearest_fraction(p, a, b);
            let away = (a + (b - a) * part - p).norm();
            if away < best.1 {
                best = (start + part * (b - a).norm(), away);
            }
        }
        best
    }

    /// Where a segment crosses the curve, as ascending fractions of the segment.
    pub fn crossings(&self, line: [Point; 2]) -> Vec<f64> {
        let meets = plane::edges(&self.polygon).filter_map(|(a, b)| plane::crossing(line, [a, b]));
        let meets = meets.filter(|[t, u]| (0.0..=1.0).contains(t) && (0.0..1.0).contains(u));
        let mut found: Vec<f64> = meets.map(|[t, _]| t).collect();
        found.sort_by(f64::total_cmp);
        found
    }

    /// Ends of a span, their second derivatives, and the distance between the ends.
    fn span(&self, span: usize) -> ([Point; 2], [Point; 2], f64) {
        let next = (span + 1) % self.points.len();
        let ends = [self.points[span], self.points[next]];
        (ends, [self.bends[span], self.bends[next]], (ends[1] - ends[0]).norm())
    }

    fn at_parameter(&self, span: usize, u: f64) -> Point {
        let ([a, b], [bend_a, bend_b], length) = self.span(span);
        let v = 1.0 - u;
        a * v + b * u + (bend_a * (v * v * v - v) + bend_b * (u * u * u - u)) * (length * length / 6.0)
    }

    fn slope_at_parameter(&self, span: usize, u: f64) -> Point {
        let ([a, b], [bend_a, bend_b], length) = self.span(span);
        let v = 1.0 - u;
        b - a + (bend_a * (1.0 - 3.0 * v * v) + bend_b * (3.0 * u * u - 1.0)) * (length * length / 6.0)
    }
}

/// Second derivatives for which the first ones are continuous at every point: the solution of a cyclic tridiagonal system.
fn bends(points: &[Point]) -> Option<Vec<Point>> {
    let n = points.len();
    if n < 3 {
        return None;
    }
    let chords: Vec<Point> = plane::edges(points).map(|(a, b)| b - a).collect();
    let lengths: Vec<f64> = chords.iter().map(|c| c.norm()).collect();
    if !lengths.iter().all(|l| *l > 0.0) {
        return None;
    }
    let mut matrix = DMatrix::zeros(n, n);
    let mut turns = [DVector::zeros(n), DVector::zeros(n)];
    for i in 0..n {
        let before = (i + n - 1) % n;
        matrix[(i, before)] += lengths[before] / 6.0;
        matrix[(i, i)] += (lengths[before] + lengths[i]) / 3.0;
        matrix[(i, (i + 1) % n)] += lengths[i] / 6.0;
        let turn = chords[i] / lengths[i] - chords[before] / lengths[before];
        turns[0][i] = turn.x;
        turns[1][i] = turn.y;
    }
    let factors = matrix.lu();
    let [x, y] = turns.map(|turn| factors.solve(&turn));
    Some(x?.iter().zip(y?.iter()).map(|(x, y)| Point::new(*x, *y)).collect())
}
