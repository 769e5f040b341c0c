//! Errors of meshing an anatomy.

use crate::body::MeshFault;

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    #[error(
        "the mesh spacing {h_mm} mm is not usable; for this anatomy, whose outline is {extent_mm:.1} mm across, give \
         {least_mm:.2} to {most_mm:.1} mm (is it in millimetres?)"
    )]
    Spacing { h_mm: f64, extent_mm: f64, least_mm: f64, most_mm: f64 },
    #[error(
        "near [{x_mm:.1}, {y_mm:.1}] mm two lines of outline and muscles collide at this spacing; try a finer one"
    )]
    LinesCollide { x_mm: f64, y_mm: f64 },
    #[error("two nodes fall on the same place at this spacing; try a finer one")]
    CoincidentNodes,
    #[error("{missing} nodes find no room at this spacing; try a finer one")]
    NoRoom { missing: usize },
    #[error("a node's position is not finite")]
    NotFinite,
    #[error("the mesh is faulty ({0}); try another spacing")]
    Fault(#[from] MeshFault),
}
