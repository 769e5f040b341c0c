//! Bodies changed to either side, from which the answers to sources of error are differences.

use nalgebra::SVector;
use tongue_core::system::System;

/// A changed body with the same unknowns as the body of a posterior.
#[derive(Debug)]
pub struct PerturbedBody {
    pub(super) system: System<2>,
    pub(super) hyoid: Vec<usize>,
    /// Displacements of the hyoid's nodes for one radian, m.
    pub(super) turn: Vec<SVector<f64, 2>>,
}

/// Two bodies changed in opposite directions, and by how many standard deviations.
pub type Pair = ([PerturbedBody; 2], f64);

/// Changed bodies for every source of errors; none for a source that is known or has no effect in the body.
#[derive(Debug)]
pub struct PerturbedBodies {
    pub(super) ends: Vec<Pair>,
    pub(super) outline: Vec<Pair>,
    pub(super) width: Option<Pair>,
    pub(super) patch: Option<Pair>,
}
