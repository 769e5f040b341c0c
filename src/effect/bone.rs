//! Attachment to bone: nodes whose position is given (Kato 2014, 4.1: mental spine, hyoid, styloid process).

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern};

use super::{Configuration, Effect, Tangent};

/// Nodes held at prescribed positions, m. Holds them exactly: they are no unknowns, so it has neither energy nor stiffness;
/// the forces that the other effects leave on these nodes are the reactions of the bone, with opposite sign.
#[derive(Debug, Clone)]
pub struct Bone<const D: usize> {
    held: Vec<(usize, SVector<f64, D>)>,
}

impl<const D: usize> Bone<D> {
    /// Holds each node at its position.
    pub fn new(held: Vec<(usize, SVector<f64, D>)>) -> Self {
        Self { held }
    }
}

impl<const D: usize> Effect<D> for Bone<D> {
    fn name(&self) -> &'static str {
        "bone"
    }

    fn stencils(&self, _couple: &mut dyn FnMut(&[usize])) {}

    fn bind(&mut self, _pattern: &Pattern) {}

    fn energy(&self, _at: Configuration<'_, D>) -> f64 {
        0.0
    }

    fn add_force(&self, _at: Configuration<'_, D>, _force: &mut [SVector<f64, D>]) {}

    fn add_stiffness(&self, _at: Configuration<'_, D>, _tangent: Tangent, _stiffness: &mut BlockMatrix<D>) {}

    fn prescribed(&self, hold: &mut dyn FnMut(usize, SVector<f64, D>)) {
        self.held.iter().for_each(|&(node, position)| hold(node, position));
    }
}
