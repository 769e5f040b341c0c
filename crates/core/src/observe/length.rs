//! Lengths of muscles and of lines between points, and their ratios and stretches, as observables.

use nalgebra::SVector;

use super::Observable;

/// The straight distance between two nodes, m: the length of a muscle as measured on an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Length {
    ends: [usize; 2],
}

impl Length {
    /// The distance between two nodes, such as [`crate::body::MuscleChain::ends`].
    pub fn new(ends: [usize; 2]) -> Self {
        Self { ends }
    }

    fn way<const D: usize>(&self, positions: &[SVector<f64, D>]) -> SVector<f64, D> {
        positions[self.ends[1]] - positions[self.ends[0]]
    }
}

impl<const D: usize> Observable<D> for Length {
    fn value(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.way(positions).norm()
    }

    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>)) {
        let way = self.way(positions);
        let direction = way / way.norm();
        part(self.ends[0], -direction);
        part(self.ends[1], direction);
    }

    fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        let way = self.way(positions);
        rates.iter_mut().zip(motions).for_each(|(rate, m)| *rate = way.dot(&self.way(m)) / way.norm());
    }
}

/// The end of a line: a weighted sum of nodes plus a constant vector.
#[derive(Debug, Clone, PartialEq)]
pub struct LineEnd<const D: usize> {
    /// Nodes with their weights; none for a point on bone.
    pub weights: Vec<(usize, f64)>,
    /// Position of a point on bone, m; zero otherwise.
    pub fixed: SVector<f64, D>,
}

impl<const D: usize> LineEnd<D> {
    pub fn node(node: usize) -> Self {
        Self { weights: vec![(node, 1.0)], fixed: SVector::zeros() }
    }

    fn at(&self, positions: &[SVector<f64, D>]) -> SVector<f64, D> {
        self.weights.iter().fold(self.fixed, |sum, &(n, w)| sum + positions[n] * w)
    }
}

/// The straight distance between two points, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<const D: usize> {
    pub ends: [LineEnd<D>; 2],
}

impl<const D: usize> Observable<D> for Line<D> {
    fn value(&self, positions: &[SVector<f64, D>]) -> f64 {
        (self.ends[1].at(positions) - self.ends[0].at(positions)).norm()
    }

    fn gradient(&self, positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>)) {
        let way = self.ends[1].at(positions) - self.ends[0].at(positions);
        let direction = way / way.norm();
        for (end, sign) in self.ends.iter().zip([-1.0, 1.0]) {
            end.weights.iter().for_each(|&(node, weight)| part(node, direction * (sign * weight)));
        }
    }
}

/// A length over another in the same shape, which does not depend on scale (Kato 2014, 4.3.1 and 4.4.1: over the length of GGa).
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

    fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        let (ratio, over) = (self.value(positions), self.over.value(positions));
        self.length.rates(positions, motions, rates);
        for (rate, motion) in rates.iter_mut().zip(motions) {
            let mut of_over = [0.0];
            self.over.rates(positions, std::slice::from_ref(motion), &mut of_over);
            *rate = (*rate - ratio * of_over[0]) / over;
        }
    }
}

/// A length over the same length in a reference shape, usually rest, which does not depend on the size of the muscle (Kato 2014, 4.3.2).
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

    fn rates(&self, positions: &[SVector<f64, D>], motions: &[Vec<SVector<f64, D>>], rates: &mut [f64]) {
        self.length.rates(positions, motions, rates);
        rates.iter_mut().for_each(|rate| *rate /= self.reference_length);
    }
}
