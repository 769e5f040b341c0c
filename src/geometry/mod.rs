//! Shapes without anatomy: simplices, straight lines and closed curves in the plane.

pub(crate) mod plane;
pub mod simplex;
mod spline;

pub use plane::Point;
pub use spline::ClosedSpline;
