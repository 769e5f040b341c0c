//! `tongue-fit validate`: accuracy of predictions of muscles that were not fitted.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use tongue_fit::inner::report::{Files, Json, Markdown};
use tongue_fit::inner::validate::{self, ValidationPlan};
use tongue_fit::measured::Vowel;
use tongue_fit::system::TissueModel;

use super::{Global, Outcome, body, inputs, output, table};

#[derive(Debug, Clone, clap::Args)]
#[command(
    after_help = "Examples:\n  tongue-fit validate\n  tongue-fit validate --lengths mine.csv --baseline e --out results/mine"
)]
pub struct Arguments {
    /// Measured lengths (CSV) instead of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// Vowel that the others are compared with [default: ɯ]
    #[arg(long, value_name = "V")]
    baseline: Option<String>,
    /// Number of permutations of the names of muscles
    #[arg(long, value_name = "N", default_value_t = 25, hide_short_help = true)]
    permutations: u16,
    /// Seed of permutations and bootstraps
    #[arg(long, value_name = "N", default_value_t = 1, hide_short_help = true)]
    seed: u64,
    /// Validate the posterior too: every muscle is predicted from all others, as a distribution (takes about half an hour of one core)
    #[arg(long)]
    posterior: bool,
    #[command(flatten)]
    body: body::Arguments,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let clock = Instant::now();
    let (data, _) = inputs::lengths(arguments.lengths.as_ref(), None)?;
    let baseline = arguments.baseline.as_deref().map_or(Ok(Vowel::unrounded_u()), str::parse)?;
    let (permutations, seed) = (u64::from(arguments.permutations), arguments.seed);
    let plan = ValidationPlan { baseline, permutations, seed, posterior: arguments.posterior };
    let (body, model) = (arguments.body.body()?, arguments.body.model());
    let out = global.folder("results/validate")?;
    if arguments.posterior {
        /// Time for each row of the table, at the default spacing on one core, s.
        const ROW_S: f64 = 95.0;
        body::tell_duration("--posterior", body.mesh.nodes.len(), ROW_S * data.rows.len() as f64);
    }
    let bar = output::bar(1, "{wide_bar} {percent} %, {msg}, {eta} left")?;
    let study = validate::run(&data, &body, &model, &plan, &|done, total, what| {
        bar.set_length(total as u64);
        bar.set_message(what.to_owned());
        bar.set_position(done as u64);
        output::step(|| format!("{done} of {total}: {what}"));
    })?;
    bar.finish_and_clear();
    let by = super::provenance().with_tissue(TissueModel::of(&body.mesh));
    let page = Markdown(validate::page(&study, &super::line_of(super::words_of_the_result())));
    let mut files: Files<'_> = vec![("README.md", Box::new(page)), ("validate.json", Box::new(Json(&study)))];
    files.extend(validate::files(&study));
    output::write_and_answer(global, (Some(&out), &files), &Json(&study), &by, || {
        table::validation(&study, clock.elapsed().as_secs_f64())
    })?;
    Ok(Outcome::Good)
}
