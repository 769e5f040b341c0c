//! Choices that make a mesh into a model, the coefficients that follow from them, and how much springs in space lock.

use nalgebra::Vector3;

use super::{System, SystemError};
use crate::body::{Mesh, solid};
use crate::effect::Configuration;
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

/// Above this Poisson's ratio it is told how much springs lock.
pub const TOLD_ABOVE: f64 = 0.45;
/// Radius of the bent cube, in its sides: a small strain.
const RADIUS: f64 = 1e3;

/// Which part of its deflection a cube of springs on the edges of six tetrahedra keeps when it is bent: the
/// exact energy of pure bending, `E/2 ∫ (z/R)²`, over that of the springs at the same displacements of the
/// corners. `None` where Poisson's ratio is at most [`TOLD_ABOVE`].
pub fn bending_kept(model: &Model, side: f64) -> Result<Option<f64>, SystemError> {
    let nu = model.constants.poisson_ratio;
    if nu <= TOLD_ABOVE {
        return Ok(None);
    }
    let mesh = solid::block([side; 3], [1; 3]);
    let system = System::new(&mesh, model, &[])?;
    let positions: Vec<Vector3<f64>> = Vec::from_iter(mesh.nodes.iter().map(|p| {
        let r = p - Vector3::repeat(0.5 * side);
        let down = -0.5 * (r.x * r.x - nu * r.y * r.y + nu * r.z * r.z);
        p + Vector3::new(r.x * r.z, -nu * r.y * r.z, down) / (RADIUS * side)
    }));
    let energy = system.energy(Configuration { positions: &positions, tensions: &[] });
    let exact = model.constants.young_modulus * side.powi(3) / (24.0 * RADIUS * RADIUS);
    Ok(Some(exact / energy).filter(|kept| kept.is_finite()))
}
