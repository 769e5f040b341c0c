//! Coordinates of a material point (a sensor, a landmark), and observables in the midsagittal plane of a body in space.

use std::sync::Arc;

use nalgebra::{SVector, Vector2, Vector3};

use super::{Curve, Observable};

/// The coordinate along a direction, m, of a point that moves with the body: a weighted mean of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct NodePosition<const D: usize> {
    weights: Vec<(usize, f64)>,
    direction: SVector<f64, D>,
}

impl<const D: usize> NodePosition<D> {
    /// The coordinate of a node; `direction` is a unit vector, such as an axis.
    pub fn node(node: usize, direction: SVector<f64, D>) -> Self {
        Self { weights: vec![(node, 1.0)], direction }
    }

    /// The coordinate of a weighted mean of nodes, such as a point of an element; the sum of the weights is 1.
    pub fn mean(weights: Vec<(usize, f64)>, direction: SVector<f64, D>) -> Self {
        Self { weights, direction }
    }
}

impl NodePosition<2> {
    /// The coordinate of the place at `arc_length`, m at rest, from the beginning of a surface curve.
    pub fn on_curve(curve: &Curve, arc_length: f64, direction: SVector<f64, 2>) -> Self {
        Self { weights: curve.weights(arc_length), direction }
    }
}

impl<const D: usize> Observable<D> for NodePosition<D> {
    fn value(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.weights.iter().map(|&(node, weight)| weight * self.direction.dot(&positions[node])).sum()
    }

    fn gradient(&self, _positions: &[SVector<f64, D>], part: &mut dyn FnMut(usize, SVector<f64, D>)) {
        self.weights.iter().for_each(|&(node, weight)| part(node, self.direction * weight));
    }
}

/// An observable of the plane for nodes of a body in space, with their coordinates x (backwards) and z (upwards).
#[derive(Debug, Clone)]
pub struct Midsagittal<O> {
    nodes: Arc<[usize]>,
    observable: O,
}

impl<O: Observable<2>> Midsagittal<O> {
    /// Node number i of `observable` is node `nodes[i]` of the body.
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
}
