//! `tongue-fit muscles`: the effect of each muscle alone, of bodies in the plane and in space.

use miette::{IntoDiagnostic, ensure, miette};
use nalgebra::{SVector, Vector3};
use serde::Serialize;
use tongue_fit::body::{Body, Mesh, SpaceBody};
use tongue_fit::geometry::Point;
use tongue_fit::inverse::alarms::{self, Alarm};
use tongue_fit::report::{self, Export, Json, OutputDir, Panel, Rows};
use tongue_fit::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_fit::system::{Model, SpaceModel, System, TissueModel};

use super::{Global, Outcome, body, output, space, table};

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Examples:\n  \
    tongue-fit muscles --out results/muscles\n  \
    tongue-fit muscles --tension 30\n  \
    tongue-fit muscles --body space --activation 0.05")]
pub struct Arguments {
    /// Tension of the active muscle of a body in the plane, N per metre of thickness [default: 15]
    #[arg(long, value_name = "N")]
    tension: Option<f64>,
    /// Activation of the active muscle of a body in space (--body space), from 0 to 1 [default: 0.1]
    #[arg(long, value_name = "A")]
    activation: Option<f64>,
    #[command(flatten)]
    body: body::Arguments,
    #[command(flatten)]
    space: space::ModelArguments,
}

/// The effect of one muscle on three places of the surface, in the plane on the length of each muscle, and in space on its own length
/// and on the width.
#[derive(Debug, Clone, Default, Serialize)]
struct Effect {
    pulling: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    tension_n_per_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    activation: Option<f64>,
    status: Option<SolveStatus>,
    #[serde(skip_serializing_if = "Option::is_none")]
    muscle: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rest_length_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_mm: Option<f64>,
    stretch: f64,
    tip_forward_mm: f64,
    tip_up_mm: f64,
    top_forward_mm: f64,
    top_up_mm: f64,
    root_forward_mm: f64,
    root_up_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    wider_mm: Option<f64>,
    alarms: String,
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let tension = arguments.tension.unwrap_or(15.0);
    ensure!(
        tension.is_finite() && tension > 0.0,
        "--tension {tension}: a tension must be finite and above 0, because muscles only pull"
    );
    let what = "What each muscle does alone, at";
    if let Some(source) = arguments.body.space() {
        let (body, model) = (arguments.space.body(source)?, arguments.space.model()?);
        let activation = arguments.activation.unwrap_or(0.1);
        let out = global.folder("results/muscles")?;
        let section = body.midsagittal_mesh();
        ensure!(
            !section.cells.is_empty(),
            "{} has no elements beside the midsagittal plane y = 0, which is shown",
            body.what
        );
        let each = body.groups().into_iter().map(|name| in_space(&body, &model, &section, &name, activation));
        let each = each.collect::<miette::Result<Vec<_>>>()?;
        let title = format!("{what} an activation of {activation}: {}", body.what);
        let shown = (&section, &[][..], title.as_str(), "midsagittal surface");
        return answer(each, shown, TissueModel::Hexahedra, &out, global);
    }
    let body = arguments.body.body()?;
    let model = arguments.body.model();
    let out = global.folder("results/muscles")?;
    let mut names: Vec<&str> = body.mesh.muscles.iter().map(|m| m.name.as_str()).collect();
    names.dedup();
    let equilibria = names.len() as f64;
    body::tell_duration("each muscle alone", body.mesh.nodes.len(), equilibria * body::EQUILIBRIUM_S);
    ensure!(!names.is_empty(), "{} has no muscles; name curves of its mesh after them", body.what);
    let each = names.iter().map(|name| in_plane(&body, &model, name, tension));
    let each = each.collect::<miette::Result<Vec<_>>>()?;
    let title = format!("{what} {tension} N per metre of thickness");
    let palate = body.palate.as_deref().unwrap_or_default();
    answer(each, (&body.mesh, palate, &title, "surface"), model.tissue, &out, global)
}

fn answer(
    found: Vec<(Vec<Effect>, Panel)>,
    (mesh, palate, title, surface): (&Mesh<2>, &[Point], &str, &str),
    tissue: TissueModel,
    out: &OutputDir,
    global: &Global,
) -> miette::Result<Outcome> {
    #[derive(Serialize)]
    struct Record {
        muscles: Vec<Effect>,
    }
    let (effects, panels): (Vec<_>, Vec<Panel>) = found.into_iter().unzip();
    let record = Record { muscles: effects.concat() };
    let picture = report::panels(mesh, palate, &panels, title).into_diagnostic()?;
    let by = super::provenance().with_tissue(tissue);
    let files: [(&str, &dyn Export); 2] =
        [("muscles.svg", &picture), ("muscles.csv", &Rows(&record.muscles))];
    let text = || text(title, &record.muscles, surface);
    output::write_and_answer(global, (Some(out), &files), &Json(&record), &by, text)?;
    let solved = record.muscles.iter().map(|e| (e.pulling.as_str(), e.status, e.alarms.len()));
    Ok(Outcome::of_muscles(solved))
}

fn text(title: &str, effects: &[Effect], surface: &str) -> String {
    let own: Vec<&Effect> =
        effects.iter().filter(|e| e.muscle.as_ref().is_none_or(|m| *m == e.pulling)).collect();
    let columns =
        ["pulling", "its length", "tip forward", "up", "top forward", "up", "root forward", "up", "wider"];
    let has_width = own.iter().any(|e| e.wider_mm.is_some());
    let t = table::rows(&columns[..columns.len() - usize::from(!has_width)], &own, |e| {
        let mm = |v: f64| format!("{:+.1} mm", (10.0 * v).round() / 10.0 + 0.0);
        let ways =
            [e.tip_forward_mm, e.tip_up_mm, e.top_forward_mm, e.top_up_mm, e.root_forward_mm, e.root_up_mm];
        let first = [e.pulling.clone(), format!("{:+.1} %", 100.0 * (e.stretch - 1.0))];
        first.into_iter().chain(ways.into_iter().chain(e.wider_mm).map(mm))
    });
    let doubtful = own.iter().filter(|e| !e.alarms.is_empty());
    let doubts: String = doubtful.map(|e| format!("but of {}: {}\n", e.pulling, e.alarms)).collect();
    format!(
        "{title}\n\n{t}\n{doubts}\ntip, top and root: the foremost, highest and rearmost point of the {surface} at rest\n\n"
    )
}

/// The equilibrium to which the tension of a muscle leads from rest.
fn in_plane(body: &Body<2>, model: &Model, name: &str, tension: f64) -> miette::Result<(Vec<Effect>, Panel)> {
    let mesh = &body.mesh;
    let pulling: Vec<usize> = body.muscles_called(name).collect();
    let mut tensions = vec![0.0; mesh.muscles.len()];
    pulling.iter().for_each(|&m| tensions[m] = tension);
    let system = System::new(mesh, model, &pulling).into_diagnostic()?;
    let mut workspace = Workspace::new(&system);
    let found = statics::trace(&system, &mut workspace, &tensions, &SolveSettings::default());
    let positions = workspace.positions();
    let alarms = alarms::of_equilibrium(&found.solution, found.critical);
    let (own, [tip, top, _]) = effect(name, found.solution.status, &alarms, mesh, positions);
    let of_muscle = |number: usize| {
        let [rest, length] = [system.rest(), positions].map(|x| system.length(x, number));
        Effect {
            tension_n_per_m: Some(tension),
            muscle: Some(mesh.muscles[number].name.clone()),
            rest_length_mm: Some(1e3 * rest),
            length_mm: Some(1e3 * length),
            stretch: length / rest,
            ..own.clone()
        }
    };
    let effects: Vec<Effect> = (0..mesh.muscles.len()).map(of_muscle).collect();
    let stretch = pulling.first().map_or(1.0, |&m| effects[m].stretch);
    let lines = vec![format!("tip {}", table::forward_up(tip)), format!("top {}", table::forward_up(top))];
    Ok((
        effects,
        panel(name, stretch, (found.solution.status, &alarms), lines, (positions.to_vec(), tensions)),
    ))
}

/// The equilibrium to which the activation of a muscle on both sides leads from rest.
fn in_space(
    body: &SpaceBody,
    model: &SpaceModel,
    section: &Mesh<2>,
    name: &str,
    activation: f64,
) -> miette::Result<(Vec<Effect>, Panel)> {
    let activations = body.activations(&[(name, activation)]).map_err(|e| miette!("--activation: {e}"))?;
    let solved = space::solve(body, model, &activations, false)?;
    let flat = solved.midsagittal_positions();
    let (status, alarms) = (solved.found.solution.status, solved.found.alarms);
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
    let (own, [tip, ..]) = effect(name, status, &alarms, section, &flat);
    let width = match wider_mm.abs() < 0.05 {
        true => "as wide as at rest".to_owned(),
        false => format!("{:.1} mm {}", wider_mm.abs(), if wider_mm < 0.0 { "narrower" } else { "wider" }),
    };
    let lines = vec![format!("tip {}", table::forward_up(tip)), width];
    let effect = Effect { activation: Some(activation), stretch, wider_mm: Some(wider_mm), ..own };
    Ok((vec![effect], panel(name, stretch, (status, &alarms), lines, (flat, Vec::new()))))
}

/// What an equilibrium does to the surface: the effect, and by how much its foremost, highest and rearmost node at rest have moved forward
/// and up, mm.
fn effect(
    name: &str,
    status: SolveStatus,
    alarms: &[Alarm],
    mesh: &Mesh<2>,
    positions: &[SVector<f64, 2>],
) -> (Effect, [[f64; 2]; 3]) {
    output::step(|| format!("{name}: {status:?}"));
    let surface = mesh.surface_nodes();
    let most = |of: fn(&SVector<f64, 2>) -> f64| {
        let best = surface.iter().max_by(|a, b| of(&mesh.nodes[**a]).total_cmp(&of(&mesh.nodes[**b])));
        best.copied().unwrap_or_default()
    };
    let moved = [most(|p| -p.x), most(|p| p.y), most(|p| p.x)].map(|node| {
        let way = positions[node] - mesh.nodes[node];
        // Forward is towards smaller x.
        [-1e3 * way.x, 1e3 * way.y]
    });
    let effect = Effect {
        pulling: name.to_owned(),
        status: Some(status),
        tip_forward_mm: moved[0][0],
        tip_up_mm: moved[0][1],
        top_forward_mm: moved[1][0],
        top_up_mm: moved[1][1],
        root_forward_mm: moved[2][0],
        root_up_mm: moved[2][1],
        alarms: alarms.iter().map(Alarm::text).collect::<Vec<_>>().join("; "),
        ..Effect::default()
    };
    (effect, moved)
}

/// The picture of a muscle's effect, with these lines where it can be trusted.
fn panel(
    name: &str,
    stretch: f64,
    (status, alarms): (SolveStatus, &[Alarm]),
    lines: Vec<String>,
    (positions, tensions): (Vec<SVector<f64, 2>>, Vec<f64>),
) -> Panel {
    let title = format!("{name} shortens {:.0} %", 100.0 * (1.0 - stretch));
    let lines = match status {
        SolveStatus::Converged if alarms.is_empty() => lines,
        SolveStatus::Converged => alarms.iter().map(Alarm::text).collect(),
        other => vec![format!("not at equilibrium: {other:?}")],
    };
    Panel { title, lines, positions, tensions }
}
