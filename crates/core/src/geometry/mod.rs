//! Geometry without anatomy: simplices, hexahedra, straight lines and curves.

pub mod hexahedron;
mod natural_spline;
pub(crate) mod plane;
pub mod quadratic;
pub mod simplex;
mod spline;
mod thin_plate;
pub mod topology;

pub use natural_spline::NaturalSpline;
pub use plane::{Point, Similarity};
pub use spline::ClosedSpline;
pub use thin_plate::ThinPlate;

use nalgebra::SVector;

/// Largest absolute coordinate of any vector; 0 without vectors.
pub fn largest<const D: usize>(vectors: &[SVector<f64, D>]) -> f64 {
    vectors.iter().map(SVector::amax).fold(0.0, f64::max)
}

/// Longest side of the bounding box of points, m; 0 without points.
pub fn extent<const D: usize>(points: &[SVector<f64, D>]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let (low, high) = points.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    (high - low).amax()
}
