//! Case 3: extreme materials.

use crate::test_tensions::{PUBLISHED_A, TestTensions, tongue};
use tongue_core::body::{Body, ContinuumSettings, Mesh};
use tongue_core::effect::spring::Spring;
use tongue_core::effect::{Connections, Effect, Incompressibility};
use tongue_core::geometry::topology;
use tongue_core::material::Constants;
use tongue_core::statics::Workspace;
use tongue_core::system::{Model, System, SystemError, coefficients};

use super::loads::CONTINUUM_M;
use super::{HardCase, equilibrium_row};
use crate::Error;

/// Solves at the published tensions with Poisson's ratio up to 0.4999999, kappa_s from zero to a million
/// times the identified one, and stiffnesses of neighbours that differ by a factor of up to a million.
pub(super) fn extremes() -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let mut rows = Vec::new();
    let mut solved = |variant: String, system: &System<2>, tensions: &[f64]| {
        rows.push(equilibrium_row(3, variant, system, &mut Workspace::new(system), tensions));
    };
    let of = |poisson_ratio| Model { constants: Constants { poisson_ratio, ..Constants::TONGUE } };
    for nu in [0.25, 0.26, 0.3, 0.49, 0.499, 0.49999, 0.4999999] {
        let TestTensions { system, tensions, .. } = TestTensions::new(&mesh, &of(nu), &PUBLISHED_A)?;
        solved(format!("nu = {nu}"), &system, &tensions);
    }
    let continuum = Body::continuum(CONTINUUM_M, &ContinuumSettings::default())?.mesh;
    for nu in [-0.5, 0.0, 0.2, 0.49, 0.499, 0.49999] {
        let TestTensions { system, tensions, .. } = TestTensions::new(&continuum, &of(nu), &PUBLISHED_A)?;
        solved(format!("nu = {nu}, continuum"), &system, &tensions);
    }
    let TestTensions { system, tensions, .. } = TestTensions::new(&mesh, &Model::default(), &PUBLISHED_A)?;
    for factor in [0.0, 1e-6, 1e-3, 1e3, 1e6] {
        let changed = uneven(&mesh, system.contracting(), factor, 1.0)?;
        solved(format!("kappa_s x {factor:e}"), &changed, &tensions);
    }
    for contrast in [1e-6, 1e-3, 1e3, 1e6] {
        let changed = uneven(&mesh, system.contracting(), 1.0, contrast)?;
        solved(format!("every second connection's k x {contrast:e}"), &changed, &tensions);
    }
    for nu in [0.0, 0.5] {
        let refused = TestTensions::new(&mesh, &of(nu), &PUBLISHED_A).err().map(|e| e.to_string());
        rows.push(HardCase::refusal(3, &format!("nu = {nu}"), "system", refused));
    }
    Ok(rows)
}

/// The body with kappa_s times a factor, and every second connection's stiffness times another.
fn uneven(
    mesh: &Mesh<2>,
    contracting: &[usize],
    kappa_factor: f64,
    contrast: f64,
) -> Result<System<2>, SystemError> {
    let c = coefficients(mesh, &Model::default())?;
    let mut springs: Vec<Option<Spring>> = Vec::new();
    for (i, &[a, b]) in mesh.connections.iter().enumerate() {
        let k = c.tissue_stiffness * if i % 2 == 0 { 1.0 } else { contrast };
        springs.push(Some(Spring::new([a, b], k, (mesh.nodes[b] - mesh.nodes[a]).norm())));
    }
    let mut effects: Vec<Box<dyn Effect<2>>> = Vec::new();
    for &muscle in contracting {
        let mut own = Vec::new();
        for pair in mesh.muscles[muscle].nodes.windows(2) {
            if let Ok(i) = mesh.connections.binary_search(&topology::pair(pair[0], pair[1])) {
                own.extend(springs[i].take());
            }
        }
        effects.push(Box::new(Connections::muscle(muscle, own, Vec::new(), 1.0)));
    }
    effects.push(Box::new(Connections::tissue(springs.into_iter().flatten().collect(), 0.0)));
    if kappa_factor > 0.0 {
        effects.push(Box::new(Incompressibility::new(c.kappa * kappa_factor, &mesh.cells, &mesh.nodes)));
    }
    System::from_effects(mesh, c, effects, contracting)
}
