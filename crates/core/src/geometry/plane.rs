//! Points, lines, polygons and similarities in the midsagittal plane.

use nalgebra::Vector2;

/// A point or a displacement in the plane, m.
pub type Point = Vector2<f64>;

/// Twice the signed area of triangle `abc`, m²; positive if counter-clockwise.
pub(crate) fn doubled_area(a: Point, b: Point, c: Point) -> f64 {
    (b - a).perp(&(c - a))
}

/// Signed area of a closed polygon, m²; positive if counter-clockwise.
pub(crate) fn polygon_area(polygon: &[Point]) -> f64 {
    0.5 * edges(polygon).map(|(a, b)| a.perp(&b)).sum::<f64>()
}

/// The edges of a closed polygon, with that from the last corner to the first.
pub(crate) fn edges(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    polygon.iter().zip(polygon.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

/// Whether a closed polygon encloses `p` (even-odd rule).
pub(crate) fn encloses(polygon: &[Point], p: Point) -> bool {
    edges(polygon).fold(false, |inside, (a, b)| {
        let crosses = (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        inside != crosses
    })
}

/// Fraction, 0 to 1, of the segment from `a` to `b` at which it is nearest to `p`.
pub(crate) fn nearest_fraction(p: Point, a: Point, b: Point) -> f64 {
    let along = b - a;
    let squared = along.norm_squared();
    if squared > 0.0 { ((p - a).dot(&along) / squared).clamp(0.0, 1.0) } else { 0.0 }
}

pub(crate) fn squared_distance_to_line(p: Point, a: Point, b: Point) -> f64 {
    (a + (b - a) * nearest_fraction(p, a, b) - p).norm_squared()
}

/// Where the line `ab` crosses the line `cd`, as fractions of both segments; `None` if they are parallel. The segments cross if both
/// fractions are within 0 to 1.
pub(crate) fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<[f64; 2]> {
    let (along, other) = (b - a, d - c);
    let turn = along.perp(&other);
    if turn.abs() <= 1e-12 * along.norm() * other.norm() {
        return None;
    }
    Some([(c - a).perp(&other) / turn, (c - a).perp(&along) / turn])
}

/// Whether two edges of a polygon that share no corner meet.
pub(crate) fn crosses_itself(polygon: &[Point]) -> bool {
    let edges: Vec<_> = edges(polygon).map(|(a, b)| [a, b]).collect();
    let last = edges.len().saturating_sub(1);
    edges.iter().enumerate().any(|(i, first)| {
        edges.iter().enumerate().skip(i + 2).filter(|(j, _)| !(i == 0 && *j == last)).any(|(_, second)| {
            crossing(*first, *second).is_some_and(|at| at.iter().all(|t| (0.0..=1.0).contains(t)))
        })
    })
}

/// Centre of the circle through three points; not finite if they are in line.
pub(crate) fn circumcentre([a, b, c]: [Point; 3]) -> Point {
    let (u, v) = (b - a, c - a);
    let (uu, vv) = (u.norm_squared(), v.norm_squared());
    a + Point::new(v.y * uu - u.y * vv, u.x * vv - v.x * uu) / (2.0 * u.perp(&v))
}

/// `x -> m x + shift`, where `m` rotates by the angle of the vector `turn` and scales by its length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    turn: [f64; 2],
    shift: Point,
}

impl Default for Similarity {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Similarity {
    pub const IDENTITY: Self = Self { turn: [1.0, 0.0], shift: Point::new(0.0, 0.0) };

    /// Rotates by an angle (rad, from x towards y) and scales about the origin, then shifts (m).
    pub fn new(scale: f64, angle: f64, shift: Point) -> Self {
        Self { turn: [scale * angle.cos(), scale * angle.sin()], shift }
    }

    /// The inverse of [`place`](Self::place).
    pub fn place_back(&self, p: Point) -> Point {
        let ([c, s], q) = (self.turn, p - self.shift);
        Point::new(c * q.x + s * q.y, c * q.y - s * q.x) / (c * c + s * s)
    }

    /// The similarity that brings `from` nearest to `to` by least squares (Umeyama 1991). Points that agree to 1 nm give exactly the
    /// identity. `None` for fewer than two points, or if points coincide.
    pub fn between(from: &[Point], to: &[Point]) -> Option<Self> {
        if from.len() != to.len() || from.len() < 2 {
            return None;
        }
        if from.iter().zip(to).all(|(a, b)| (a - b).norm() <= 1e-9) {
            return Some(Self::IDENTITY);
        }
        let (centre, target) = (mean(from), mean(to));
        let (mut along, mut across, mut size) = (0.0, 0.0, 0.0);
        for (a, b) in from.iter().zip(to) {
            let (a, b) = (a - centre, b - target);
            along += a.dot(&b);
            across += a.perp(&b);
            size += a.norm_squared();
        }
        let turn = [along / size, across / size];
        let found = Self { turn, shift: Point::zeros() };
        let shift = target - found.place(centre);
        let good = found.scale() > 0.0 && turn.iter().chain(shift.iter()).all(|v| v.is_finite());
        good.then_some(Self { turn, shift })
    }

    /// The rotation and shift that bring `from` nearest to `to` by least squares; one point is only shifted.
    pub fn rigid(from: &[Point], to: &[Point]) -> Option<Self> {
        if let ([a], [b]) = (from, to) {
            return Some(Self { shift: b - a, ..Self::IDENTITY });
        }
        let free = Self::between(from, to)?;
        let scale = free.scale();
        let turned = Self { turn: free.turn.map(|t| t / scale), shift: Point::zeros() };
        Some(Self { shift: mean(to) - turned.place(mean(from)), ..turned })
    }

    /// The factor of lengths.
    pub fn scale(&self) -> f64 {
        self.turn[0].hypot(self.turn[1])
    }

    /// Angle of the rotation, from x towards y, rad.
    pub fn angle(&self) -> f64 {
        self.turn[1].atan2(self.turn[0])
    }

    pub fn place(&self, p: Point) -> Point {
        if *self == Self::IDENTITY {
            return p;
        }
        let [c, s] = self.turn;
        Point::new(c * p.x - s * p.y, s * p.x + c * p.y) + self.shift
    }
}

fn mean(points: &[Point]) -> Point {
    points.iter().sum::<Point>() / points.len() as f64
}
