//! The stretch of a muscle.

use nalgebra::SVector;

use super::{Length, Observable};

/// A length over the same length in a reference shape, most often at rest: free of each muscle's own length
/// (Kato 2014, 4.3.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch<L = Length> {
    length: L,
    reference_length: f64,
}

impl<L> Stretch<L> {
    /// `length` over `reference_length`, m.
    pub fn new(length: L, reference_length: f64) -> Self {
        Self { length, reference_length }
    }
}

impl<const D: usize, L: Observable<D>> Observable<D> for Stretch<L> {
    fn value(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.length.value(positions) / self.reference_length
    }

    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>)) {
        self.length.gradient(positions, &mut |node, slope| part(node, slope / self.reference_length));
    }

    fn rate(&self, positions: &[SVector<f64, D>], motion: &[SVector<f64, D>]) -> f64 {
        self.length.rate(positions, motion) / self.reference_length
    }
}
