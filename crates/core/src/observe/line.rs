//! The length of a line between two points that need not be nodes.

use nalgebra::SVector;

use super::Observable;

/// The end of a line: a weighted mean of nodes, and a place that does not move.
#[derive(Debug, Clone, PartialEq)]
pub struct LineEnd<const D: usize> {
    /// Nodes with their weights; none for a point on bone.
    pub weights: Vec<(usize, f64)>,
    /// Added to the mean, m.
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
