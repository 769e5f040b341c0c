//! `tongue-fit muscles`: the effect of each muscle alone, in the plane or in space.

use anyhow::{Context, Result, ensure};
use serde_json::json;
use tongue_fit::body::Mesh;
use tongue_fit::geometry::Point;
use tongue_fit::inner::report::column::{self, Column};
use tongue_fit::inner::report::{self, Export, Json, OutputDir, Panel};
use tongue_fit::inner::run::{EffectRow, MuscleEffect};
use tongue_fit::inner::statistics::distinct;
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::TissueModel;

use super::{Global, Outcome, body, output, space, table};

#[derive(Debug, Clone, clap::Args)]
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

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
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
        let names = body.groups();
        let each = names.iter().map(|name| {
            MuscleEffect::in_space(&body, &model, &section, (name, activation), &output::tell_step)
                .context("--activation")
        });
        let title = format!("{what} an activation of {activation}: {}", body.what);
        let shown = (&section, &[][..], title.as_str(), "midsagittal surface");
        return answer(each, shown, TissueModel::Hexahedra, &out, global);
    }
    let body = arguments.body.body()?;
    let model = arguments.body.model();
    let out = global.folder("results/muscles")?;
    let names = distinct(body.mesh.muscles.iter().map(|m| m.name.as_str()));
    let equilibria = names.len() as f64;
    body::tell_duration("each muscle alone", body.mesh.nodes.len(), equilibria * body::EQUILIBRIUM_S);
    ensure!(!names.is_empty(), "{} has no muscles; name curves of its mesh after them", body.what);
    let each = names.iter().map(|name| Ok(MuscleEffect::in_plane(&body, &model, name, tension)?));
    let title = format!("{what} {tension} N per metre of thickness");
    let palate = body.palate.as_deref().unwrap_or_default();
    answer(each, (&body.mesh, palate, &title, "surface"), TissueModel::of(&body.mesh), &out, global)
}

fn answer(
    each: impl Iterator<Item = Result<MuscleEffect>>,
    (mesh, palate, title, surface): (&Mesh<2>, &[Point], &str, &str),
    tissue: TissueModel,
    out: &OutputDir,
    global: &Global,
) -> Result<Outcome> {
    let each = each.inspect(|found| {
        found.iter().for_each(|alone| output::step(|| format!("{}: {:?}", alone.name, alone.status)));
    });
    let all = each.collect::<Result<Vec<_>>>()?;
    let columns = EffectRow::columns(tissue == TissueModel::Hexahedra);
    let rows: Vec<EffectRow<'_>> = all.iter().flat_map(MuscleEffect::rows).collect();
    let panels: Vec<Panel> = all.iter().map(panel).collect();
    let picture = report::panels(mesh, palate, &panels, title)?;
    let by = super::provenance().with_tissue(tissue);
    let csv = column::table(&columns, &rows);
    let files: [(&str, &dyn Export); 2] = [("muscles.svg", &picture), ("muscles.csv", &csv)];
    let record = json!({ "muscles": column::objects(&columns, &rows) });
    output::write_and_answer(global, (Some(out), &files), &Json(&record), &by, || {
        text(title, &all, &columns, surface)
    })?;
    let doubtful = all.iter().filter(|a| a.status != SolveStatus::Converged || !a.alarms.is_empty());
    let doubtful: Vec<&str> = doubtful.map(|a| a.name.as_str()).collect();
    let is_doubtful = !doubtful.is_empty();
    Ok(Outcome::of_reasons(is_doubtful.then(|| {
        format!("no equilibrium that can be trusted where these pull alone: {}", doubtful.join(", "))
    })))
}

fn text<'a>(
    title: &str,
    all: &'a [MuscleEffect],
    columns: &[Column<'a, EffectRow<'a>>],
    surface: &str,
) -> String {
    let t = table::from_columns(columns, &all.iter().map(MuscleEffect::own).collect::<Vec<_>>());
    let doubtful = all.iter().filter(|a| !a.alarms.is_empty());
    let doubts: String = doubtful.map(|a| format!("but of {}: {}\n", a.name, a.alarm_texts())).collect();
    format!(
        "{title}\n\n{t}\n{doubts}\ntip, top and root: the foremost, highest and rearmost point of the {surface} at rest\n\n"
    )
}

/// The picture of a muscle alone, with its effect in words if that can be trusted.
fn panel(alone: &MuscleEffect) -> Panel {
    let [tip, top, _] = alone.moved_mm.map(table::forward_up);
    let lines = match alone.status {
        SolveStatus::Converged if alone.alarms.is_empty() => match alone.wider_mm {
            None => vec![format!("tip {tip}"), format!("top {top}")],
            Some(mm) if mm.abs() < 0.05 => vec![format!("tip {tip}"), "as wide as at rest".to_owned()],
            Some(mm) => {
                let word = if mm < 0.0 { "narrower" } else { "wider" };
                vec![format!("tip {tip}"), format!("{:.1} mm {word}", mm.abs())]
            }
        },
        SolveStatus::Converged => ["cannot be trusted:", "muscles.csv says why"].map(str::to_owned).to_vec(),
        other => vec![format!("not at equilibrium: {other:?}")],
    };
    let title = format!("{} shortens {:.0} %", alone.name, 100.0 * (1.0 - alone.stretch));
    Panel { title, lines, positions: alone.positions.clone(), tensions: alone.tensions.clone() }
}
