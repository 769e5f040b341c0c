//! Errors of making a system from a mesh and a model.

use crate::body::{MeshFault, SpaceFault, TooLarge};
use crate::limits::BeyondLimit;

/// Why a system cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// A constant out of range, or a body that would need too much memory.
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    /// A cell to which coefficients are matched has no area (m²) or volume (m³).
    #[error("the cell to match has measure {0}; it must be positive")]
    Degenerate(f64),
    /// A muscle number that the mesh does not have.
    #[error("muscle number {muscle} does not exist; the mesh has {count} muscles")]
    NoSuchMuscle {
        muscle: usize,
        /// How many there are.
        count: usize,
    },
    /// A part of the body is joined to no bone and could move freely.
    #[error(
        "node {node} (and all that is joined to it) is joined to no bone, so it could move freely: fix at least one of its nodes"
    )]
    Loose {
        /// A node of the loose part.
        node: usize,
    },
    /// A node is to be carried along by a bone that does not hold it.
    #[error("node {node} is to be carried by a bone, but no bone holds it; fix it in the mesh")]
    NotOnBone { node: usize },
    /// A negative coefficient of incompressibility: the energy has no minimum.
    #[error(
        "Poisson's ratio {poisson_ratio} needs a negative coefficient of incompressibility ({kappa:e} J), with which the \
         energy has no minimum; springs alone already have 0.25, so give at least that, or take a continuum"
    )]
    NegativeKappa {
        /// The identified kappa_s or kappa_v, J.
        kappa: f64,
        /// Poisson's ratio ν.
        poisson_ratio: f64,
    },
    /// A continuum is asked for, but the body is not one.
    #[error(
        "the body is a mesh of linear cells; make it a continuum first (--body continuum, Body::into_continuum)"
    )]
    NotAContinuum,
    #[error("the mesh is faulty: {0}")]
    Mesh(#[from] MeshFault),
    /// A body in space that cannot be used.
    #[error("the body is faulty: {0}")]
    Space(#[from] SpaceFault),
    /// Constants of a law that make no solid.
    #[error(
        "C10 = {c10} Pa, C20 = {c20} Pa and K = {bulk} Pa make no solid: C10 and K must be positive, C20 not negative"
    )]
    Law {
        /// C10, Pa.
        c10: f64,
        /// C20, Pa.
        c20: f64,
        /// Bulk modulus, Pa.
        bulk: f64,
    },
    /// The body is far larger than any tongue.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}
