//! Observables: numbers that are functions of the positions of the nodes, and measurements of them.
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
//! A test compares the gradients of all of them with differences, each in the dimensions that it has. The frequency of a formant, in Hz, is
//! an observable too (`FormantFrequency` in `tongue-infer`).

mod contour;
mod length;
mod point;
mod surface;

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::SVector;

pub use contour::{Contour, Curve, TongueSurface};
pub use length::{Length, Line, LineEnd, Ratio, Stretch};
pub use point::{Midsagittal, NodePosition};
pub use surface::Surface;

/// A number that is a function of the positions of the nodes.
pub trait Observable<const D: usize>: Debug + Send + Sync {
    /// The value at these positions of all nodes, m.
    fn value(&self, positions: &[SVector<f64, D>]) -> f64;

    /// Calls `part` with every node on which the value depends and the derivative by its position, unit of the value per m.
    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>));

    /// The value, with the calls of [`Observable::gradient`]; an observable that needs a search searches once for both.
    fn value_and_gradient(
        &self,
        positions: &[SVector<f64, D>],
        part: &mut dyn FnMut(usize, SVector<f64, D>),
    ) -> f64 {
        self.gradient(positions, part);
        self.value(positions)
    }

    /// Writes to `rates` the derivative of the value for each of several motions of all nodes, m per unit of a parameter.
    fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        rates.fill(0.0);
        self.gradient(positions, &mut |node, slope| {
            rates.iter_mut().zip(motions).for_each(|(rate, motion)| *rate += slope.dot(&motion[node]));
        });
    }
}

/// An observable with its measured value and its weight.
#[derive(Debug, Clone)]
pub struct Observation<const D: usize> {
    pub observable: Arc<dyn Observable<D>>,
    /// The measured value, unit of the observable.
    pub measured: f64,
    /// Factor of the residual in a fit, in one over the unit of the observable: 1 if all quantities are of one kind, otherwise one over
    /// the standard deviation.
    pub weight: f64,
}

impl<const D: usize> Observation<D> {
    /// An observation with a weight of 1.
    pub fn new(observable: impl Observable<D> + 'static, measured: f64) -> Self {
        Self { observable: Arc::new(observable), measured, weight: 1.0 }
    }

    /// Divides the residual by a standard deviation, unit of the observable.
    pub fn with_standard_deviation(self, sd: f64) -> Self {
        Self { weight: 1.0 / sd, ..self }
    }

    /// Weighted residual, simulated minus measured, at the positions of all nodes, m.
    pub fn residual(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.weighted(self.observable.value(positions))
    }

    /// The weighted residual, and its derivative by the position of every node on which it depends.
    pub fn residual_and_slope(&self, positions: &[SVector<f64, D>]) -> (f64, Vec<(usize, SVector<f64, D>)>) {
        let mut slope = Vec::with_capacity(4);
        let value = self.observable.value_and_gradient(positions, &mut |node, s: SVector<f64, D>| {
            slope.push((node, s * self.weight))
        });
        (self.weighted(value), slope)
    }

    fn weighted(&self, value: f64) -> f64 {
        self.weight * (value - self.measured)
    }

    /// Writes the rates of the weighted residual for several motions of all nodes to `rates`.
    pub fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        self.observable.rates(positions, motions, rates);
        rates.iter_mut().for_each(|rate| *rate *= self.weight);
    }
}
