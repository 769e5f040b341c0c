//! Effects, displacements and removals by which a scene changes the model of tissue, muscles and bones.
//!
//! Bones (Kato 2014, 4.1: mental spine, hyoid, styloid process) are constraints and not effects: held nodes are no unknowns, and have
//! neither energy nor stiffness. The forces of the effects on them are minus the reactions.

use std::sync::Arc;

use nalgebra::SVector;

use super::Layout;
use crate::effect::{Contact, Effect, Gravity};

/// Changes to the model. The default changes nothing.
#[derive(Debug)]
pub struct Additions<const D: usize> {
    pub effects: Vec<Box<dyn Effect<D>>>,
    /// Displaced nodes of bones and their positions, m.
    pub displaced: Vec<(usize, SVector<f64, D>)>,
    /// Whether the cells of mass-spring tissue keep their measure. Default true.
    pub incompressible: bool,
    /// The layout of another body, which is used if this body has the same one.
    pub layout: Option<Arc<Layout>>,
}

impl<const D: usize> Default for Additions<D> {
    fn default() -> Self {
        Self { effects: Vec::new(), displaced: Vec::new(), incompressible: true, layout: None }
    }
}

impl<const D: usize> Additions<D> {
    #[inline(never)]
    pub fn add_contact(&mut self, wall: Contact) {
        self.effects.push(Box::new(wall));
    }

    #[inline(never)]
    pub fn add_gravity(&mut self, gravity: Gravity<D>) {
        self.effects.push(Box::new(gravity));
    }
}

/// How a bone is displaced from rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PrescribedDisplacement<const D: usize> {
    /// A rotation about a joint in the plane of the first two coordinates, as that of the mandible about the temporomandibular joint.
    Turned {
        /// The joint, m.
        joint: SVector<f64, D>,
        /// Angle from the first axis towards the second, rad. A positive angle opens the jaw of a face that looks to the left: the chin
        /// moves down and back.
        angle: f64,
    },
    /// A displacement, m.
    Shifted(SVector<f64, D>),
}

impl<const D: usize> PrescribedDisplacement<D> {
    /// The displaced position of a point of the bone, m.
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
