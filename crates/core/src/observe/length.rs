//! The length of a muscle.

use nalgebra::SVector;

use super::Observable;

/// The straight distance between two nodes, m: the length of a muscle as measured on an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Length {
    ends: [usize; 2],
}

impl Length {
    /// Between two nodes: those of [`crate::body::MuscleChain::ends`].
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

    fn rate(&self, positions: &[SVector<f64, D>], motion: &[SVector<f64, D>]) -> f64 {
        let way = self.way(positions);
        way.dot(&self.way(motion)) / way.norm()
    }
}
