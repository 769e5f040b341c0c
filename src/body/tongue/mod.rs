//! The mesher of tongues: from an outline, muscle lines and bones ([`Anatomy`]) to nodes, connections and triangles.

mod anatomy;
mod anchors;
mod build;
mod fill;
mod frame;
mod smooth;
mod triangulate;

pub use anatomy::{Anatomy, AnatomyError, AnatomyProblem, Bone, MuscleLine, OutsidePart, REFERENCE};
pub use build::{DEFAULT_SPACING_M, MeshError, build};
