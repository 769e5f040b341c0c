//! Cases 2, 4 and 11: loads far above those of muscles, and chains that fold.

use crate::test_tensions::{TestTensions, tongue};
use tongue_core::body::{Body, ContinuumSettings, Mesh, largest_distance};
use tongue_core::statics::{SolveSettings, Workspace, trace};
use tongue_core::system::{Model, System};
use tongue_files::report::status_name;

use super::{HardCase, equilibrium_row, row_of};
use crate::Error;

/// Largest load to which the branch of a continuum is followed, N: at ten times this load its end takes hours to find.
pub(super) const FOLLOWED_N: f64 = 100.0;

/// The continuum of cases 3 and 11.
pub(super) fn continuum() -> Result<Mesh<2>, Error> {
    Ok(Body::continuum(8e-3, &ContinuumSettings::default())?.mesh)
}

/// Cases 2 and 11: subsets of the muscles at 1, 10, 100 and 1000 N. Each is solved directly and, up to `followed_n`, along the branch from
/// rest.
pub(super) fn subsets(mesh: &Mesh<2>, followed_n: f64, full: bool) -> Result<Vec<HardCase>, Error> {
    let all: Vec<&str> = mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    let stride = if full { 1 } else { 16 };
    let mut rows = Vec::new();
    // The first set in this order has all muscles.
    for set in (1..1u32 << all.len()).rev().step_by(stride) {
        let active: Vec<&str> = (0..all.len()).filter(|m| set >> m & 1 == 1).map(|m| all[m]).collect();
        for load in [1.0, 10.0, 100.0, 1000.0] {
            let variant = format!("{} at {load} N", active.join(" "));
            let TestTensions { system, tensions, .. } = all_at(mesh, &active, load)?;
            let mut workspace = Workspace::new(&system);
            let mut row = equilibrium_row(variant, &system, &mut workspace, &tensions);
            if load <= followed_n {
                row = beside_branch(row, &system, &mut workspace, &tensions);
            }
            rows.push(row);
        }
    }
    Ok(rows)
}

fn all_at(mesh: &Mesh<2>, muscles: &[&str], load: f64) -> Result<TestTensions, Error> {
    TestTensions::new(mesh, &Model::default(), &muscles.iter().map(|m| (*m, load)).collect::<Vec<_>>())
}

/// Follows the branch from rest to the load of a row, whose answer is in the workspace, and compares the two.
fn beside_branch(
    row: HardCase,
    system: &System<2>,
    workspace: &mut Workspace<2>,
    tensions: &[f64],
) -> HardCase {
    let direct = workspace.positions().to_vec();
    let traced = trace(system, workspace, tensions, &SolveSettings::default());
    let (critical, stopped) = (traced.from_rest.critical(), traced.from_rest.stopped());
    let ends_at = critical.map(|c| c.load).or(stopped).unwrap_or(1.0);
    let apart = largest_distance(&direct, workspace.positions());
    let row = HardCase { branch_ends_at: Some(ends_at), apart_from_branch_m: Some(apart), ..row };
    if row.is_on_branch() {
        return row;
    }
    let text = match critical {
        Some(c) => {
            format!("the branch from rest ends at {:.4} of the load ({})", c.load, status_name(&c.kind))
        }
        None => "the branch from rest leads to another equilibrium".to_owned(),
    };
    row.with_note(&text).with_note(&format!("{apart:.1e} m from there"))
}

/// Case 4: SGp and HGp, whose chains are straight outside the tissue, active or passive, alone and with others.
pub(super) fn folding_chains() -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let all: Vec<&str> = mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    let others: Vec<&str> = all.iter().copied().filter(|m| !["SGp", "HGp"].contains(m)).collect();
    let sets: [(&str, &[&str]); 6] = [
        ("SGp", &["SGp"]),
        ("HGp", &["HGp"]),
        ("SGp HGp", &["SGp", "HGp"]),
        ("passive beside GGa SGm HGa", &["GGa", "SGm", "HGa"]),
        ("passive, pushed by all others", &others),
        ("with all the rest", &all),
    ];
    let mut rows = Vec::new();
    for (name, set) in sets {
        for load in [5.0, 50.0, 500.0] {
            let variant = format!("{name} at {load} N, straight");
            rows.push(row_of(variant, &all_at(&mesh, set, load)?));
        }
    }
    Ok(rows)
}
