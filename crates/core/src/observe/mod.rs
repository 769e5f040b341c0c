//! Observables: numbers that follow from the positions of the nodes, and measurements of them.
//!
//! | observable | value | unit |
//! |---|---|---|
//! | [`Length`] | straight distance between a muscle's ends | m |
//! | [`Line`] | straight distance between two points of the body or of bones | m |
//! | [`Ratio`] | a muscle's length over another's in the same shape (Kato 2014, 4.3.1) | 1 |
//! | [`Stretch`] | a muscle's length over its length in a reference shape (4.3.2) | 1 |
//! | [`NodePosition`] | a coordinate of a material point: a node, or a place on the surface | m |
//! | [`Contour`] | signed distance of a measured point from the surface curve (in the plane) | m |
//! | [`Surface`] | signed distance of a measured point from the surface (in space) | m |
//! | [`Midsagittal`] | one of the above in the midsagittal plane of a body in space | its unit |
//!
//! Each gives its value and its gradient in the positions; a test compares all of them with differences, in
//! both dimensions.

mod contour;
mod length;
mod line;
mod midsagittal;
mod observation;
mod point;
mod ratio;
mod stretch;
mod surface;

use std::fmt::Debug;

use nalgebra::SVector;

pub use contour::{Contour, Curve};
pub use length::Length;
pub use line::{Line, LineEnd};
pub use midsagittal::Midsagittal;
pub use observation::Observation;
pub use point::NodePosition;
pub use ratio::Ratio;
pub use stretch::Stretch;
pub use surface::Surface;

/// A number that is a function of the positions of the nodes.
pub trait Observable<const D: usize>: Debug + Send + Sync {
    /// The number at these positions (of all nodes, m).
    fn value(&self, positions: &[SVector<f64, D>]) -> f64;

    /// Calls `part` with every node that the number depends on and the derivative by its position, unit of
    /// the value per m.
    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>));

    /// The number, and its gradient as [`Observable::gradient`] gives it. An observable that needs a search is searched once for both.
    fn value_and_gradient(
        &self,
        positions: &[SVector<f64, D>],
        part: &mut dyn FnMut(usize, SVector<f64, D>),
    ) -> f64 {
        self.gradient(positions, part);
        self.value(positions)
    }

    /// Derivative of the number when every node moves with `motion` (m for a unit of what moves them).
    fn rate(&self, positions: &[SVector<f64, D>], motion: &[SVector<f64, D>]) -> f64 {
        let mut rate = 0.0;
        self.gradient(positions, &mut |node, slope| rate += slope.dot(&motion[node]));
        rate
    }

    /// The same for several motions, into `rates`. An observable whose gradient is found by a search is searched once for all.
    fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        rates.iter_mut().zip(motions).for_each(|(rate, motion)| *rate = self.rate(positions, motion));
    }
}

/// [`Observable::rates`] from one gradient.
fn rates_of_gradient<const D: usize>(
    observable: &impl Observable<D>,
    (positions, motions): (&[SVector<f64, D>], &[Vec<SVector<f64, D>>]),
    rates: &mut [f64],
) {
    rates.fill(0.0);
    observable.gradient(positions, &mut |node, slope| {
        rates.iter_mut().zip(motions).for_each(|(rate, motion)| *rate += slope.dot(&motion[node]));
    });
}
