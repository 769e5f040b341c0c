//! Errors of making a system from a mesh and a model.

use crate::body::{BodyError, MeshFault, TooLarge};
use crate::limits::BeyondLimit;

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    /// A cell to which coefficients are matched has no area (m²) or volume (m³).
    #[error("the cell to match has measure {0}; it must be positive")]
    Degenerate(f64),
    #[error("muscle number {muscle} does not exist; the mesh has {count} muscles")]
    NoSuchMuscle { muscle: usize, count: usize },
    #[error(
        "node {node} (and all that is joined to it) is joined to no bone, so it could move freely: fix at least one of its nodes"
    )]
    Loose { node: usize },
    #[error("node {node} is to be carried by a bone, but no bone holds it; fix it in the mesh")]
    NotOnBone { node: usize },
    /// A negative coefficient of incompressibility: the energy has no minimum.
    #[error(
        "Poisson's ratio {poisson_ratio} needs a negative coefficient of incompressibility ({kappa:e} J), with which the \
         energy has no minimum; springs alone already have 0.25, so give at least that, or take a continuum"
    )]
    NegativeKappa { kappa: f64, poisson_ratio: f64 },
    #[error("the mesh is faulty: {0}")]
    Mesh(#[from] MeshFault),
    #[error("the body is faulty: {0}")]
    Space(#[from] BodyError),
    #[error(
        "C10 = {c10} Pa, C20 = {c20} Pa and K = {bulk} Pa make no solid: C10 and K must be positive, C20 not negative"
    )]
    Law { c10: f64, c20: f64, bulk: f64 },
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
}
