//! Additions of a scene to the plain model of tissue, muscles and bones, and removals from it.

use nalgebra::SVector;

use crate::compiled::{as_mut, taken_as};
use crate::effect::{Contact, Effect, Gravity};

/// Changes to the plain model. The default changes nothing.
#[derive(Debug)]
pub struct Additions<const D: usize> {
    /// Further effects.
    pub effects: Vec<Box<dyn Effect<D>>>,
    /// Bone nodes that are carried away from where they are at rest, and where to, m.
    pub carried: Vec<(usize, SVector<f64, D>)>,
    /// Whether the cells of mass-spring tissue keep their measure. Default true.
    pub incompressible: bool,
}

impl<const D: usize> Default for Additions<D> {
    fn default() -> Self {
        Self { effects: Vec::new(), carried: Vec::new(), incompressible: true }
    }
}

impl<const D: usize> Additions<D> {
    /// Adds a wall that the surface of the body cannot pass.
    pub fn add_contact(&mut self, wall: Contact) {
        if let Some(plane) = as_mut(self) {
            contact_in_plane(plane, wall);
        } else if let Some(space) = as_mut(self) {
            contact_in_space(space, wall);
        }
    }

    /// Adds the weight of the body.
    pub fn add_gravity(&mut self, gravity: Gravity<D>) {
        let mut gravity = Some(gravity);
        if let Some((plane, gravity)) = as_mut(self).zip(taken_as(&mut gravity)) {
            gravity_in_plane(plane, gravity);
        } else if let Some((space, gravity)) = as_mut(self).zip(taken_as(&mut gravity)) {
            gravity_in_space(space, gravity);
        }
    }
}

// Compiled in this crate, each for its dimension; see [`crate::compiled`].

fn contact_in_plane(additions: &mut Additions<2>, wall: Contact) {
    additions.effects.push(Box::new(wall));
}

fn contact_in_space(additions: &mut Additions<3>, wall: Contact) {
    additions.effects.push(Box::new(wall));
}

fn gravity_in_plane(additions: &mut Additions<2>, gravity: Gravity<2>) {
    additions.effects.push(Box::new(gravity));
}

fn gravity_in_space(additions: &mut Additions<3>, gravity: Gravity<3>) {
    additions.effects.push(Box::new(gravity));
}
