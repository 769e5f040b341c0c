//! What is seen in the midsagittal plane of a body in space.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use super::Observable;

/// An observable of the plane at nodes of a body in space: of their coordinates x (to the back) and z (upwards).
#[derive(Debug, Clone)]
pub struct Midsagittal<O> {
    nodes: Arc<[usize]>,
    observable: O,
}

impl<O: Observable<2>> Midsagittal<O> {
    /// `observable` is of as many nodes as `nodes` has; its node number i is node `nodes[i]` of the body.
    pub fn new(nodes: Arc<[usize]>, observable: O) -> Self {
        Self { nodes, observable }
    }

    fn flat(&self, positions: &[Vector3<f64>]) -> Vec<Vector2<f64>> {
        self.nodes.iter().map(|&n| positions[n].xz()).collect()
    }
}

impl<O: Observable<2>> Observable<3> for Midsagittal<O> {
    fn value(&self, positions: &[Vector3<f64>]) -> f64 {
        self.observable.value(&self.flat(positions))
    }

    fn gradient(&self, positions: &[Vector3<f64>], part: &mut dyn FnMut(usize, Vector3<f64>)) {
        let flat = self.flat(positions);
        self.observable.gradient(&flat, &mut |n, slope| {
            part(self.nodes[n], Vector3::new(slope.x, 0.0, slope.y));
        });
    }

    fn rates(&self, positions: &[Vector3<f64>], motions: &[Vec<Vector3<f64>>], rates: &mut [f64]) {
        super::rates_of_gradient(self, (positions, motions), rates);
    }
}
