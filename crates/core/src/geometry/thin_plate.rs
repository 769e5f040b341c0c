//! Thin-plate splines: the smoothest deformation of the plane that moves control points to given places (Bookstein 1989).

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::plane::Point;

/// A deformation of the plane by control points, linear in their displacements.
#[derive(Debug, Clone)]
pub struct ThinPlate {
    controls: Vec<Point>,
    unit: f64,
    factors: LU<f64, Dyn, Dyn>,
}

impl ThinPlate {
    /// The deformation by control points, m. `None` if two of them coincide or all lie on one line.
    pub fn new(controls: &[Point]) -> Option<Self> {
        let n = controls.len();
        let unit = super::extent(controls).max(f64::MIN_POSITIVE);
        let mut matrix = DMatrix::zeros(n + 3, n + 3);
        for (i, a) in controls.iter().enumerate() {
            for (j, b) in controls.iter().enumerate() {
                matrix[(i, j)] = kernel((a - b).norm() / unit);
            }
            for (k, value) in [1.0, a.x / unit, a.y / unit].into_iter().enumerate() {
                matrix[(i, n + k)] = value;
                matrix[(n + k, i)] = value;
            }
        }
        let scale = matrix.amax();
        let factors = matrix.lu();
        let least = factors.u().diagonal().iter().fold(f64::INFINITY, |m: f64, d| m.min(d.abs()));
        (n >= 3 && least > 1e-10 * scale).then(|| Self { controls: controls.to_vec(), unit, factors })
    }

    /// The weights of the control points' displacements in the displacement of `p`. At a control point its weight is exactly 1 and the
    /// others are 0.
    pub fn weights(&self, p: Point) -> Vec<f64> {
        let n = self.controls.len();
        let mut row = DVector::zeros(n + 3);
        for (i, c) in self.controls.iter().enumerate() {
            if (p - c).norm() <= 1e-12 * self.unit {
                return (0..n).map(|j| f64::from(u8::from(j == i))).collect();
            }
            row[i] = kernel((p - c).norm() / self.unit);
        }
        (row[n], row[n + 1], row[n + 2]) = (1.0, p.x / self.unit, p.y / self.unit);
        // The matrix is symmetric, so its inverse times the row gives the weights.
        let solved = self.factors.solve(&row).unwrap_or_else(|| DVector::zeros(n + 3));
        solved.iter().take(n).copied().collect()
    }
}

fn kernel(r: f64) -> f64 {
    if r > 0.0 { r * r * r.ln() } else { 0.0 }
}
