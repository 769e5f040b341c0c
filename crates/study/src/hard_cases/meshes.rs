//! Case 5: degenerate, invalid and large meshes.

use std::time::Instant;

use nalgebra::SVector;

use tongue_core::body::{Cells, Mesh};
use tongue_core::statics::Workspace;
use tongue_core::system::{Model, System, SystemError};

use super::{HardCase, HowMany, bodies, equilibrium_row};
use crate::Error;

/// Slivers are solved, invalid meshes are refused with a reason, and 50 000 nodes are solved (in a sample:
/// 5000).
pub(super) fn broken_and_large(extent: HowMany) -> Result<Vec<HardCase>, Error> {
    let good = bodies::lattice(8, 6, 5e-3);
    let mut rows = Vec::new();
    for flatness in [1e-1, 1e-3, 1e-6] {
        let mut mesh = good.clone();
        mesh.nodes.iter_mut().for_each(|p| p.y *= flatness);
        rows.push(solved(format!("slivers: height x {flatness:e}"), &mesh, 5.0)?);
    }
    let mut pinned = good.clone();
    pinned.fixed = vec![0];
    rows.push(solved("one bone point only".to_owned(), &pinned, 5.0)?);

    type Spoil = fn(&mut Mesh<2>);
    let broken: [(&str, Spoil); 8] = [
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
    for (name, spoil) in broken {
        let mut mesh = good.clone();
        spoil(&mut mesh);
        let refused = System::new(&mesh, &Model::default(), &[0]).err();
        rows.push(HardCase::refusal(5, name, "system", refused.map(|e| e.to_string())));
    }
    let side = if extent == HowMany::Full { 224 } else { 71 };
    let mesh = bodies::lattice(side, side, 0.05 / side as f64);
    rows.push(solved(format!("{} nodes", side * side), &mesh, 0.05)?);
    Ok(rows)
}

fn solved(variant: String, mesh: &Mesh<2>, load: f64) -> Result<HardCase, SystemError> {
    let clock = Instant::now();
    let system = System::new(mesh, &Model::default(), &[0])?;
    let mut workspace = Workspace::new(&system);
    let made = clock.elapsed().as_secs_f64();
    let row = equilibrium_row(5, variant, &system, &mut workspace, &[load]);
    Ok(row.also(&format!("system made in {made:.2} s")))
}

fn invert_first(mesh: &mut Mesh<2>) {
    let mut cells = Cells::new();
    for (i, cell) in mesh.cells.iter().enumerate() {
        let mut cell = cell.to_vec();
        if i == 0 {
            cell.reverse();
        }
        cells.push(&cell);
    }
    mesh.cells = cells;
}
