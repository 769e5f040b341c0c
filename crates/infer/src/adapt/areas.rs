//! Changes of the areas of a body's cells relative to rest, and their cost in a prior of shapes.

use tongue_core::body::Mesh;
use tongue_core::geometry::{Point, simplex};

use crate::standard_deviations::LN_AREA;

/// The weight of all cells together.
const AREA_WEIGHT: f64 = 40.0;
/// A cell that keeps less than the first number of its area resists further compression by the second number times as much.
const SQUEEZED: (f64, f64) = (0.7, 4.0);
/// A cell that keeps less than this part of its area counts as folded.
pub(crate) const LEAST_AREA_RATIO: f64 = 0.15;

/// A speaker's tongue keeps this part of every cell's area, and the length of every muscle to this factor.
pub(crate) const TRUSTED_AREA: f64 = 0.5;
pub(crate) const TRUSTED_STRETCH: f64 = 1.35;

/// Whether a speaker's tongue could have the nodes of a mesh at these places, m, before it is turned and scaled.
pub(crate) fn is_believable(mesh: &Mesh<2>, nodes: &[Point]) -> bool {
    let length = |nodes: &[Point], [a, b]: [usize; 2]| (nodes[a] - nodes[b]).norm();
    let stretches = mesh.muscles.iter().map(|m| length(nodes, m.ends()) / length(&mesh.nodes, m.ends()));
    area_ratios(mesh, nodes).all(|r| r > TRUSTED_AREA)
        && stretches.map(f64::ln).all(|s| s.abs() < TRUSTED_STRETCH.ln())
}

/// Ratio of every cell's area with the nodes at these places, m, to its area in the mesh; negative for a cell that is turned over.
pub(crate) fn area_ratios(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    let measure = |x: &[Point], cell: &[usize]| simplex::measure(&simplex::corners(x, cell));
    mesh.cells.iter().map(move |cell| measure(nodes, cell) / measure(&mesh.nodes, cell))
}

/// For every cell, the change of the logarithm of its area, in standard deviations and weighted. A cell that is turned over counts as one
/// with a millionth of its area; such a shape is rejected anyway.
pub(crate) fn area_residuals(mesh: &Mesh<2>, nodes: &[Point]) -> impl Iterator<Item = f64> {
    let weight = (AREA_WEIGHT / mesh.cells.len().max(1) as f64).sqrt() / LN_AREA;
    let (from, factor) = (SQUEEZED.0.ln(), SQUEEZED.1 - 1.0);
    let resisted = move |log: f64| weight * (log + factor * (log - from).min(0.0));
    area_ratios(mesh, nodes).map(move |ratio| resisted(ratio.max(1e-6).ln()))
}
