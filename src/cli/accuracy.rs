//! `tongue-fit accuracy`: what accuracy costs in time.

use miette::IntoDiagnostic;
use tongue_fit::report::{Export, Markdown, OutputDir};
use tongue_fit::study::accuracy::{self, Circumstances, Effort};

use super::{Global, Outcome, output, table};

const DEFAULT_OUT: &str = "results/accuracy";

/// Options of `tongue-fit accuracy`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(after_help = "Example:\n  tongue-fit accuracy --quick --out results/accuracy-here")]
pub struct Arguments {
    /// Within half a minute: fewer repeats, no mesh below 1.4 mm, long explicit runs refused (the full study: ten minutes)
    #[arg(long)]
    quick: bool,
}

/// Runs it.
pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let out =
        OutputDir::prepare(global.out.clone().unwrap_or_else(|| DEFAULT_OUT.into())).into_diagnostic()?;
    let effort = if arguments.quick { Effort::QUICK } else { Effort::FULL };
    let study = accuracy::run(&effort, &mut |what| output::progress(what)).into_diagnostic()?;
    let made = Circumstances { command: super::command_line(), machine: machine() };
    let page = Markdown(accuracy::page(&study, &made).into_diagnostic()?);
    let files = accuracy::files(&study).into_diagnostic()?;
    let mut all: Vec<(&str, &dyn Export)> = files.iter().map(|(n, f)| (*n, f.as_ref())).collect();
    all.push(("README.md", &page));
    let written = out.export(&all, &super::provenance()).into_diagnostic()?;
    if global.json {
        output::print(&output::json(&serde_json::json!({ "written": written }))?)?;
    } else {
        output::summary(&table::files(&written), &written)?;
    }
    Ok(Outcome::Good)
}

/// Processor, threads and operating system, as far as they can be known.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": "));
    format!(
        "{} ({} threads in use, {} {})",
        model.map_or("an unnamed processor", |(_, name)| name.trim()),
        rayon::current_num_threads(),
        std::env::consts::OS,
        std::env::consts::ARCH
    )
}
