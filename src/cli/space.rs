//! `tongue-fit simulate --body space` or a folder: one equilibrium of a body in space.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use miette::{IntoDiagnostic, WrapErr, miette};
use nalgebra::{Vector2, Vector3};

use tongue_fit::body::{SpaceBody, Unit, artisynth, gmsh};
use tongue_fit::inverse::alarms;
use tongue_fit::report::{self, Export, Json, OperationRecord, OutputDir, SpaceRecord, SpaceVtu};
use tongue_fit::run::Equilibrium;
use tongue_fit::statics::Workspace;
use tongue_fit::system::{MusclesAs, SpaceModel, System};

use super::body::SpaceSource;
use super::choice::choice;
use super::{Global, Outcome, output, space_surgery, table};

/// Options of bodies in space.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct Arguments {
    /// Activation of a muscle, from 0 to 1: of both sides (GGP=0.1) or of one (GGP_L=0.1); may be given
    /// several times
    #[arg(long, value_name = "MUSCLE=A", allow_hyphen_values = true)]
    activation: Vec<String>,
    #[command(flatten)]
    model: ModelArguments,
    #[command(flatten)]
    surgery: space_surgery::Arguments,
}

/// Options of the model in space.
#[derive(Debug, Clone, Default, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct ModelArguments {
    /// Muscles: stress along fibres, whose answers hold on finer meshes, or lines from node to node, as in
    /// ArtiSynth
    #[arg(long, value_name = "KIND", value_parser = choice::<MusclesAs>(), default_value = "stress", hide_short_help = true)]
    muscles_as: MusclesAs,
    /// Stiffening of a muscle's tissue by full activation, as a multiple of its passive stiffness (ArtiSynth:
    /// 9)
    #[arg(
        long,
        value_name = "GAIN",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    stiffening: f64,
    /// Cut every hexahedron in eight
    #[arg(long, hide_short_help = true)]
    refined: bool,
    /// Unit of the coordinates of a body from Gmsh (--body FILE.msh)
    #[arg(long, value_name = "UNIT", value_parser = choice::<Unit>(), default_value = "m", hide_short_help = true)]
    body_unit: Unit,
}

impl ModelArguments {
    pub fn body(&self, source: &SpaceSource) -> miette::Result<SpaceBody> {
        if self.body_unit != Unit::M && !matches!(source, SpaceSource::Mesh(_)) {
            return Err(miette!("--body-unit is the unit of a body from Gmsh: --body FILE.msh"));
        }
        match source {
            SpaceSource::BuiltIn if self.muscles_as == MusclesAs::Lines => Err(miette!(
                "--muscles-as lines needs fibres from node to node, which the built-in body does not have"
            )),
            SpaceSource::BuiltIn => SpaceBody::tongue(if self.refined { 2 } else { 1 }).into_diagnostic(),
            SpaceSource::Folder(folder) => {
                let body = artisynth::read(folder).into_diagnostic()?;
                Ok(if self.refined { body.refined() } else { body })
            }
            SpaceSource::Mesh(file) => {
                let origin = file.display().to_string();
                let bytes = tongue_fit::files::read(file).into_diagnostic();
                let bytes = bytes.wrap_err_with(|| format!("cannot read the mesh \"{origin}\""))?;
                let body = gmsh::read_space(&bytes, &origin, self.body_unit).into_diagnostic()?;
                Ok(if self.refined { body.refined() } else { body })
            }
        }
    }

    pub fn model(&self) -> miette::Result<SpaceModel> {
        let model =
            SpaceModel { muscles: self.muscles_as, stiffening: self.stiffening, ..SpaceModel::default() };
        model.check().into_diagnostic()?;
        Ok(model)
    }
}

/// Activations of all muscles of a body from words such as `GGP=0.1`.
pub fn activations(words: &[String], body: &SpaceBody) -> miette::Result<Vec<f64>> {
    let mut given = Vec::new();
    for word in words {
        let (name, value) = word
            .split_once('=')
            .ok_or_else(|| miette!("--activation {word}: write MUSCLE=A, like GGP=0.1"))?;
        let value: f64 = value.trim().parse().map_err(|_| {
            miette!("--activation {word}: \"{value}\" is not a number; write one from 0 to 1, like GGP=0.1")
        })?;
        given.push((name.trim().to_owned(), value));
    }
    body.activations(&given).map_err(|error| miette!("--activation: {error}"))
}

pub struct Solved {
    pub found: Equilibrium,
    pub positions: Vec<Vector3<f64>>,
    pub system: System<3>,
    pub wall_s: f64,
}

impl Solved {
    pub fn midsagittal_positions(&self) -> Vec<Vector2<f64>> {
        self.positions.iter().map(|p| Vector2::new(p.x, p.z)).collect()
    }
}

/// Solves for the equilibrium; unless `direct`, the equilibria from rest are followed as the activations
/// grow.
pub fn solve(
    body: &SpaceBody,
    model: &SpaceModel,
    activations: &[f64],
    direct: bool,
) -> miette::Result<Solved> {
    let half = body.half().and_then(|half| Some((half.activations(activations)?, half)));
    let clock = Instant::now();
    let system = match &half {
        Some((_, half)) => System::of_half(half, model),
        None => System::in_space(body, model),
    };
    let system = system.into_diagnostic()?;
    output::step(|| {
        let (unknowns, entries) = (3 * system.pattern().unknowns(), system.pattern().factor_entries::<3>());
        let made = clock.elapsed().as_secs_f64();
        let what = if half.is_some() { "only one half is solved: " } else { "" };
        format!(
            "{}: {what}{unknowns} unknowns, {entries} entries of the factor, set up in {made:.2} s",
            body.what
        )
    });
    let mut workspace = Workspace::new(&system);
    let own = half.as_ref().map_or(activations, |(own, _)| own);
    let clock = Instant::now();
    let mut found = Equilibrium::of(&system, &mut workspace, own, direct);
    let wall_s = clock.elapsed().as_secs_f64();
    let positions = match &half {
        Some((_, half)) => half.whole(workspace.positions()),
        None => workspace.positions().to_vec(),
    };
    found.alarms.extend(alarms::of_strain(body, &positions));
    Ok(Solved { found, positions, system, wall_s })
}

/// One equilibrium, or one before and one after surgery.
pub fn run(
    source: &SpaceSource,
    arguments: &Arguments,
    direct: bool,
    global: &Global,
) -> miette::Result<Outcome> {
    let whole = arguments.model.body(source)?;
    let all = activations(&arguments.activation, &whole)?;
    let model = arguments.model.model()?;
    let surgery = arguments.surgery.surgery();
    let operated = surgery.as_ref().map(|s| s.operate(&whole)).transpose().into_diagnostic()?;
    let out = global.out.as_ref().map(OutputDir::prepare).transpose().into_diagnostic()?;
    let mut found = solve(&whole, &model, &all, direct)?;
    let (mut body, mut activations, mut operation) = (&whole, all.clone(), None);
    if let Some((surgery, operated)) = surgery.as_ref().zip(operated.as_ref()) {
        let before = found.positions;
        (body, activations) = (&operated.body, operated.muscles.iter().map(|&m| all[m]).collect());
        found = solve(body, &model, &activations, direct)?;
        let mut record = OperationRecord::new(surgery, &whole, operated, [&before, &found.positions]);
        let tip = whole.foremost();
        if surgery.make_up {
            // Both sides are searched, also where one half was enough for the equilibrium.
            let system = System::in_space(body, &model).into_diagnostic()?;
            surgery.make_up(&mut record, tip, (body, &system), &before).into_diagnostic()?;
            if record.made_up_by.is_none() {
                output::note(
                    "the tip itself is removed, so no activations are searched that would bring it back",
                );
            }
        }
        operation = Some(record);
    }
    let Solved { found, positions, system, wall_s } = found;
    let record = SpaceRecord::new(body, (&system, &found), &activations, &positions, wall_s);
    let record = SpaceRecord { operation, ..record };
    let (by, json) = (super::provenance().with_tissue(system.tissue()), Json(&record));
    let mut written = Vec::new();
    if let Some(out) = &out {
        let title = "Tongue in space: at rest (light) and deformed";
        let picture = report::views(body, &positions, &activations, title).into_diagnostic()?;
        let vtu = SpaceVtu { body, positions: &positions, activations: &activations };
        let files: [(&str, &dyn Export); 3] =
            [("simulation.json", &json), ("tongue.svg", &picture), ("tongue.vtu", &vtu)];
        written = out.export(&files, &by).into_diagnostic()?;
    }
    output::answer(global, &json, &by, &written, || text(&record, &written))?;
    Ok(Outcome::of_equilibrium(found.solution.status, &found.alarms))
}

fn text(record: &SpaceRecord, written: &[PathBuf]) -> String {
    let mut t = table::table(&["muscle", "activation", "fibre mm", "stretch"]);
    for (i, (muscle, activation)) in record.activations.0.iter().enumerate() {
        t.add_row([
            muscle.clone(),
            format!("{activation}"),
            format!("{:.2}", record.lengths_mm.0[i].1),
            format!("{:.3}", record.stretches.0[i].1),
        ]);
    }
    let mut text = format!("{t}\n");
    let [back, right, up] = record.foremost_moved_mm;
    let _ = writeln!(
        text,
        "the foremost node of the midsagittal plane moved {back:.2} mm back, {right:.2} mm to the right, {up:.2} mm up; \
         all nodes {:.2} mm (RMS)",
        record.rms_displacement_mm
    );
    let _ = writeln!(
        text,
        "{:?} in {} iterations and {} factorisations of {} unknowns{}; volumes at {:.1} % to {:.1} % of rest",
        record.status,
        record.iterations,
        record.factorisations,
        record.unknowns,
        if record.half { " (one half: both sides are alike)" } else { "" },
        100.0 * record.min_volume_ratio,
        100.0 * record.max_volume_ratio
    );
    text += &record.operation.as_ref().map_or_else(String::new, table::operation);
    text += &table::way(record.branch.as_ref(), record.connection);
    text + &table::alarms(&record.alarms) + &table::files(written)
}
