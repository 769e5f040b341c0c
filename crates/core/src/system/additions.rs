//! What a scene adds to the plain model of tissue, muscles and bones, and what it removes.
//!
//! Bones (Kato 2014, 4.1: mental spine, hyoid, styloid process) are a constraint, not an effect: held nodes are no unknowns, so they have
//! neither energy nor stiffness. The forces that the effects leave on them are the reactions of the bones, with opposite sign.

use std::sync::Arc;

use nalgebra::SVector;

use super::Layout;
use crate::effect::{Contact, Effect, Gravity};

/// Changes to the plain model. The default changes nothing.
#[derive(Debug)]
pub struct Additions<const D: usize> {
    pub effects: Vec<Box<dyn Effect<D>>>,
    /// Bone nodes that are carried away from where they are at rest, and where to, m.
    pub carried: Vec<(usize, SVector<f64, D>)>,
    /// Whether the cells of mass-spring tissue keep their measure. Default true.
    pub incompressible: bool,
    /// The layout of another body, which is used again if this body has the same.
    pub layout: Option<Arc<Layout>>,
}

impl<const D: usize> Default for Additions<D> {
    fn default() -> Self {
        Self { effects: Vec::new(), carried: Vec::new(), incompressible: true, layout: None }
    }
}

impl<const D: usize> Additions<D> {
    /// Adds a wall that the surface of the body cannot pass.
    #[inline(never)]
    pub fn add_contact(&mut self, wall: Contact) {
        self.effects.push(Box::new(wall));
    }

    #[inline(never)]
    pub fn add_gravity(&mut self, gravity: Gravity<D>) {
        self.effects.push(Box::new(gravity));
    }
}

/// How a bone is carried from where it is at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PrescribedDisplacement<const D: usize> {
    /// Turned about a joint in the plane of the first two coordinates, as the mandible is about the
    /// temporomandibular joint.
    Turned {
        /// The joint, m.
        joint: SVector<f64, D>,
        /// Angle from the first axis towards the second, rad. With the face to the left and up upwards, a
        /// positive angle opens the jaw: the chin goes down and back.
        angle: f64,
    },
    /// Shifted, m.
    Shifted(SVector<f64, D>),
}

impl<const D: usize> PrescribedDisplacement<D> {
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
