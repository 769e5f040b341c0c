//! `tongue-fit muscles`: the effect of each muscle alone, of bodies in the plane and in space.

use miette::{IntoDiagnostic, ensure, miette};
use serde_json::{Value, json};
use tongue_fit::body::{Body, Mesh};
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

/// A muscle that pulls alone, and what it does to the surface.
struct MuscleEffect {
    name: String,
    status: SolveStatus,
    alarms: Vec<Alarm>,
    /// Its length over that at rest.
    stretch: f64,
    /// By how much the foremost, highest and rearmost node of the surface at rest have moved forward and up, mm.
    moved: [[f64; 2]; 3],
    /// In space, by how much the body is wider.
    wider_mm: Option<f64>,
    positions: Vec<Point>,
    tensions: Vec<f64>,
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
    answer(each, (&body.mesh, palate, &title, "surface"), TissueModel::of(&body.mesh), &out, global)
}

/// Writes and prints what muscles do; each has rows, in the plane one for every muscle of the body.
fn answer(
    found: Vec<(MuscleEffect, Vec<Value>)>,
    (mesh, palate, title, surface): (&Mesh<2>, &[Point], &str, &str),
    tissue: TissueModel,
    out: &OutputDir,
    global: &Global,
) -> miette::Result<Outcome> {
    let (all, rows): (Vec<MuscleEffect>, Vec<_>) = found.into_iter().unzip();
    let rows = rows.concat();
    let panels: Vec<Panel> = all.iter().map(MuscleEffect::panel).collect();
    let picture = report::panels(mesh, palate, &panels, title).into_diagnostic()?;
    let by = super::provenance().with_tissue(tissue);
    let files: [(&str, &dyn Export); 2] = [("muscles.svg", &picture), ("muscles.csv", &Rows(&rows))];
    let record = json!({ "muscles": rows });
    output::write_and_answer(global, (Some(out), &files), &Json(&record), &by, || {
        text(title, &all, surface)
    })?;
    Ok(Outcome::of_muscles(all.iter().map(|a| (a.name.as_str(), a.status, a.alarms.len()))))
}

fn text(title: &str, all: &[MuscleEffect], surface: &str) -> String {
    let columns =
        ["pulling", "its length", "tip forward", "up", "top forward", "up", "root forward", "up", "wider"];
    let has_width = all.iter().any(|a| a.wider_mm.is_some());
    let t = table::rows(&columns[..columns.len() - usize::from(!has_width)], all, |a| {
        let first = [a.name.clone(), format!("{:+.1} %", 100.0 * (a.stretch - 1.0))];
        let moved = a.moved.into_iter().flatten().chain(a.wider_mm);
        first.into_iter().chain(moved.map(|v| format!("{:+.1} mm", (10.0 * v).round() / 10.0 + 0.0)))
    });
    let doubtful = all.iter().filter(|a| !a.alarms.is_empty());
    let doubts: String = doubtful.map(|a| format!("but of {}: {}\n", a.name, a.alarm_texts())).collect();
    format!(
        "{title}\n\n{t}\n{doubts}\ntip, top and root: the foremost, highest and rearmost point of the {surface} at rest\n\n"
    )
}

/// The equilibrium to which the tension of a muscle leads from rest.
fn in_plane(
    body: &Body<2>,
    model: &Model,
    name: &str,
    tension: f64,
) -> miette::Result<(MuscleEffect, Vec<Value>)> {
    let mesh = &body.mesh;
    let pulling: Vec<usize> = body.muscles_called(name).collect();
    let mut tensions = vec![0.0; mesh.muscles.len()];
    pulling.iter().for_each(|&m| tensions[m] = tension);
    let system = System::new(mesh, model, &pulling).into_diagnostic()?;
    let mut workspace = Workspace::new(&system);
    let found = statics::trace(&system, &mut workspace, &tensions, &SolveSettings::default());
    let positions = workspace.positions();
    let lengths = |m: usize| [system.rest(), positions].map(|x| system.length(x, m));
    let stretch = pulling.first().map_or(1.0, |&m| lengths(m)[1] / lengths(m)[0]);
    let alarms = alarms::of_equilibrium(&found.solution, found.critical);
    let alone = MuscleEffect {
        tensions,
        ..MuscleEffect::new(name, found.solution.status, alarms, stretch, mesh, positions)
    };
    let rows = (0..mesh.muscles.len()).map(|m| {
        let [rest, length] = lengths(m);
        let muscle = &mesh.muscles[m].name;
        let of_muscle = json!({ "muscle": muscle, "rest_length_mm": 1e3 * rest, "length_mm": 1e3 * length });
        alone.row(json!({ "tension_n_per_m": tension }), of_muscle, length / rest)
    });
    let rows = rows.collect();
    Ok((alone, rows))
}

/// The equilibrium to which the activation of a muscle on both sides leads from rest.
fn in_space(
    body: &Body<3>,
    model: &SpaceModel,
    section: &Mesh<2>,
    name: &str,
    activation: f64,
) -> miette::Result<(MuscleEffect, Vec<Value>)> {
    let activations = body.activations(&[(name, activation)]).map_err(|e| miette!("--activation: {e}"))?;
    let solved = space::solve(body, model, &activations, false)?;
    let surface = body.mesh.surface_nodes();
    let [after_mm, before_mm] = [&solved.positions, &body.mesh.nodes].map(|x| {
        let sides = surface.iter().map(|&n| x[n].y);
        let ends = sides.fold([0.0_f64; 2], |[low, high], y| [low.min(y), high.max(y)]);
        1e3 * (ends[1] - ends[0])
    });
    let wider_mm = Some(after_mm - before_mm);
    let [a, b] = body.mesh.muscles[body.both_sides(name).into_diagnostic()?[0]].ends();
    let stretch =
        (solved.positions[b] - solved.positions[a]).norm() / (body.mesh.nodes[b] - body.mesh.nodes[a]).norm();
    let flat = solved.midsagittal_positions();
    let (status, alarms) = (solved.found.solution.status, solved.alarms(body));
    let alone = MuscleEffect::new(name, status, alarms, stretch, section, &flat);
    let alone = MuscleEffect { wider_mm, ..alone };
    let row = alone.row(json!({ "activation": activation }), json!({}), stretch);
    Ok((alone, vec![row]))
}

impl MuscleEffect {
    fn new(
        name: &str,
        status: SolveStatus,
        alarms: Vec<Alarm>,
        stretch: f64,
        mesh: &Mesh<2>,
        positions: &[Point],
    ) -> Self {
        output::step(|| format!("{name}: {status:?}"));
        let surface = mesh.surface_nodes();
        let sides: [fn(&Point) -> f64; 3] = [|p| -p.x, |p| p.y, |p| p.x];
        let moved = sides.map(|of| {
            let most = surface.iter().max_by(|a, b| of(&mesh.nodes[**a]).total_cmp(&of(&mesh.nodes[**b])));
            let node = most.copied().unwrap_or_default();
            let way = positions[node] - mesh.nodes[node];
            // Forward is towards smaller x.
            [-1e3 * way.x, 1e3 * way.y]
        });
        let (name, positions) = (name.to_owned(), positions.to_vec());
        Self { name, status, alarms, stretch, moved, wider_mm: None, positions, tensions: Vec::new() }
    }

    fn alarm_texts(&self) -> String {
        self.alarms.iter().map(Alarm::to_string).collect::<Vec<_>>().join("; ")
    }

    /// A row of the table, with how it pulls, a muscle whose length is told, and that muscle's stretch.
    fn row(&self, pull: Value, muscle: Value, stretch: f64) -> Value {
        let [tip, top, root] = self.moved;
        let moved = json!({
            "stretch": stretch,
            "tip_forward_mm": tip[0], "tip_up_mm": tip[1],
            "top_forward_mm": top[0], "top_up_mm": top[1],
            "root_forward_mm": root[0], "root_up_mm": root[1],
        });
        let wider = self.wider_mm.map_or_else(|| json!({}), |mm| json!({ "wider_mm": mm }));
        let (name, status) = (json!({ "pulling": self.name }), json!({ "status": self.status }));
        let parts = [name, pull, status, muscle, moved, wider, json!({ "alarms": self.alarm_texts() })];
        parts.iter().filter_map(Value::as_object).flatten().map(|(k, v)| (k.clone(), v.clone())).collect()
    }

    /// Its picture, with its effect in words where that can be trusted.
    fn panel(&self) -> Panel {
        let [tip, top, _] = self.moved.map(table::forward_up);
        let lines = match self.status {
            SolveStatus::Converged if self.alarms.is_empty() => match self.wider_mm {
                None => vec![format!("tip {tip}"), format!("top {top}")],
                Some(mm) if mm.abs() < 0.05 => vec![format!("tip {tip}"), "as wide as at rest".to_owned()],
                Some(mm) => {
                    let word = if mm < 0.0 { "narrower" } else { "wider" };
                    vec![format!("tip {tip}"), format!("{:.1} mm {word}", mm.abs())]
                }
            },
            SolveStatus::Converged => self.alarms.iter().map(Alarm::to_string).collect(),
            other => vec![format!("not at equilibrium: {other:?}")],
        };
        let title = format!("{} shortens {:.0} %", self.name, 100.0 * (1.0 - self.stretch));
        Panel { title, lines, positions: self.positions.clone(), tensions: self.tensions.clone() }
    }
}
