//! Output to the terminal: results on stdout, everything else on stderr; and how commands end.

use std::borrow::Borrow;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use tongue_fit::body::Body;
use tongue_fit::inner::inverse::alarms::Alarm;
use tongue_fit::inner::report::{
    self, EscapeControl, Export, Json, OfBody, OutputDir, Provenance, ReportError, Svg, Vtu,
};
use tongue_fit::inner::run::Solved;
use tongue_fit::inner::surgery::OperationRecord;
use tongue_fit::statics::SolveStatus;

use super::invocation::{Stream, Volume, current, stop_if_asked};
use super::{Global, table};

fn volume() -> Volume {
    current().map_or(Volume::Normal, |run| run.volume)
}

pub fn is_verbose() -> bool {
    volume() == Volume::Verbose
}

/// Writes to stdout at every volume. A closed pipe (`| head`) is not an error: the run goes on and ends normally.
pub fn print(text: &str) -> Result<()> {
    stream(|out| out.write_all(short_numbers(text).as_bytes()))
}

/// Files that only some runs of a command write, so that they can stay in a folder from an earlier run.
const OF_SOME_RUNS: [&str; 13] = [
    "posterior.csv",
    "contrasts.csv",
    "over_speakers.csv",
    "ridges.svg",
    "valley.csv",
    "valley.svg",
    "repeats.csv",
    "segments.csv",
    "formants.csv",
    "draws.csv",
    "trajectory.csv",
    "trajectory.json",
    "posterior_predictions.csv",
];

/// Like [`print`], but not with `-q` if files contain the same. Also notes the files in the folder that an earlier run may have left.
pub fn summary(text: &str, files: &[PathBuf]) -> Result<()> {
    if let Some(folder) = files.first().and_then(|file| file.parent()) {
        let earlier = OF_SOME_RUNS.map(|name| folder.join(name)).into_iter();
        let earlier = earlier.filter(|file| !files.contains(file) && file.is_file());
        let names = report::joined(earlier.map(|file| file.display().to_string()), ", ");
        if !names.is_empty() {
            note(&format!("in this folder, but not written by this run: {names}"));
        }
    }
    if volume() == Volume::Quiet && !files.is_empty() { Ok(()) } else { print(text) }
}

/// Prints the answer of a command: with `--json` the record, otherwise the text and the names of the files, like [`summary`].
pub fn answer(
    global: &Global,
    record: &dyn Export,
    by: &Provenance,
    written: &[PathBuf],
    text: impl FnOnce() -> String,
) -> Result<()> {
    if global.json {
        stream(|out| record.write(out, by))
    } else {
        summary(&(text() + &table::files(written)), written)
    }
}

/// Prints the answer of a command that writes no file: with `--json` the record, otherwise the text.
pub fn tell(global: &Global, record: &impl Serialize, text: impl FnOnce() -> String) -> Result<()> {
    if global.json { print(&json(record)?) } else { print(&text()) }
}

/// Writes files into a folder, if there is one, and prints the answer of a command.
pub fn write_and_answer<'a>(
    global: &Global,
    (out, files): (Option<&OutputDir>, &[(impl AsRef<str>, impl Borrow<dyn Export + 'a>)]),
    record: &dyn Export,
    by: &Provenance,
    text: impl FnOnce() -> String,
) -> Result<()> {
    let written = out.map(|out| out.export(files, by)).transpose()?;
    answer(global, record, by, &written.unwrap_or_default(), text)
}

impl Global {
    pub fn folder(&self, default: &str) -> Result<OutputDir> {
        Ok(OutputDir::prepare(self.out.as_deref().unwrap_or(Path::new(default)))?)
    }

    pub fn given_folder(&self) -> Result<Option<OutputDir>> {
        Ok(self.out.as_ref().map(OutputDir::prepare).transpose()?)
    }
}

/// Like [`print`], for output that is too large for memory.
pub fn stream(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let mut out = EscapeControl::new(io::BufWriter::new(Stream::Stdout));
    match write(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to stdout"),
    }
}

pub fn json(value: &impl Serialize) -> Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}

/// Prints an error with its causes, each once, on stderr at every volume.
pub fn error(report: &anyhow::Error) {
    let mut message = String::new();
    for cause in report.chain() {
        let cause = cause.to_string();
        // A cause that the message already contains is not repeated.
        if !message.contains(&cause) {
            message = if message.is_empty() { cause } else { format!("{message}: {cause}") };
        }
    }
    complain(&message);
}

pub fn complain(what: &str) {
    line(format_args!("error: {what}"));
}

pub fn note(what: &str) {
    if volume() >= Volume::Normal {
        line(what);
    }
}

/// Prints a note before work that takes longer than a minute.
pub fn tell_duration(what: &str, seconds: f64, advice: &str) {
    if seconds > 60.0 {
        note(&format!("{what}: about {} on one core; {advice}", duration(seconds)));
    }
}

/// Prints a note before an equilibrium that takes longer than a minute; if the branch from rest ends before the load, it takes a hundred
/// times as long or longer.
pub fn tell_duration_of_equilibrium(what: &str, seconds: f64, advice: &str) {
    const LONGER: f64 = 100.0;
    tell_duration(what, seconds, advice);
    if seconds <= 60.0 && LONGER * seconds > 60.0 {
        let longer = duration(LONGER * seconds);
        note(&format!("{what}: {longer} or more if the load is too large to be reached from rest; {advice}"));
    }
}

pub fn duration(seconds: f64) -> String {
    if seconds < 2.0 * 3600.0 {
        format!("{:.0} minutes", (seconds / 60.0).max(1.0))
    } else if seconds < 2.0 * 86400.0 {
        format!("{:.0} hours", seconds / 3600.0)
    } else {
        format!("{:.1e} days", seconds / 86400.0)
    }
}

/// With `-v`, prints a step on stderr after the time since the start.
pub fn step(what: impl FnOnce() -> String) {
    stop_if_asked();
    if let Some(run) = current().filter(|run| run.volume == Volume::Verbose) {
        line(format_args!("[{:8.3} s] {}", run.start.elapsed().as_secs_f64(), what()));
    }
}

/// Like [`step`], for functions of the library that report what they do.
pub fn tell_step(what: &str) {
    step(|| what.to_owned());
}

/// A progress bar on stderr, if that is a terminal, but neither with `-q` nor with `-v` nor in a call within a process.
pub fn bar(length: u64, template: &str) -> Result<ProgressBar> {
    // Indicatif draws to stderr only if it is a terminal.
    let target = match current() {
        Some(run) if run.volume == Volume::Normal && !run.is_call() => ProgressDrawTarget::stderr(),
        _ => ProgressDrawTarget::hidden(),
    };
    let style = ProgressStyle::with_template(template)?;
    Ok(ProgressBar::with_draw_target(Some(length), target).with_style(style))
}

/// Does some work with a progress bar; `work` reports how many steps are done, and of how many.
pub fn with_bar<T>(template: &str, work: impl FnOnce(&(dyn Fn(usize, usize) + Sync)) -> T) -> Result<T> {
    let bar = bar(1, template)?;
    let done = work(&|done, of| {
        stop_if_asked();
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    Ok(done)
}

/// Prints a line on stderr. An error of writing there cannot be reported.
fn line(what: impl Display) {
    let _ = writeln!(
        EscapeControl::new(io::LineWriter::new(Stream::Stderr)),
        "{}",
        short_numbers(&what.to_string())
    );
}

/// Digits of the longest number that is printed in full.
const MOST_DIGITS: usize = 20;

/// A text in which numbers of more than 20 digits have an exponent. Digits in names, paths and quotes, and those that are not printed from
/// a floating-point number, stay.
fn short_numbers(text: &str) -> String {
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, from) = rest.split_at(start);
        let end = from.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(from.len());
        let digits = from[..end].trim_end_matches('.');
        out.push_str(before);
        rest = &from[digits.len()..];
        let is_long = digits.len() > MOST_DIGITS && !is_in_name(&out, rest);
        match is_long.then(|| printed_number(digits)).flatten() {
            Some(value) => out.push_str(&format!("{value:e}")),
            None => out.push_str(digits),
        }
    }
    out + rest
}

/// The number that is printed as these digits, with all its decimals or with some of them.
fn printed_number(digits: &str) -> Option<f64> {
    let value: f64 = digits.parse().ok()?;
    let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    (value.to_string() == digits || format!("{value:.decimals$}") == digits).then_some(value)
}

/// Whether digits between these texts are a part of a name, of a path or of a quotation.
fn is_in_name(before: &str, after: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || "/\\_\"".contains(c);
    let before = before.strip_suffix('-').filter(|start| start.ends_with(joins)).unwrap_or(before);
    let extension = after.strip_prefix('.').filter(|end| end.starts_with(char::is_alphanumeric));
    before.ends_with(joins) || after.starts_with(['/', '\\', '_', '-', '"']) || extension.is_some()
}

pub fn answer_equilibrium<const D: usize>(
    body: &Body<D>,
    solved: &Solved<D>,
    operation: Option<OperationRecord>,
    picture: Result<Svg, ReportError>,
    (out, global): (Option<&OutputDir>, &Global),
) -> Result<Outcome> {
    let Solved { positions, pulls, system, .. } = solved;
    let record = solved.record(body, operation);
    let (json, picture) = (Json(&record), picture?);
    let vtu = Vtu::of(body, positions, pulls)?.with_stresses(system.stresses(positions));
    let files: [(&str, &dyn Export); 3] =
        [("simulation.json", &json), ("tongue.svg", &picture), ("tongue.vtu", &vtu)];
    let by = super::provenance().with_tissue(system.tissue());
    write_and_answer(global, (out, &files), &json, &by, || table::simulation(&record))?;
    let status = record.equilibrium.solution.status;
    let failed = (status != SolveStatus::Converged)
        .then(|| format!("no equilibrium was found ({})", report::status_in_words(&status)));
    let made_up = match &record.of_body {
        OfBody::Hexahedra(of) => of.operation.as_ref(),
        OfBody::Pulled { .. } => None,
    };
    let failed = failed.into_iter().chain(made_up.into_iter().flat_map(OperationRecord::doubts));
    Ok(Outcome::of_alarms(failed, &record.equilibrium.alarms))
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Exit status 0.
    Good,
    /// Exit status 3: a result did not converge or cannot be trusted, for this reason.
    Untrustworthy(String),
    /// Exit status 1: some rows of the input could not be used; everything else is done.
    SomeRowsRefused,
}

impl Outcome {
    /// The outcome of a result that cannot be trusted for these reasons, if there are any.
    pub fn of_reasons(why: impl IntoIterator<Item = String>) -> Self {
        let why = report::joined(why, "; ");
        if why.is_empty() { Self::Good } else { Self::Untrustworthy(why + "; see the results") }
    }

    /// The outcome of a result with its alarms; `failed` says why the result failed, if it did.
    pub fn of_alarms(failed: impl IntoIterator<Item = String>, alarms: &[Alarm]) -> Self {
        Self::of_reasons(failed.into_iter().chain(alarms.iter().map(Alarm::to_string)))
    }
}

/// A sentence about the results that cannot be trusted, by status, of `all` results; `None` if there are none.
pub fn untrusted_sentence(bad: &BTreeMap<String, usize>, all: usize, what: &str) -> Option<String> {
    let count: usize = bad.values().sum();
    let statuses = report::status_counts(bad);
    (count > 0).then(|| format!("{count} of the {all} {what} cannot be trusted ({statuses})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_numbers_get_an_exponent_and_names_and_paths_stay() {
        for (value, short) in [(1e300, "1e300"), (-2.5e30, "-2.5e30"), (1e-30, "1e-30")] {
            assert_eq!(short_numbers(&format!("a is {value} N.")), format!("a is {short} N."));
            assert_eq!(short_numbers(&format!("GGa={value}: too large")), format!("GGa={short}: too large"));
        }
        assert_eq!(short_numbers(&format!("{:.1} mm", 1e40)), "1e40 mm");
        let zeros = 1e30.to_string();
        for name in [
            "2026112722150012345678901".to_owned(),
            format!("/a/{zeros}/b"),
            format!("run-{zeros}"),
            format!("{zeros}.csv"),
        ] {
            for text in [format!("written to {name}: fit.json"), format!("cannot read \"{name}\"")] {
                assert_eq!(short_numbers(&text), text);
            }
        }
        let quoted = format!("cannot read \"{zeros}\"");
        assert_eq!(short_numbers(&quoted), quoted);
    }
}
