//! `tongue-fit muscles --body space`: the effect of each muscle of a body in space alone, both sides.

use miette::{IntoDiagnostic, miette};
use nalgebra::{Vector2, Vector3};
use serde::Serialize;
use tongue_fit::body::{Mesh, SpaceBody};
use tongue_fit::report::{self, OutputDir, Panel};
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::{SpaceModel, TissueModel};

use super::muscle_effects::{Effect, answer, moved_mm, text, way};
use super::{Global, Outcome, output, space};

/// The effect of one muscle on three places of the midsagittal surface and on the width.
#[derive(Debug, Clone, Serialize)]
struct Row {
    pulling: String,
    activation: f64,
    status: SolveStatus,
    stretch: f64,
    tip_forward_mm: f64,
    tip_up_mm: f64,
    top_forward_mm: f64,
    top_up_mm: f64,
    root_forward_mm: f64,
    root_up_mm: f64,
    wider_mm: f64,
    alarms: String,
}

/// The effect of each muscle at an activation.
///
/// # Errors
/// An activation out of range, a faulty body, files that cannot be written.
pub fn run(
    body: &SpaceBody,
    model: &SpaceModel,
    activation: f64,
    out: &OutputDir,
    global: &Global,
) -> miette::Result<Outcome> {
    let section = body.midsagittal_mesh();
    if section.cells.is_empty() {
        return Err(miette!(
            "{} has no elements beside the midsagittal plane y = 0, which is shown",
            body.what
        ));
    }
    let (mut rows, mut panels) = (Vec::new(), Vec::new());
    for name in body.groups() {
        let (row, panel) = alone(body, model, &section, &name, activation)?;
        rows.push(row);
        panels.push(panel);
    }
    let title = format!("What each muscle does alone, at an activation of {activation}: {}", body.what);
    let picture = report::panels(&section, &[], &panels, &title).into_diagnostic()?;
    let by = super::provenance().with_tissue(TissueModel::Hexahedra);
    let effects = rows.iter().map(|r| Effect {
        pulling: &r.pulling,
        stretch: r.stretch,
        ways_mm: vec![
            r.tip_forward_mm,
            r.tip_up_mm,
            r.top_forward_mm,
            r.top_up_mm,
            r.root_forward_mm,
            r.root_up_mm,
            r.wider_mm,
        ],
        alarms: &r.alarms,
    });
    let text = text(&title, &effects.collect::<Vec<_>>(), "midsagittal surface");
    let outcome = Outcome::of_muscles(rows.iter().map(|r| (r.pulling.as_str(), r.status, r.alarms.len())));
    answer(&rows, &picture, text, &by, (out, global))?;
    Ok(outcome)
}

/// The equilibrium to which a muscle leads from rest.
fn alone(
    body: &SpaceBody,
    model: &SpaceModel,
    section: &Mesh<2>,
    name: &str,
    activation: f64,
) -> miette::Result<(Row, Panel)> {
    let activations = body.activations(&[(name, activation)]).map_err(|e| miette!("--activation: {e}"))?;
    let solved = space::solve(body, model, &activations, false)?;
    let status = solved.found.solution.status;
    output::step(|| format!("{name}: {status:?}"));
    let flat: Vec<Vector2<f64>> = solved.positions.iter().map(|p| Vector2::new(p.x, p.z)).collect();
    let [tip, top, root] = moved_mm(section, &flat);
    let surface = body.mesh.surface_nodes();
    let width = |x: &[Vector3<f64>]| {
        let sides = surface.iter().map(|&n| x[n].y);
        let ends = sides.fold([0.0_f64; 2], |[low, high], y| [low.min(y), high.max(y)]);
        1e3 * (ends[1] - ends[0])
    };
    let wider_mm = width(&solved.positions) - width(&body.mesh.nodes);
    let [a, b] = body.mesh.muscles[body.muscles_called(name).into_diagnostic()?[0]].ends();
    let length = |x: &[Vector3<f64>]| (x[b] - x[a]).norm();
    let stretch = length(&solved.positions) / length(&body.mesh.nodes);
    let alarms: Vec<String> = solved.found.alarms.iter().map(|a| a.text()).collect();
    let lines = match status {
        SolveStatus::Converged if !alarms.is_empty() => alarms.clone(),
        SolveStatus::Converged => {
            let width = match wider_mm.abs() < 0.05 {
                true => "as wide as at rest".to_owned(),
                false => {
                    format!("{:.1} mm {}", wider_mm.abs(), if wider_mm < 0.0 { "narrower" } else { "wider" })
                }
            };
            vec![format!("tip {}", way(tip)), width]
        }
        other => vec![format!("not at equilibrium: {other:?}")],
    };
    let title = format!("{name} shortens {:.0} %", 100.0 * (1.0 - stretch));
    let row = Row {
        pulling: name.to_owned(),
        activation,
        status,
        stretch,
        tip_forward_mm: tip[0],
        tip_up_mm: tip[1],
        top_forward_mm: top[0],
        top_up_mm: top[1],
        root_forward_mm: root[0],
        root_up_mm: root[1],
        wider_mm,
        alarms: alarms.join("; "),
    };
    Ok((row, Panel { title, lines, positions: flat, tensions: Vec::new() }))
}
