//! `tongue-fit stability`: the hard cases.

use miette::{IntoDiagnostic, miette};
use tongue_fit::report::{Export, Markdown, Rows};
use tongue_study::hard_cases::{self, CASES, HowMany};

use super::{Global, Outcome, command_line, output, table};

/// Options of `tongue-fit stability`.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(
    after_help = "Examples:\n  tongue-fit stability --case 2\n  tongue-fit stability --full --out results/stability"
)]
pub struct Arguments {
    /// All variants of every case (minutes) instead of a sample (seconds)
    #[arg(long)]
    full: bool,
    /// Run only this case; may be given several times
    #[arg(long, value_name = "NUMBER")]
    case: Vec<u8>,
}

pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let extent = if arguments.full { HowMany::Full } else { HowMany::Sample };
    if let Some(unknown) = arguments.case.iter().find(|c| !CASES.contains(c)) {
        let known: Vec<String> = CASES.iter().map(u8::to_string).collect();
        return Err(miette!("--case {unknown}: there is no such case; there are {}", known.join(", ")));
    }
    let out = global.folder("results/stability")?;
    let mut rows = Vec::new();
    for case in CASES.into_iter().filter(|c| arguments.case.is_empty() || arguments.case.contains(c)) {
        let found = hard_cases::run(case, extent).into_diagnostic()?;
        let kept = found.iter().filter(|r| r.kept).count();
        let converged = found.iter().filter(|r| r.converged).count();
        output::progress(&format!(
            "case {case:2}: {:4} rows, {converged:4} converged, promise kept in {kept:4}",
            found.len()
        ));
        rows.extend(found);
    }
    let page = Markdown(hard_cases::markdown(&rows, &command_line()).into_diagnostic()?);
    let files: [(&str, &dyn Export); 2] = [("stability.csv", &Rows(&rows)), ("stability.md", &page)];
    let written = out.export(&files, &super::provenance()).into_diagnostic()?;
    if global.json {
        output::print(&output::json(&serde_json::json!({ "rows": rows }))?)?;
    } else {
        let broken: Vec<_> = rows.iter().filter(|r| !r.kept).collect();
        let mut text = format!("{} rows, promise kept in {}\n", rows.len(), rows.len() - broken.len());
        for r in &broken {
            text += &format!("  case {} {}: {} ({})\n", r.case, r.variant, r.status, r.note);
        }
        output::summary(&(text + &table::files(&written)), &written)?;
    }
    let broken = rows.iter().filter(|r| !r.kept).count();
    Ok(Outcome::judged(broken == 0, || format!("the promise is broken in {broken} of {} rows", rows.len())))
}
