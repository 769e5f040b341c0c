//! The ratio of two lengths in one shape.

use nalgebra::SVector;

use super::{Length, Observable};

/// A length over another in the same shape, which does not depend on scale (Kato 2014, 4.3.1 and 4.4.1: over
/// the length of GGa).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ratio<L = Length> {
    length: L,
    over: L,
}

impl<L> Ratio<L> {
    pub fn new(length: L, over: L) -> Self {
        Self { length, over }
    }
}

impl<const D: usize, L: Observable<D>> Observable<D> for Ratio<L> {
    fn value(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.length.value(positions) / self.over.value(positions)
    }

    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>)) {
        let over = self.over.value(positions);
        let ratio = self.value(positions);
        self.length.gradient(positions, &mut |node, slope| part(node, slope / over));
        self.over.gradient(positions, &mut |node, slope| part(node, -slope * (ratio / over)));
    }

    fn rate(&self, positions: &[SVector<f64, D>], motion: &[SVector<f64, D>]) -> f64 {
        let change = self.length.rate(positions, motion);
        (change - self.value(positions) * self.over.rate(positions, motion)) / self.over.value(positions)
    }
}
