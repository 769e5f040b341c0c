//! Attachment to bone: nodes whose position is given (Kato 2014, 4.1: mental spine, hyoid, styloid process).

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern};

use super::{Configuration, Effect, Tangent};

/// How a bone is carried from where it is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Carried<const D: usize> {
    /// Turned about a joint in the plane of the first two coordinates, as the mandible is about the temporomandibular joint.
    Turned {
        /// The joint, m.
        joint: SVector<f64, D>,
        /// Angle from the first axis towards the second, rad. With the face to the left and up upwards, a positive angle opens
        /// the jaw: the chin goes down and back.
        angle: f64,
    },
    /// Shifted, m.
    Shifted(SVector<f64, D>),
}

impl<const D: usize> Carried<D> {
    /// Where a point of the bone comes to lie, m.
    pub fn place(&self, point: SVector<f64, D>) -> SVector<f64, D> {
        match self {
            Self::Shifted(by) => point + by,
            Self::Turned { joint, angle } => {
                let (sin, cos) = angle.sin_cos();
                let arm = point - joint;
                let mut turned = arm;
                turned[0] = cos * arm[0] - sin * arm[1];
                turned[1] = sin * arm[0] + cos * arm[1];
                joint + turned
            }
        }
    }
}

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
