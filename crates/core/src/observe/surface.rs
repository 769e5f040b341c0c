//! Distances of measured points from the surface of a body in space.

use std::sync::Arc;

use nalgebra::SVector;

use super::Observable;

/// Signed distance, m, of a measured point from a surface of triangles: positive outside. If the nearest place is on an edge or a corner,
/// the sign is that of the side of the first nearest triangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    // Shared, because every point has its own `Surface`.
    triangles: Arc<[[usize; 3]]>,
    point: SVector<f64, 3>,
}

/// The nearest place of a triangle to a point.
struct Foot {
    triangle: [usize; 3],
    weights: [f64; 3],
    away: SVector<f64, 3>,
    side: f64,
}

impl Surface {
    /// The distance of `point`, m, from at least one triangle; corners are counter-clockwise as seen from outside.
    pub fn new(triangles: impl Into<Arc<[[usize; 3]]>>, point: SVector<f64, 3>) -> Self {
        Self { triangles: triangles.into(), point }
    }

    fn foot(&self, positions: &[SVector<f64, 3>]) -> Option<Foot> {
        let mut best: Option<Foot> = None;
        for &triangle in self.triangles.iter() {
            let x = triangle.map(|n| positions[n]);
            let weights = nearest(&x, &self.point);
            let away = self.point - (x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2]);
            if best.as_ref().is_none_or(|b| away.norm_squared() < b.away.norm_squared()) {
                let side = (x[1] - x[0]).cross(&(x[2] - x[0])).dot(&(self.point - x[0])).signum();
                best = Some(Foot { triangle, weights, away, side });
            }
        }
        best
    }
}

/// Barycentric coordinates of the place of a triangle that is nearest to `p` (Ericson 2005, 5.1.5).
fn nearest([a, b, c]: &[SVector<f64, 3>; 3], p: &SVector<f64, 3>) -> [f64; 3] {
    let (ab, ac) = (b - a, c - a);
    let along = |x: &SVector<f64, 3>| (ab.dot(&(p - x)), ac.dot(&(p - x)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (along(a), along(b), along(c));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if d1 <= 0.0 && d2 <= 0.0 {
        [1.0, 0.0, 0.0]
    } else if d3 >= 0.0 && d4 <= d3 {
        [0.0, 1.0, 0.0]
    } else if d6 >= 0.0 && d5 <= d6 {
        [0.0, 0.0, 1.0]
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        [1.0 - t, t, 0.0]
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        [1.0 - t, 0.0, t]
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        [0.0, 1.0 - t, t]
    } else {
        let all = va + vb + vc;
        [va / all, vb / all, vc / all]
    }
}

impl Observable<3> for Surface {
    fn value(&self, positions: &[SVector<f64, 3>]) -> f64 {
        self.foot(positions).map_or(0.0, |f| f.side * f.away.norm())
    }

    fn gradient(&self, positions: &[SVector<f64, 3>], part: &mut dyn FnMut(usize, SVector<f64, 3>)) {
        let Some(f) = self.foot(positions) else { return };
        let distance = f.away.norm();
        // On the surface the direction of the distance is the normal.
        let direction = if distance > 0.0 {
            f.away * (f.side / distance)
        } else {
            let x = f.triangle.map(|n| positions[n]);
            (x[1] - x[0]).cross(&(x[2] - x[0])).normalize()
        };
        for (node, weight) in f.triangle.into_iter().zip(f.weights) {
            part(node, -direction * weight);
        }
    }
}
