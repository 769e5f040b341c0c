use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::Parser;
use tongue_fit::inner::report::batch::Shard;
use tongue_fit::inner::report::batch::journal::{self, Journal};
use tongue_fit::inner::report::joined;

use super::batch::{DEFAULT_OUT, PreparedBatch};
use super::table::join_first;
use super::{Cli, Command, Global, Outcome, line_of};

const MOST_NAMED: usize = 5;

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Example:\n  \
    tongue-fit merge results/shards --out results/batch\n\n\
    The shards are those of `tongue-fit batch --shard I/N`. The files are, byte for byte, those of one run. If a shard is missing or \
    unfinished, it is named and nothing is written. Run it where the shards were run, because it reads the table again.")]
pub struct Arguments {
    /// Folders with the journals of the shards (batch-3-of-16.journal)
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let clock = Instant::now();
    let shards = shards(&arguments.folders)?;
    let first = shards.values().next().and_then(|paths| paths.first());
    let first = first.ok_or_else(|| {
        anyhow!(
            "no shard of a batch in {}; tongue-fit batch --shard 1/16 leaves one, batch-1-of-16.journal",
            joined(arguments.folders.iter().map(|f| f.display()), ", ")
        )
    })?;
    let words = journal::arguments(first)?;
    let parsed = Cli::try_parse_from(["tongue-fit"].into_iter().chain(words.iter().map(String::as_str)));
    let Some(Command::Batch(batch)) = parsed?.command else {
        bail!("the journal is of another command than batch: {}", line_of(words));
    };
    let prepared = PreparedBatch::new(&batch, &words)
        .context("merge repeats the plan of the batch in the folder where the batch was started")?;
    let jobs = prepared.run.plan.jobs.len();

    let mut unfinished = missing(&shards)?;
    let paths = shards.values().flatten().cloned();
    let journal = Journal::join(paths, &prepared.key, &words, jobs)?;
    for shard in shards.keys() {
        let mine: Vec<usize> = (0..jobs).filter(|&job| shard.has(job)).collect();
        let done = mine.iter().filter(|job| journal.has(**job)).count();
        if done < mine.len() {
            unfinished.push(format!("{shard} has {done} of {} fits", mine.len()));
        }
    }
    ensure!(
        unfinished.is_empty(),
        "not every shard is done, so nothing is written: {}. Run each again: {} --shard I/N",
        join_first(unfinished, MOST_NAMED, "; "),
        line_of(words)
    );

    let out = global.folder(DEFAULT_OUT)?;
    prepared.tell_what_is_left_out();
    prepared.finish(&out, &journal, global, clock.elapsed().as_secs_f64())
}

fn shards(folders: &[PathBuf]) -> Result<BTreeMap<Shard, Vec<PathBuf>>> {
    let mut journals: BTreeMap<Shard, Vec<PathBuf>> = BTreeMap::new();
    for folder in folders {
        let entries = std::fs::read_dir(folder)
            .with_context(|| format!("{}: it must be a folder with journals of shards", folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if let Some(shard) = Shard::of_journal(&path) {
                journals.entry(shard).or_default().push(path);
            }
        }
    }
    for paths in journals.values_mut() {
        // Folders are listed in any order, and one folder may have been named twice.
        paths.sort();
        paths.dedup_by_key(|path| path.canonicalize().unwrap_or_else(|_| path.clone()));
    }
    Ok(journals)
}

fn missing(shards: &BTreeMap<Shard, Vec<PathBuf>>) -> Result<Vec<String>> {
    let counts: BTreeSet<usize> = shards.keys().map(|s| s.of).collect();
    let counts: Vec<usize> = counts.into_iter().collect();
    let [of] = counts[..] else {
        bail!(
            "shards of batches with different numbers of shards: of {}; keep those of one batch",
            joined(counts, " and of ")
        );
    };
    let all = (1..=of).map(|number| Shard { number, of });
    Ok(all.filter(|s| !shards.contains_key(s)).map(|s| format!("{s} is missing")).collect())
}
