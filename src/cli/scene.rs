use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use nalgebra::SVector;
use serde_json::json;
use tongue_fit::body::{AnyBody, Body};
use tongue_fit::dynamics::MotionOutcome;
use tongue_fit::inner::report::{
    self, Export, Json, OutputDir, Provenance, ReportError, SectionPicture, Svg, Vtu,
};
use tongue_fit::inner::scene::run::in_axes_of_body;
use tongue_fit::inner::scene::{ScenePlan, force_unit};
use tongue_fit::inner::surgery::OperationRecord;
use tongue_fit::scene::{self, Prepared, Scene, SceneBody, SceneOutcome, Want, build, prepare};

use super::table::{self, align_left, newtons, rows};
use super::{Global, Outcome, inputs, output, sound};

/// Letters in a line of a reason.
const REASON: usize = 50;

#[derive(Debug, Clone, clap::Subcommand)]
#[command(
    after_help = "Examples:\n  tongue-fit scene explain vowel-a\n  tongue-fit scene run vowel-i-palate --out results/scenes"
)]
pub enum SceneAction {
    /// List the scenes that are built in
    #[command(after_help = "Example:\n  tongue-fit scene list")]
    List,
    /// Show what is simulated for a scene, what is left out, and why
    #[command(
        after_help = "Examples:\n  tongue-fit scene explain vowel-a\n  tongue-fit scene explain my-scene.toml --json"
    )]
    Explain(Which),
    /// Run a scene; with --out its picture and its numbers are written
    #[command(after_help = "Examples:\n  \
        tongue-fit scene run vowel-i-palate --out results/scenes\n  \
        tongue-fit scene run my-scene.toml")]
    Run(Which),
    /// Print the JSON schema of scene files, with which editors complete them
    #[command(after_help = "Example:\n  tongue-fit scene schema > scene.schema.json")]
    Schema,
}

#[derive(Debug, Clone, clap::Args)]
pub struct Which {
    /// A built-in scene, or the path of a scene file (TOML)
    #[arg(value_name = "NAME")]
    name: PathBuf,
}

pub fn run(action: &SceneAction, global: &Global) -> Result<Outcome> {
    match action {
        SceneAction::List => list(global),
        SceneAction::Schema => {
            output::print(&output::json(&Scene::schema())?)?;
            Ok(Outcome::Good)
        }
        SceneAction::Explain(which) => {
            let scene = load(&which.name)?;
            let plan = match body_of(&scene)? {
                AnyBody::Flat(body) => prepare(&scene, body)?.plan,
                AnyBody::Solid(body) => prepare(&scene, body)?.plan,
            };
            output::tell(global, &plan, || plan_text(&plan))?;
            Ok(Outcome::Good)
        }
        SceneAction::Run(which) => run_one(&which.name, global),
    }
}

fn list(global: &Global) -> Result<Outcome> {
    let listed = scene::names().map(|name| Ok((name, scene::shipped(name)?.title)));
    let listed: Vec<(&str, String)> = listed.collect::<Result<_>>()?;
    let scenes = listed.iter().map(|(name, title)| json!({ "name": name, "title": title }));
    let record = json!({ "scenes": scenes.collect::<Vec<_>>() });
    output::tell(global, &record, || {
        listed.iter().map(|(name, title)| format!("{name:<20}{title}\n")).collect()
    })?;
    Ok(Outcome::Good)
}

fn load(path: &Path) -> Result<Scene> {
    let name = path.to_string_lossy();
    if scene::names().any(|n| n == name) || !(path.exists() || name.ends_with(".toml")) {
        return Ok(scene::shipped(&name)?);
    }
    let text = inputs::text("the scene file", path)?;
    Ok(Scene::from_toml(&text, &name)?)
}

/// The body of a scene; concerns about its mesh file are printed.
fn body_of(scene: &Scene) -> Result<AnyBody> {
    let SceneBody::Mesh(mesh) = &scene.body else { return Ok(build(scene, &mut |_| ())?) };
    Ok(build(scene, &mut |concern| output::note(&format!("{}: {concern}", mesh.file)))?)
}

fn run_one(name: &Path, global: &Global) -> Result<Outcome> {
    let out = global.given_folder()?;
    let scene = load(name)?;
    let to = out.as_ref().map(|out| (out, name));
    let (result, by, written) = match body_of(&scene)? {
        AnyBody::Flat(body) => run_body(&scene, body, to, section)?,
        AnyBody::Solid(body) => run_body(&scene, body, to, solid)?,
    };
    output::answer(global, &Json(&result), &by, &written, || outcome_text(&result))?;
    let is_penetrated = result.contact.as_ref().is_some_and(|contact| contact.edge_through_wall);
    let failed = if is_penetrated { "the surface passes through the wall" } else { "it did not converge" };
    let failed = (!result.converged).then(|| failed.to_owned());
    let made_up = result.operation.iter().flat_map(OperationRecord::doubts);
    Ok(Outcome::of_alarms(failed.into_iter().chain(made_up), &result.alarms))
}

/// The picture of a body in the plane at these positions of its nodes, m.
fn section(
    prepared: &Prepared<2>,
    positions: &[SVector<f64, 2>],
    result: &SceneOutcome,
) -> Result<Svg, ReportError> {
    let Prepared { plan, body, wall, .. } = prepared;
    let shown = wall.as_ref().map(|w| &w.outline[..]).or(body.palate.as_deref()).unwrap_or_default();
    let section = SectionPicture::new(&body.mesh, positions, result.pulls.values(), shown, &plan.title);
    report::tongue(&SectionPicture { contact: wall.is_some(), ..section })
}

fn solid(
    prepared: &Prepared<3>,
    positions: &[SVector<f64, 3>],
    result: &SceneOutcome,
) -> Result<Svg, ReportError> {
    let title = &prepared.plan.title;
    if !prepared.body.is_activated() {
        return report::solid(&prepared.body.mesh, positions, title);
    }
    let mut body = prepared.body.clone();
    body.mesh.nodes = in_axes_of_body(&body.mesh.nodes);
    let positions = in_axes_of_body(positions);
    report::views(&body, &positions, result.pulls.values(), title, result.operation.as_ref())
}

/// Runs a scene with its body, and writes files that are named after it. Returns the outcome, the provenance and the files.
fn run_body<const D: usize>(
    scene: &Scene,
    body: Body<D>,
    to: Option<(&OutputDir, &Path)>,
    draw: impl FnOnce(&Prepared<D>, &[SVector<f64, D>], &SceneOutcome) -> Result<Svg, ReportError>,
) -> Result<(SceneOutcome, Provenance, Vec<PathBuf>)> {
    let mut prepared = prepare(scene, body)?;
    let plan = &prepared.plan;
    output::step(|| {
        let on: Vec<&str> = plan.effects.iter().filter(|e| e.simulated).map(|e| e.effect).collect();
        format!("{}; {}; {} unknowns; simulated: {}", plan.body, plan.method, plan.unknowns, on.join(", "))
    });
    let an_iteration_us = plan.effects.iter().map(|e| e.estimated_us).sum::<f64>() + plan.estimated_factor_us;
    let is_moved = scene.points.is_some() || scene.want == Want::Trajectory;
    let (iterations, tell): (f64, fn(&str, f64, &str)) = match () {
        () if scene.fit.is_some() => (20_000.0, output::tell_duration),
        () if is_moved => (1000.0, output::tell_duration),
        () => (250.0, output::tell_duration_of_equilibrium),
    };
    let seconds = an_iteration_us * 1e-6 * iterations;
    let faster = match &scene.body {
        SceneBody::TongueInSpace(given) if given.refined => "refined = false is faster",
        SceneBody::TongueInSpace(_) | SceneBody::Mesh(_) => "a coarser mesh is faster",
        _ => "a larger h_mm is faster",
    };
    tell(&format!("{} nodes", plan.nodes), seconds, faster);
    let settings = prepared.body.mesh.continuum.as_ref().map(|c| &c.settings);
    let by = super::provenance().with_tissue(prepared.system.tissue()).with_chosen(settings);
    let to = to.map(|(out, name)| {
        let stem = name.file_stem().unwrap_or(name.as_os_str()).to_string_lossy();
        let names = ["svg", "json", "vtu", "csv"].map(|extension| format!("{stem}.{extension}"));
        refuse_to_overwrite(scene, out, &names).map(|()| (out, names))
    });
    let to = to.transpose()?;
    let result = scene::run(scene, &mut prepared)?;
    let Some((out, names)) = to else { return Ok((result, by, Vec::new())) };
    let positions: Vec<_> = result.positions_m.iter().map(|p| SVector::from_column_slice(p)).collect();
    let picture = draw(&prepared, &positions, &result)?;
    let vtu = Vtu::of(&prepared.body, &positions, result.pulls.values())?;
    let vtu = vtu.with_stresses(prepared.system.stresses(&positions));
    let lengths = result.trajectory.as_ref().map(|_| lengths_over_time(&result));
    let json = Json(&result);
    let mut files: Vec<(&str, &dyn Export)> =
        vec![(&names[0], &picture), (&names[1], &json), (&names[2], &vtu)];
    files.extend(lengths.iter().map(|table| (names[3].as_str(), table as &dyn Export)));
    let written = out.export(&files, &by)?;
    Ok((result, by, written))
}

fn refuse_to_overwrite(scene: &Scene, out: &OutputDir, names: &[String]) -> Result<()> {
    if let SceneBody::Mesh(mesh) = &scene.body
        && let Ok(mesh) = Path::new(&mesh.file).canonicalize()
        && let Some(name) = names.iter().find(|n| out.path().join(n).canonicalize().is_ok_and(|p| p == mesh))
    {
        bail!(
            "the results would overwrite the mesh of the scene, {name}; name another folder with --out, or rename the scene"
        );
    }
    Ok(())
}

fn plan_text(plan: &ScenePlan) -> String {
    let mut text = format!("{}\n{}\n{}\n\n", plan.title, plan.body, plan.method);
    let mut t = rows(&["effect", "", "elements", "µs", "why"], &plan.effects, |e| {
        let [mark, elements, cost] = if e.simulated {
            ["on".to_owned(), e.elements.to_string(), format!("{:.1}", e.estimated_us)]
        } else {
            ["-".to_owned(), String::new(), String::new()]
        };
        [e.effect.to_owned(), mark, elements, cost, report::wrap_text(&e.why, REASON).join("\n")]
    });
    align_left(&mut t, [4]);
    let _ = writeln!(text, "{t}\n");
    let mut t = rows(&["muscle", "", "why"], &plan.muscles, |m| {
        [m.muscle.as_str(), if m.contracting { "on" } else { "-" }, &m.why]
    });
    align_left(&mut t, [2]);
    if !plan.muscles.is_empty() {
        let _ = writeln!(text, "{t}\n");
    }
    let _ = writeln!(
        text,
        "{} unknowns ({} nodes in {}D); stiffness {} nonzeros, factor {}\n\
         µs: estimated for one iteration (energy, force, stiffness)\n\
         a factorisation: about {:.0} µs, {} operations, {}",
        plan.unknowns,
        plan.nodes,
        plan.dimension,
        plan.nonzeros,
        plan.factor_nonzeros,
        plan.estimated_factor_us,
        plan.factor_operations,
        if plan.factor_in_supernodes { "in supernodes (faer)" } else { "block by block" }
    );
    text
}

fn outcome_text(o: &SceneOutcome) -> String {
    let mut text = format!("{}\n{}\n{}\n\n", o.plan.title, o.plan.body, o.plan.method);
    let unit = force_unit(o.plan.dimension);
    if !o.muscles.is_empty() {
        let is_activated = o.plan.effect("hexahedra").is_some();
        let tension = if is_activated { "activation".to_owned() } else { format!("tension {unit}") };
        let interval = o.points.as_ref().map(|_| "95 % on this body");
        let columns: Vec<&str> = ["muscle", tension.as_str()]
            .into_iter()
            .chain(interval)
            .chain(["rest mm", "length mm", "stretch"])
            .collect();
        let t = rows(&columns, &o.muscles, |m| {
            let interval = m.interval_n.map(|[low, high]| format!("{low:.2} to {high:.2}"));
            let pull = m.pull.value();
            let pull = if is_activated { pull.to_string() } else { newtons(pull) };
            let [rest, length] = [m.rest_mm, m.length_mm].map(|v| format!("{v:.2}"));
            let end = [rest, length, format!("{:.3}", m.stretch)];
            [m.muscle.clone(), pull].into_iter().chain(interval).chain(end)
        });
        let _ = writeln!(text, "{t}\n");
    }
    if let Some(p) = &o.points {
        let muscles = o.plan.muscles.len();
        let _ = writeln!(
            text,
            "points met to {:.2} mm (RMS), {}; {} of {muscles} directions of tension are resolved, the others come from the prior\n",
            p.rms_mm.unwrap_or(f64::NAN),
            report::status_in_words(&p.status),
            p.resolved,
        );
    }
    if let Some(found) = &o.sound {
        text += &sound::formants(found, None);
    }
    let penetrated = o.contact.as_ref().is_some_and(|c| c.edge_through_wall);
    let verdict = match o.converged {
        true => "converged",
        false if penetrated => "PENETRATED (see below; do not trust the shape)",
        false => "NOT CONVERGED (do not trust the shape)",
    };
    let measure = if o.plan.dimension == 2 { "area" } else { "volume" };
    let _ = writeln!(
        text,
        "{verdict}, {:.2} ms; cells at {:.1} % to {:.1} % of their {measure} at rest, the whole at {:.2} %",
        1e3 * o.wall_s,
        100.0 * o.min_cell_ratio,
        100.0 * o.max_cell_ratio,
        100.0 * o.measure_ratio
    );
    if let Some(s) = &o.solution {
        text += table::connection_to_rest(s.connection);
    }
    text += &table::alarms(&o.alarms);
    if o.min_cell_ratio <= 0.0 {
        text += "A CELL IS INVERTED: springs alone do not prevent that; ask for effects.incompressibility = true\n";
    }
    text += &o.operation.as_ref().map_or_else(String::new, table::operation);
    if let Some(c) = &o.contact {
        let _ = writeln!(
            text,
            "{} nodes touch the wall and press on it with {} {unit}; the largest {:.2} {unit}; the closest at {:.3} mm",
            c.touching,
            vector(&c.on_wall_n),
            c.largest_n,
            c.closest_mm
        );
        if c.edge_through_wall {
            text += "PENETRATED: between two nodes the surface passes through a corner of the wall; refine the mesh\n";
        }
    }
    if let Some(force) = &o.on_bones_n {
        let _ = writeln!(text, "force of the body on the bones: {} {unit}", vector(force));
    }
    if let Some(t) = &o.trajectory {
        let MotionOutcome { status, time_s, counts } = t.outcome;
        let _ = writeln!(
            text,
            "{status:?} at {time_s} s: {} steps, {} rejected, {} factorisations",
            counts.steps, counts.rejected, counts.factorisations
        );
        text += &table::way_gone(time_s, t.part_of_way_to_equilibrium);
    }
    if let Some(s) = &o.solution {
        let _ = writeln!(
            text,
            "{} iterations, {} factorisations, {} energies; largest residual force {:.1e} {unit}\n",
            s.iterations, s.factorisations, s.energy_evaluations, s.max_residual_force
        );
    }
    if !o.time_by_effect.is_empty() {
        let whole = if o.trajectory.is_some() { "in all µs" } else { "in the solve µs" };
        let header = ["effect", "energy µs", "force µs", "stiffness µs", whole];
        let t = rows(&header, &o.time_by_effect, |e| {
            let each = [e.energy_us, e.force_us, e.stiffness_us, e.total_us];
            [e.effect.to_owned()].into_iter().chain(each.map(|us| format!("{us:.2}")))
        });
        let _ = writeln!(text, "{t}");
    }
    text
}

fn lengths_over_time(o: &SceneOutcome) -> report::Table {
    let lengths = o.muscles.iter().map(|m| format!("{}_mm", m.muscle));
    let rows = o.trajectory.iter().flat_map(|t| &t.moments).map(|m| {
        std::iter::once(m.time_s).chain(m.lengths_mm.iter().copied()).map(|v| v.to_string()).collect()
    });
    report::Table {
        columns: std::iter::once("time_s".to_owned()).chain(lengths).collect(),
        rows: rows.collect(),
    }
}

fn vector(v: &[f64]) -> String {
    format!("({})", report::joined(v.iter().map(|x| report::with_decimals(*x, 3)), ", "))
}
