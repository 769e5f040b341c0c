//! Why an anatomy cannot be meshed.

use crate::body::MeshFault;

/// Why there is no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A spacing that is too fine or too coarse for this anatomy.
    #[error(
        "the mesh spacing {h_mm} mm is not usable; for this anatomy give {least_mm:.2} to {most_mm:.1} mm"
    )]
    Spacing {
        /// The spacing asked for, mm.
        h_mm: f64,
        /// The finest, mm.
        least_mm: f64,
        /// The coarsest, mm.
        most_mm: f64,
    },
    /// Outline and muscle lines come too near each other for nodes of their own.
    #[error(
        "near [{x_mm:.1}, {y_mm:.1}] mm two lines of outline and muscles collide at this spacing; try a finer one"
    )]
    LinesCollide {
        /// Where, mm.
        x_mm: f64,
        /// Where, mm.
        y_mm: f64,
    },
    /// Two nodes of different lines are one point.
    #[error("two nodes fall on the same place at this spacing; try a finer one")]
    CoincidentNodes,
    /// The inside cannot take as many nodes as the area calls for.
    #[error("{missing} nodes find no room at this spacing; try a finer one")]
    NoRoom {
        /// How many are left over.
        missing: usize,
    },
    /// Arithmetic left the finite numbers.
    #[error("a node's position is not finite")]
    NotFinite,
    /// What was built does not hang together.
    #[error("the mesh is faulty ({0}); try another spacing")]
    Fault(#[from] MeshFault),
}
