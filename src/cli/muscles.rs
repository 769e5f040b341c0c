//! `tongue-fit muscles`: the effect of each muscle alone.

use miette::{IntoDiagnostic, miette};
use serde::Serialize;
use tongue_fit::body::Body;
use tongue_fit::inverse::alarms::{self, Alarm};
use tongue_fit::report::{self, Panel};
use tongue_fit::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{Model, System};

use super::muscle_effects::{Effect, answer, moved_mm, text, way};
use super::{Global, Outcome, body, output, space, space_muscles};

/// Options of `tongue-fit muscles`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit muscles --out results/muscles\n  \
    tongue-fit muscles --tension 30\n  \
    tongue-fit muscles --body space --activation 0.05")]
pub struct Arguments {
    /// Tension of the active muscle of a body in the plane, N per metre of thickness [default: 15]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    tension: Option<f64>,
    /// Activation of the active muscle of a body in space (--body space), from 0 to 1 [default: 0.1]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    activation: Option<f64>,
    #[command(flatten)]
    body: body::Arguments,
    #[command(flatten)]
    space: space::ModelArguments,
}

/// The effect of one muscle on the length of a muscle and on three places of the surface.
#[derive(Debug, Clone, Serialize)]
struct Row {
    pulling: String,
    tension_n_per_m: f64,
    status: SolveStatus,
    muscle: String,
    rest_length_mm: f64,
    length_mm: f64,
    stretch: f64,
    tip_forward_mm: f64,
    tip_up_mm: f64,
    top_forward_mm: f64,
    top_up_mm: f64,
    root_forward_mm: f64,
    root_up_mm: f64,
    alarms: String,
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let tension = arguments.tension.unwrap_or(15.0);
    if !(tension.is_finite() && tension > 0.0) {
        return Err(miette!(
            "--tension {tension}: a tension must be finite and above 0, because muscles only pull"
        ));
    }
    if let Some(source) = arguments.body.space() {
        let (body, model) = (arguments.space.body(source)?, arguments.space.model()?);
        return space_muscles::run(
            &body,
            &model,
            arguments.activation.unwrap_or(0.1),
            &global.folder("results/muscles")?,
            global,
        );
    }
    let body = arguments.body.body()?;
    let model = arguments.body.model();
    let out = global.folder("results/muscles")?;
    let mut names: Vec<&str> = body.mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    names.dedup();
    if names.is_empty() {
        return Err(miette!("{} has no muscles; name curves of its mesh after them", body.what));
    }
    let (mut rows, mut panels) = (Vec::new(), Vec::new());
    for name in &names {
        let (found, panel) = alone(&body, &model, name, tension)?;
        rows.extend(found);
        panels.push(panel);
    }
    let title = format!("What each muscle does alone, at {tension} N per metre of thickness");
    let palate = body.palate.as_deref().unwrap_or_default();
    let picture = report::panels(&body.mesh, palate, &panels, &title).into_diagnostic()?;
    let by = super::provenance().with_tissue(model.tissue);
    let effects = rows.iter().filter(|r| r.pulling == r.muscle).map(|r| Effect {
        pulling: &r.pulling,
        stretch: r.stretch,
        ways_mm: vec![
            r.tip_forward_mm,
            r.tip_up_mm,
            r.top_forward_mm,
            r.top_up_mm,
            r.root_forward_mm,
            r.root_up_mm,
        ],
        alarms: &r.alarms,
    });
    let text = text(&title, &effects.collect::<Vec<_>>(), "surface");
    let outcome = Outcome::of_muscles(rows.iter().map(|r| (r.pulling.as_str(), r.status, r.alarms.len())));
    answer(&rows, &picture, text, &by, (&out, global))?;
    Ok(outcome)
}

/// The equilibrium to which the tension of the muscle `name` leads from rest.
fn alone(body: &Body<2>, model: &Model, name: &str, tension: f64) -> miette::Result<(Vec<Row>, Panel)> {
    let mesh = &body.mesh;
    let pulling: Vec<usize> = body.muscles_called(name).collect();
    let mut tensions = vec![0.0; mesh.muscles.len()];
    pulling.iter().for_each(|&m| tensions[m] = tension);
    let system = System::new(mesh, model, &pulling).into_diagnostic()?;
    let mut workspace = Workspace::new(&system);
    let found =
        statics::trace(&system, &mut workspace, &tensions, &SolveSettings::default(), statics::TRACE_STEPS);
    let positions = workspace.positions();
    let status = found.solution.status;
    let alarms: Vec<String> =
        alarms::of_equilibrium(&found.solution, found.critical).iter().map(Alarm::text).collect();
    output::step(|| format!("{name}: {status:?}"));
    let [tip, top, root] = moved_mm(mesh, positions);
    let row = |number: usize| {
        let [rest, length] = [system.rest(), positions].map(|x| system.length(x, number));
        Row {
            pulling: name.to_owned(),
            tension_n_per_m: tension,
            status,
            muscle: mesh.muscles[number].name.clone(),
            rest_length_mm: 1e3 * rest,
            length_mm: 1e3 * length,
            stretch: length / rest,
            tip_forward_mm: tip[0],
            tip_up_mm: tip[1],
            top_forward_mm: top[0],
            top_up_mm: top[1],
            root_forward_mm: root[0],
            root_up_mm: root[1],
            alarms: alarms.join("; "),
        }
    };
    let rows: Vec<Row> = (0..mesh.muscles.len()).map(row).collect();
    let own = rows.iter().find(|r| r.muscle == name).map_or(1.0, |r| r.stretch);
    let title = format!("{name} shortens {:.0} %", 100.0 * (1.0 - own));
    let lines = match status {
        SolveStatus::Converged if !alarms.is_empty() => alarms,
        SolveStatus::Converged => vec![format!("tip {}", way(tip)), format!("top {}", way(top))],
        other => vec![format!("not at equilibrium: {other:?}")],
    };
    Ok((rows, Panel { title, lines, positions: positions.to_vec(), tensions }))
}
