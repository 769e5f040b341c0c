use std::path::{Path, PathBuf};

use anyhow::bail;
use nalgebra::SVector;
use serde_json::json;
use tongue_fit::body::{AnyBody, Body};
use tongue_fit::inner::report::{
    self, Export, Json, OutputDir, Provenance, ReportError, SectionPicture, Svg, Vtu,
};
use tongue_fit::inner::scene::run::in_axes_of_body;
use tongue_fit::inner::surgery::OperationRecord;
use tongue_fit::scene::{self, Prepared, Scene, SceneBody, SceneOutcome as Answer, Want, build, prepare};

use super::{Global, Outcome, inputs, output, scene_table};

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

pub fn run(action: &SceneAction, global: &Global) -> anyhow::Result<Outcome> {
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
            output::tell(global, &plan, || scene_table::plan(&plan))?;
            Ok(Outcome::Good)
        }
        SceneAction::Run(which) => run_one(&which.name, global),
    }
}

fn list(global: &Global) -> anyhow::Result<Outcome> {
    let listed = scene::names().map(|name| Ok((name, scene::shipped(name)?.title)));
    let listed: Vec<(&str, String)> = listed.collect::<anyhow::Result<_>>()?;
    let scenes = listed.iter().map(|(name, title)| json!({ "name": name, "title": title }));
    let record = json!({ "scenes": scenes.collect::<Vec<_>>() });
    output::tell(global, &record, || {
        listed.iter().map(|(name, title)| format!("{name:<20}{title}\n")).collect()
    })?;
    Ok(Outcome::Good)
}

fn load(path: &Path) -> anyhow::Result<Scene> {
    let name = path.to_string_lossy();
    if scene::names().any(|n| n == name) || !(path.exists() || name.ends_with(".toml")) {
        return Ok(scene::shipped(&name)?);
    }
    let text = inputs::text("the scene file", path)?;
    Ok(Scene::from_toml(&text, &name)?)
}

/// The body of a scene; concerns about its mesh file are printed.
fn body_of(scene: &Scene) -> anyhow::Result<AnyBody> {
    let SceneBody::Mesh(mesh) = &scene.body else { return Ok(build(scene, &mut |_| ())?) };
    Ok(build(scene, &mut |concern| output::note(&format!("{}: {concern}", mesh.file)))?)
}

fn run_one(name: &Path, global: &Global) -> anyhow::Result<Outcome> {
    let out = global.given_folder()?;
    let scene = load(name)?;
    let to = out.as_ref().map(|out| (out, name));
    let (result, by, written) = match body_of(&scene)? {
        AnyBody::Flat(body) => run_body(&scene, body, to, section)?,
        AnyBody::Solid(body) => run_body(&scene, body, to, solid)?,
    };
    output::answer(global, &Json(&result), &by, &written, || scene_table::outcome(&result))?;
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
    result: &Answer,
) -> Result<Svg, ReportError> {
    let Prepared { plan, body, wall, .. } = prepared;
    let shown = wall.as_ref().map(|w| &w.outline[..]).or(body.palate.as_deref()).unwrap_or_default();
    let section = SectionPicture::new(&body.mesh, positions, result.pulls.values(), shown, &plan.title);
    report::tongue(&SectionPicture { contact: wall.is_some(), ..section })
}

/// The picture of a body in space.
fn solid(prepared: &Prepared<3>, positions: &[SVector<f64, 3>], result: &Answer) -> Result<Svg, ReportError> {
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
    draw: impl FnOnce(&Prepared<D>, &[SVector<f64, D>], &Answer) -> Result<Svg, ReportError>,
) -> anyhow::Result<(Answer, Provenance, Vec<PathBuf>)> {
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
    let lengths = result.trajectory.as_ref().map(|_| scene_table::lengths_over_time(&result));
    let json = Json(&result);
    let mut files: Vec<(&str, &dyn Export)> =
        vec![(&names[0], &picture), (&names[1], &json), (&names[2], &vtu)];
    files.extend(lengths.iter().map(|table| (names[3].as_str(), table as &dyn Export)));
    let written = out.export(&files, &by)?;
    Ok((result, by, written))
}

fn refuse_to_overwrite(scene: &Scene, out: &OutputDir, names: &[String]) -> anyhow::Result<()> {
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
