//! Geometry without anatomy: simplices and their shared edges and faces, straight lines and closed curves in
//! the plane.

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

/// The largest size of a coordinate of any vector.
pub fn largest<const D: usize>(vectors: &[SVector<f64, D>]) -> f64 {
    vectors.iter().map(SVector::amax).fold(0.0, f64::max)
}

/// The longest side of the box around points, m; 0 without points.
pub fn extent<const D: usize>(points: &[SVector<f64, D>]) -> f64 {
    let Some(first) = points.first() else { return 0.0 };
    let (low, high) = points.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    (high - low).amax()
}
