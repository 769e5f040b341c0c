//! Cases 3 and 5: extreme materials, and degenerate, invalid and large meshes.

use nalgebra::SVector;

use super::loads::continuum;
use super::{HardCase, bodies, equilibrium_row, row_of};
use crate::Error;
use crate::measure::timed;
use crate::test_tensions::{PUBLISHED_A, TestTensions, tongue, with_poisson_ratio};
use tongue_core::body::{Cells, Mesh};
use tongue_core::effect::spring::Spring;
use tongue_core::effect::{Connections, Effect, Incompressibility};
use tongue_core::geometry::topology;
use tongue_core::system::{Model, System, SystemError, coefficients};

/// Case 3: the published tensions with Poisson's ratios up to 0.4999999, kappa_s from zero to a million times the identified one, and
/// stiffnesses of neighbours that differ by factors up to a million.
pub(super) fn extremes() -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let mut rows = Vec::new();
    let body_at = |mesh: &Mesh<2>, nu: f64| TestTensions::new(mesh, &with_poisson_ratio(nu), &PUBLISHED_A);
    for nu in [0.25, 0.26, 0.3, 0.49, 0.499, 0.49999, 0.4999999] {
        rows.push(row_of(format!("nu = {nu}"), &body_at(&mesh, nu)?));
    }
    let continuum = continuum()?;
    for nu in [-0.5, 0.0, 0.2, 0.49, 0.499, 0.49999] {
        rows.push(row_of(format!("nu = {nu}, continuum"), &body_at(&continuum, nu)?));
    }
    let mut body = TestTensions::new(&mesh, &Model::default(), &PUBLISHED_A)?;
    for factor in [0.0, 1e-6, 1e-3, 1e3, 1e6] {
        body.system = with_factors(&mesh, body.system.contracting(), factor, 1.0)?;
        rows.push(row_of(format!("kappa_s x {factor:e}"), &body));
    }
    for contrast in [1e-6, 1e-3, 1e3, 1e6] {
        body.system = with_factors(&mesh, body.system.contracting(), 1.0, contrast)?;
        rows.push(row_of(format!("every second connection's k x {contrast:e}"), &body));
    }
    for nu in [0.0, 0.5] {
        let refused = body_at(&mesh, nu).err().map(|e| e.to_string());
        rows.push(HardCase::refusal(&format!("nu = {nu}"), "system", refused));
    }
    Ok(rows)
}

/// The tongue with kappa_s times a factor, and the stiffness of every second connection times another.
fn with_factors(
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

/// Case 5: slivers are solved, invalid meshes are refused with a reason, and 50 000 nodes are solved (5000 in a sample).
pub(super) fn broken_and_large(full: bool) -> Result<Vec<HardCase>, Error> {
    let good = bodies::lattice(8, 6, 5e-3);
    let mut rows = Vec::new();
    for flatness in [1e-1, 1e-3, 1e-6] {
        let mut mesh = good.clone();
        mesh.nodes.iter_mut().for_each(|p| p.y *= flatness);
        rows.push(solve_case(format!("slivers: height x {flatness:e}"), &mesh, 5.0)?);
    }
    let mut pinned = good.clone();
    pinned.fixed = vec![0];
    rows.push(solve_case("one bone point only".to_owned(), &pinned, 5.0)?);

    type Damage = fn(&mut Mesh<2>);
    let broken: [(&str, Damage); 8] = [
        ("triangle of height 1e-12 of its side", |m| m.nodes.iter_mut().for_each(|p| p.y *= 1e-12)),
        ("inverted triangle", |m| invert_first(m)),
        ("duplicate node", |m| m.nodes[9] = m.nodes[10]),
        ("connection of zero length", |m| {
            let copy = m.nodes[0];
            m.nodes.push(copy);
            let last = m.nodes.len() - 1;
            m.connections.insert(0, [0, last]);
        }),
        ("disconnected piece", |m| {
            m.nodes.extend([SVector::from([0.1, 0.1]), SVector::from([0.11, 0.1])]);
            let n = m.nodes.len();
            m.connections.push([n - 2, n - 1]);
        }),
        ("no bone", |m| m.fixed.clear()),
        ("a position that is not a number", |m| m.nodes[9].x = f64::NAN),
        ("millimetres given as metres", |m| m.nodes.iter_mut().for_each(|p| *p *= 1000.0)),
    ];
    for (name, damage) in broken {
        let mut mesh = good.clone();
        damage(&mut mesh);
        let refused = System::new(&mesh, &Model::default(), &[0]).err();
        rows.push(HardCase::refusal(name, "system", refused.map(|e| e.to_string())));
    }
    let side = if full { 224 } else { 71 };
    let mesh = bodies::lattice(side, side, 0.05 / side as f64);
    rows.push(solve_case(format!("{} nodes", side * side), &mesh, 0.05)?);
    Ok(rows)
}

fn solve_case(variant: String, mesh: &Mesh<2>, load: f64) -> Result<HardCase, SystemError> {
    let (system, made) = timed(|| System::new(mesh, &Model::default(), &[0]));
    let system = system?;
    let (row, _) = equilibrium_row(variant, &system, &[load]);
    Ok(row.with_note(&format!("system made in {made:.2} s")))
}

fn invert_first(mesh: &mut Mesh<2>) {
    let all = std::mem::replace(&mut mesh.cells, Cells::new());
    for (i, cell) in all.iter().enumerate() {
        let turned: Vec<usize> = cell.iter().rev().copied().collect();
        mesh.cells.push(if i == 0 { &turned } else { cell });
    }
}
