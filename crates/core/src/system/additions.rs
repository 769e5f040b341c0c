//! Additions of a scene to the plain model of tissue, muscles and bones, and removals from it.

use std::sync::Arc;

use nalgebra::SVector;

use crate::effect::{Contact, Effect, Gravity};

use super::Layout;

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
