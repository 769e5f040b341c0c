//! The model of a body's tissue, its coefficients, and how much springs in space lock.

use nalgebra::Vector3;

use super::{System, SystemError};
use crate::body::{Mesh, solid};
use crate::effect::Configuration;
use crate::geometry::simplex;
use crate::material::{Coefficients, Model};

/// The model of the tissue, which follows from the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TissueModel {
    /// Springs on the connections and a term that keeps each cell's measure, as in the thesis.
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

/// Coefficients of a mesh, matched on a regular cell whose side is the mean length of its connections, as in thesis 4.1.1.
pub fn coefficients<const D: usize>(mesh: &Mesh<D>, model: &Model) -> Result<Coefficients, SystemError> {
    let total: f64 = mesh.connections.iter().map(|&[a, b]| (mesh.nodes[b] - mesh.nodes[a]).norm()).sum();
    let side = total / mesh.connections.len().max(1) as f64;
    let of_cells = mesh.cells.iter().map(|c| simplex::measure(&simplex::corners(&mesh.nodes, c)));
    let measure = of_cells.chain(mesh.hexahedron_volumes()).sum();
    let in_tissue = mesh.in_tissue().iter().filter(|&&t| t).count().max(1);
    Coefficients::new::<D>(model, side, measure, in_tissue)
}

/// Spring constant of every connection of the mesh, N/m (2D: per metre of thickness): k in the plane, as in the thesis; in space k for
/// each of the tetrahedra to which the connection belongs.
pub fn connection_stiffness<const D: usize>(mesh: &Mesh<D>, coefficients: &Coefficients) -> Vec<f64> {
    let k = coefficients.tissue_stiffness;
    if D == 2 {
        return vec![k; mesh.connections.len()];
    }
    let cells_of = mesh.cells.edges();
    // A connection outside the tissue belongs to no cell and has k once.
    mesh.connections.iter().map(|c| k * cells_of.get(c).copied().unwrap_or(1) as f64).collect()
}

/// Poisson's ratio above which locking of springs is computed.
const LOCKS_ABOVE: f64 = 0.45;
/// Radius of the bent cube over its side, for which the strain is small.
const RADIUS: f64 = 1e3;

/// The part of its deflection that a cube of springs on the edges of six tetrahedra keeps in bending: the exact energy of pure bending,
/// `E/2 ∫ (z/R)²`, over that of the springs at the same displacements of the corners. `None` up to a Poisson's ratio of `LOCKS_ABOVE`.
pub fn bending_kept(model: &Model, side: f64) -> Result<Option<f64>, SystemError> {
    let nu = model.poisson_ratio;
    if nu <= LOCKS_ABOVE {
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
    let exact = model.young_modulus * side.powi(3) / (24.0 * RADIUS * RADIUS);
    Ok(Some(exact / energy).filter(|kept| kept.is_finite()))
}
