//! How much springs in space lock: one cube of them, bent.

use nalgebra::Vector3;

use super::{Model, System, SystemError};
use crate::body::solid;
use crate::effect::Configuration;

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
    let bent = |p: &Vector3<f64>| {
        let r = p - Vector3::repeat(0.5 * side);
        let down = -0.5 * (r.x * r.x - nu * r.y * r.y + nu * r.z * r.z);
        p + Vector3::new(r.x * r.z, -nu * r.y * r.z, down) / (RADIUS * side)
    };
    let positions: Vec<Vector3<f64>> = mesh.nodes.iter().map(bent).collect();
    let energy = system.energy(Configuration { positions: &positions, tensions: &[] });
    let exact = model.constants.young_modulus * side.powi(3) / (24.0 * RADIUS * RADIUS);
    Ok(Some(exact / energy).filter(|kept| kept.is_finite()))
}
