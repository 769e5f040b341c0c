use std::path::PathBuf;

use anyhow::Result;
use serde_json::json;
use tongue_fit::inner::inverse::batch::{self, Selection};
use tongue_fit::inner::report::{Export, Json, OutputDir, TonguePage};
use tongue_fit::inner::run::FitRun;
use tongue_fit::measured::{Dataset, TargetKind};
use tongue_fit::parallel;
use tongue_fit::system::TissueModel;

use super::{Global, Outcome, body, inputs, output};

/// Most fits in a page, which computes all others itself.
const MOST_FITS: usize = 200;

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:\n  \
    tongue-fit page --out tongue.html\n  \
    tongue-fit page --lengths my.csv --body continuum --out mine.html")]
pub struct Arguments {
    /// Measured lengths (CSV) instead of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// Leave the fits to the page, which computes each on demand
    #[arg(long)]
    no_fits: bool,
    #[command(flatten)]
    body: body::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let path = global.out.clone().unwrap_or_else(|| "results/tongue.html".into());
    let is_page =
        path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html") || e.eq_ignore_ascii_case("htm"));
    let path = if is_page { path } else { path.join("tongue.html") };
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let own = match &arguments.lengths {
        Some(path) => Some((path.display().to_string(), inputs::text("the table", path)?)),
        None => None,
    };
    let data = match &own {
        Some((file, text)) => Dataset::from_reader(text.as_bytes(), file),
        None => Dataset::reference(),
    }?;
    let (tongue, model) = (arguments.body.body()?, arguments.body.model());
    let out = OutputDir::prepare(path.parent().unwrap_or(&path))?;
    let kinds = vec![TargetKind::Ratio, TargetKind::Stretch];
    let plan = batch::plan(&data, &Selection { kinds, ..Selection::default() })?;
    let by = super::provenance().with_tissue(TissueModel::of(&tongue.mesh));
    let refused = plan.refusals.iter().map(|r| r.message.clone());
    let mut not_fitted: Vec<String> = data.left_out().into_iter().chain(refused).collect();
    let jobs = if arguments.no_fits { &[][..] } else { &plan.jobs[..plan.jobs.len().min(MOST_FITS)] };
    if !arguments.no_fits && jobs.len() < plan.jobs.len() {
        output::note(&format!(
            "the page holds the first {MOST_FITS} of {} fits and makes the others itself",
            plan.jobs.len()
        ));
    }
    let mut fits = Vec::new();
    for found in parallel::map(jobs, |job| FitRun::quick(&job.target).run(&tongue, &model, &by)) {
        match found {
            Ok(found) => fits.push(found),
            Err(error) => not_fitted.push(error.to_string()),
        }
    }
    let page = TonguePage { body: arguments.body.plane()?, model, table: own, fits };
    let written = out.export(&[(&name, &page as &dyn Export)], &by)?;
    let record = json!({ "file": path, "fits": page.fits.len(), "not_fitted": not_fitted });
    output::answer(global, &Json(&record), &by, &written, || {
        let refused: String = not_fitted.iter().map(|why| format!("not fitted: {why}\n")).collect();
        format!("{}: {} fits in it\n{refused}", tongue.what, page.fits.len())
    })?;
    Ok(Outcome::Good)
}
