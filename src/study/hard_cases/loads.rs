//! Cases 2 and 4: loads far beyond muscle, and chains that fold.

use crate::body::largest_distance;
use crate::statics::{Settings, Workspace, trace};
use crate::study::pulling;
use crate::system::{Model, OutsidePath, System};

use super::{Beside, Extent, Row, StabilityError, bodies, equilibrium_row, name_of};

/// Equal steps in which the branch from rest is followed.
const TRACE_STEPS: usize = 10;

/// Case 2: subsets of the muscles at 1, 10, 100 and 1000 N: all, or every 16th; each solved directly, and reached
/// once more along the branch that begins at rest.
pub(super) fn subsets(extent: Extent) -> Result<Vec<Row>, StabilityError> {
    let mesh = bodies::tongue()?;
    let all = mesh.muscle_names();
    let stride = if extent == Extent::Full { 1 } else { 16 };
    let mut rows = Vec::new();
    // Ends with the set of all.
    for set in (1..1u32 << all.len()).rev().step_by(stride) {
        let contracting: Vec<usize> = (0..all.len()).filter(|m| set >> m & 1 == 1).collect();
        let names: Vec<&str> = contracting.iter().map(|&m| all[m].as_str()).collect();
        let system = System::new(&mesh, &Model::default(), &contracting)?;
        let mut workspace = Workspace::new(&system);
        for load in [1.0, 10.0, 100.0, 1000.0] {
            let variant = format!("{} at {load} N", names.join(" "));
            let tensions = tensions(&system, &contracting, load);
            let (_, row) = equilibrium_row(2, variant, &system, &mut workspace, &tensions);
            rows.push(beside_branch(row, &system, &mut workspace, &tensions));
        }
    }
    Ok(rows)
}

/// Follows the branch from rest to the load of a row whose answer is in the workspace, and sets the two side by side.
fn beside_branch(row: Row, system: &System<2>, workspace: &mut Workspace<2>, tensions: &[f64]) -> Row {
    let direct = workspace.positions().to_vec();
    let found = trace(system, workspace, tensions, &Settings::default(), TRACE_STEPS);
    let ends_at = found.critical.map_or(1.0, |c| c.load);
    let branch = Beside { ends_at, apart_m: largest_distance(&direct, workspace.positions()) };
    let mut note = row.note.clone();
    if !branch.is_on_it() {
        let text = match found.critical {
            Some(c) => {
                format!("the branch from rest ends at {:.4} of the load ({})", c.load, name_of(&c.kind))
            }
            None => "the branch from rest leads elsewhere".to_owned(),
        };
        note += &format!(
            "{}{text}; {:.1e} m from there",
            if note.is_empty() { "" } else { "; " },
            branch.apart_m
        );
    }
    Row { branch: Some(branch), note, ..row }
}

/// Case 4: SGp and HGp passive and contracting, alone and with the rest, as straight paths and as chains.
pub(super) fn folding_chains() -> Result<Vec<Row>, StabilityError> {
    let mesh = bodies::tongue()?;
    let all = mesh.muscle_names();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
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
    for outside in [OutsidePath::Straight, OutsidePath::Chain] {
        for (name, set) in sets {
            let pull: Vec<(&str, f64)> = set.iter().map(|m| (*m, 0.0)).collect();
            let (contracting, _) = pulling(&mesh, &pull)?;
            let system = System::new(&mesh, &Model { outside, ..Model::default() }, &contracting)?;
            let mut workspace = Workspace::new(&system);
            for load in [5.0, 50.0, 500.0] {
                let variant = format!("{name} at {load} N, {}", name_of(&outside));
                let tensions = tensions(&system, &contracting, load);
                rows.push(equilibrium_row(4, variant, &system, &mut workspace, &tensions).1);
            }
        }
    }
    Ok(rows)
}

fn tensions(system: &System<2>, contracting: &[usize], load: f64) -> Vec<f64> {
    let mut all = vec![0.0; system.muscle_count()];
    contracting.iter().for_each(|&m| all[m] = load);
    all
}
