//! Choices that make a mesh into a model, and the coefficients that follow from them.

use super::SystemError;
use crate::body::Mesh;
use crate::geometry::simplex;
use crate::material::{Coefficients, Constants};

/// Choices that make a mesh into a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    pub constants: Constants,
}

/// The model of the tissue, which follows from the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TissueModel {
    /// Springs on the connections and a term that keeps each cell's measure, as the thesis does.
    MassSpring,
    /// Quadratic elements, muscles of finite width and bones that hold patches ([`crate::body::continuum`]).
    Continuum,
    /// Hexahedra with one mean volume each ([`crate::body::Body::tongue_in_space`]).
    Hexahedra,
}

impl TissueModel {
    pub fn of<const D: usize>(mesh: &Mesh<D>) -> Self {
        if mesh.continuum.is_some() {
            Self::Continuum
        } else if mesh.hexahedra.is_empty() {
            Self::MassSpring
        } else {
            Self::Hexahedra
        }
    }

    /// Whether an equilibrium costs much more than one of springs.
    pub fn is_expensive(self) -> bool {
        matches!(self, Self::Continuum | Self::Hexahedra)
    }
}

impl Default for Model {
    fn default() -> Self {
        Self { constants: Constants::TONGUE }
    }
}

/// Coefficients for a mesh: identified on an equilateral cell with the mesh's mean connection length as its
/// side, as in thesis 4.1.1.
pub fn coefficients<const D: usize>(mesh: &Mesh<D>, model: &Model) -> Result<Coefficients, SystemError> {
    let total: f64 = mesh.connections.iter().map(|&[a, b]| (mesh.nodes[b] - mesh.nodes[a]).norm()).sum();
    let side = total / mesh.connections.len().max(1) as f64;
    let of_cells = mesh.cells.iter().map(|c| simplex::measure(&simplex::corners(&mesh.nodes, c)));
    let measure = of_cells.chain(mesh.hexahedron_volumes()).sum();
    let in_tissue = mesh.in_tissue().iter().filter(|&&t| t).count().max(1);
    Coefficients::new::<D>(&model.constants, side, measure, in_tissue)
}

/// Spring constant of every connection of the mesh, N/m (2D: per metre of thickness). In the plane every connection has
/// k once, as in the thesis. In space, where a connection belongs to several tetrahedra, it has k for each of them.
pub fn connection_stiffness<const D: usize>(mesh: &Mesh<D>, coefficients: &Coefficients) -> Vec<f64> {
    let k = coefficients.tissue_stiffness;
    if D == 2 {
        return vec![k; mesh.connections.len()];
    }
    let cells_of = mesh.cells.edges();
    // Outside the tissue a connection belongs to no cell and keeps the k of one.
    mesh.connections.iter().map(|c| k * cells_of.get(c).copied().unwrap_or(1) as f64).collect()
}
