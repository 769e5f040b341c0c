//! How the areas of a body's cells differ from those at rest, and what that costs in a prior of shapes.

use tongue_core::body::Mesh;
use tongue_core::geometry::{Point, simplex};

/// A cell whose area changes by the factor e^0.4 costs as much as a standard deviation; all cells together have this weight.
const AREA_LOG: f64 = 0.4;
const AREA_WEIGHT: f64 = 40.0;
/// A cell with less of its area than this has folded.
pub(crate) const LEAST_AREA_RATIO: f64 = 0.15;

/// Of every cell by which factor its area differs where the nodes are at these places, m; negative where it is turned over.
pub(crate) fn area_ratios(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    let measure = |x: &[Point], cell: &[usize]| simplex::measure(&simplex::corners(x, cell));
    mesh.cells.iter().map(move |cell| measure(nodes, cell) / measure(&mesh.nodes, cell))
}

/// Of every cell by how many standard deviations the logarithm of its area differs, weighed. A cell that is turned over counts as one
/// with a millionth of its area; such a shape is refused anyway.
pub(crate) fn area_residuals(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    let weight = (AREA_WEIGHT / mesh.cells.len().max(1) as f64).sqrt() / AREA_LOG;
    area_ratios(mesh, nodes).map(move |ratio| weight * ratio.max(1e-6).ln())
}
