mod prepared;

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Result, anyhow, bail, ensure};
use rayon::prelude::*;
use tongue_fit::inner::choice::name_of;
use tongue_fit::inner::inverse::batch::{Job, Selection};
use tongue_fit::inner::report::ReportError;
use tongue_fit::inner::report::batch::journal::{Journal, JournalEntry, NAME};
use tongue_fit::inner::report::batch::{Fitted, Shard};
use tongue_fit::inverse::Method;
use tongue_fit::measured::{Target, TargetKind, Vowel};

use super::inputs::choice;
use super::{Global, Outcome, body, interrupt, output, posterior};

pub use self::prepared::PreparedBatch;

pub const DEFAULT_OUT: &str = "results/batch";

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:\n  \
    tongue-fit batch\n  \
    tongue-fit batch --target stretch\n  \
    tongue-fit batch --lengths mine.csv --baseline e --baseline P7=i\n\n\
    A run that was stopped resumes when the same command is given again.")]
pub struct Arguments {
    /// Measured lengths (CSV) instead of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// Only these subjects, such as S1,S2
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    subjects: Option<Vec<String>>,
    /// Only these vowels, such as a,i
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    vowels: Option<Vec<String>>,
    /// Quantities to fit: ratio, stretch or both
    #[arg(long, value_name = "KIND", default_value = "both")]
    target: String,
    /// Vowel taken as rest, for all subjects (e) or for one (S4=i); may be given several times [default: ɯ, and e for subjects without ɯ]
    #[arg(long, value_name = "V|SUBJECT=V", hide_short_help = true)]
    baseline: Vec<String>,
    /// Search method: by the derivatives of the equilibrium, or by the simplex of the thesis, which finds the same tensions more slowly
    /// (and is the default for the fit of one vowel, as in the thesis)
    #[arg(long, value_parser = choice::<Method>(), default_value = "gauss-newton", hide_short_help = true)]
    method: Method,
    /// Half width of the rounding of every length, mm [default: from the table or its digits, 0.5 for whole millimetres]
    #[arg(long, value_name = "MM", hide_short_help = true)]
    error_mm: Option<f64>,
    /// Make only every Nth of the fits, as one task of a cluster: 3/16 is the third of sixteen; `tongue-fit merge` merges them
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    #[command(flatten)]
    posterior: posterior::Arguments,
    #[command(flatten)]
    body: body::Arguments,
}

impl Arguments {
    fn selection(&self) -> Result<Selection> {
        let kinds = match self.target.as_str() {
            "both" => TargetKind::ALL.to_vec(),
            name => vec![name.parse().map_err(|e| anyhow!("--target: {e}, or both of them: both"))?],
        };
        let vowels = self.vowels.as_ref().map(|v| v.iter().map(|v| v.parse()).collect::<Result<_, _>>());
        let vowels = vowels.transpose()?;
        let mut selection =
            Selection { subjects: self.subjects.clone(), vowels, kinds, ..Selection::default() };
        for word in &self.baseline {
            let (subject, vowel) = word.split_once('=').map_or((None, word.as_str()), |(s, v)| (Some(s), v));
            let vowel: Vowel = vowel.parse()?;
            let earlier = match subject {
                Some(subject) => selection.baseline_of.insert(subject.to_owned(), vowel),
                None => selection.baseline.replace(vowel),
            };
            ensure!(earlier.is_none(), "--baseline {word}: this baseline is given twice; give it once");
        }
        Ok(selection)
    }
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let clock = Instant::now();
    let words = super::words_of_the_result();
    if arguments.shard.is_some() && arguments.lengths.as_deref() == Some(Path::new("-")) {
        bail!("--shard with --lengths -: merge reads the table again, so it must be a file; name it");
    }
    let mut prepared = PreparedBatch::new(arguments, &words)?;
    let out = global.folder(DEFAULT_OUT)?;
    prepared.tell_what_is_left_out();
    let path = out.path().join(arguments.shard.map_or_else(|| NAME.to_owned(), Shard::journal));
    let count = prepared.run.plan.jobs.len();
    let mine: Vec<usize> = (0..count).filter(|&n| arguments.shard.is_none_or(|s| s.has(n))).collect();
    let journal = open_journal(path.clone(), &prepared.key, count, (mine.len(), "fits"))?;
    output::step(|| {
        format!(
            "{} fits; {} from {} starts, inputs {}",
            mine.len(),
            name_of(&arguments.method),
            prepared.run.settings.starts,
            prepared.provenance.inputs_sha256.as_deref().unwrap_or_default()
        )
    });
    let todo: Vec<usize> = mine.iter().copied().filter(|&n| !journal.has(n)).collect();
    let PreparedBatch { run, data, .. } = &mut prepared;
    run.sample(data, &todo, [&output::note, &output::tell_step]);
    let journal = fit_all(&prepared, &todo, mine.len(), journal)?;
    let outcome = match arguments.shard {
        Some(shard) => {
            let text = format!(
                "shard {shard} is done: {} of {} fits, kept in {}\nwhen all {} are done: tongue-fit merge {}\n",
                mine.len(),
                count,
                path.display(),
                shard.of,
                out.path().display()
            );
            if global.json {
                output::print(&output::json(&serde_json::json!({
                    "shard": shard.number, "of": shard.of, "fits": mine.len(), "all_fits": count, "journal": path
                }))?)?
            } else {
                output::summary(&text, &[path])?
            }
            // `merge` reports the quality of the fits; an engine takes any other status for a failed task.
            Outcome::Good
        }
        None => {
            output::step(|| "all fitted; writing".to_owned());
            let outcome = prepared.finish(&out, &journal, global, clock.elapsed().as_secs_f64())?;
            journal.remove()?;
            outcome
        }
    };
    interrupt::set_stop_message(None);
    Ok(outcome)
}

/// Opens the journal of this command at `path` for a run of `jobs` jobs, of which `mine` are done here. If the program is stopped from now
/// on, it prints that the command can be resumed.
pub fn open_journal(path: PathBuf, key: &str, jobs: usize, (mine, what): (usize, &str)) -> Result<Journal> {
    let journal = Journal::open(path.clone(), key, &super::words_of_the_result(), jobs)?;
    if let Some(of) = &journal.replaced {
        output::note(&format!("the journal in this folder was of {of}: it was replaced by a new one"));
    }
    if journal.finished() > 0 {
        output::note(&format!("resuming after {} of {mine} {what}", journal.finished()));
    }
    interrupt::set_stop_message(Some(format!(
        "stopped; the finished {what} are kept in \"{}\": the same command resumes after them",
        path.display()
    )));
    Ok(journal)
}

/// Makes the fits in `todo`, one at a time on each thread, and adds each to the journal; `of` is the number of all fits of this run.
fn fit_all(prepared: &PreparedBatch, todo: &[usize], of: usize, journal: Journal) -> Result<Journal> {
    let jobs = &prepared.run.plan.jobs;
    let (nodes, fits) = (prepared.run.body.mesh.nodes.len(), todo.len() as f64);
    body::tell_duration(&format!("{fits} fits"), nodes, fits * body::fit_s(prepared.run.settings.method));
    let bar = output::bar(of as u64, "{wide_bar} {pos} of {len} fits, {eta} left")?;
    bar.set_position((of - todo.len()) as u64);
    bar.reset_eta();
    let journal = Mutex::new(journal);
    todo.par_iter().try_for_each(|&number| -> Result<(), ReportError> {
        let clock = Instant::now();
        let result = prepared.run.fit(number, true, &prepared.provenance, &output::tell_step)?;
        let entry = JournalEntry { job: number, wall_s: clock.elapsed().as_secs_f64(), result };
        output::step(|| description(&jobs[number], &entry));
        journal.lock().unwrap_or_else(PoisonError::into_inner).append(&entry)?;
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    Ok(journal.into_inner().unwrap_or_else(PoisonError::into_inner))
}

fn description(job: &Job, entry: &JournalEntry<Fitted>) -> String {
    let Target { subject, vowel, kind, .. } = &job.target;
    let end = match &entry.result {
        Ok(fit) => fit.digest.status.replace('_', " "),
        Err(why) => format!("not fitted: {why}"),
    };
    format!("{subject} /{vowel}/ {kind}: {end} in {:.3} s", entry.wall_s)
}
