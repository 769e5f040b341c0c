//! Similarities of the plane: a rotation, a scale and a shift.

use super::plane::Point;

/// `x -> m x + shift`, where `m` turns by the angle of `(turn[0], turn[1])` and scales by its length.
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

    /// Turns by an angle (rad, from x towards y) and scales about the origin, then shifts (m).
    pub fn new(scale: f64, angle: f64, shift: Point) -> Self {
        Self { turn: [scale * angle.cos(), scale * angle.sin()], shift }
    }

    /// The point that [`place`](Self::place) carries to `p`.
    pub fn back(&self, p: Point) -> Point {
        let ([c, s], q) = (self.turn, p - self.shift);
        Point::new(c * q.x + s * q.y, c * q.y - s * q.x) / (c * c + s * s)
    }

    /// The similarity that brings `from` nearest to `to` by least squares (Umeyama 1991; in the plane a
    /// quotient of complex numbers). Points that already agree to 1 nm give the identity to the bit. `None`
    /// for fewer than two points or points that coincide.
    pub fn between(from: &[Point], to: &[Point]) -> Option<Self> {
        if from.len() != to.len() || from.len() < 2 {
            return None;
        }
        if from.iter().zip(to).all(|(a, b)| (a - b).norm() <= 1e-9) {
            return Some(Self::IDENTITY);
        }
        let mean = |points: &[Point]| points.iter().sum::<Point>() / points.len() as f64;
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

    /// As [`Similarity::between`], without scaling; one point is shifted.
    pub fn rigid(from: &[Point], to: &[Point]) -> Option<Self> {
        if let ([a], [b]) = (from, to) {
            return Some(Self { shift: b - a, ..Self::IDENTITY });
        }
        let free = Self::between(from, to)?;
        let scale = free.scale();
        let turned = Self { turn: free.turn.map(|t| t / scale), shift: Point::zeros() };
        let mean = |points: &[Point]| points.iter().sum::<Point>() / points.len() as f64;
        Some(Self { shift: mean(to) - turned.place(mean(from)), ..turned })
    }

    /// The scale: lengths are multiplied by it.
    pub fn scale(&self) -> f64 {
        self.turn[0].hypot(self.turn[1])
    }

    /// The angle of the rotation, from x towards y, rad.
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
