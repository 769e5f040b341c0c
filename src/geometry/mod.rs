//! Shapes without anatomy: simplices and who shares what of them, straight lines and closed curves in the plane.

pub(crate) mod plane;
pub mod simplex;
mod spline;
pub mod topology;

pub use plane::Point;
pub use spline::ClosedSpline;
