//! `tongue-fit lengths check`: how a table of lengths is read.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use serde_json::{Value, json};
use tongue_fit::inner::choice;
use tongue_fit::inner::inverse::batch::{self, Refusal, Selection};
use tongue_fit::inner::measured::lengths::{Encoding, HalfWidth, ReadColumn, Reading, Row};
use tongue_fit::inner::report::status_in_words;
use tongue_fit::measured::{Dataset, Lengths, Muscles, TargetKind, Vowel};

use super::table::{align_left, join_first, rows};
use super::{Global, Outcome, inputs, output, table};

const MOST_LISTED: usize = 50;

#[derive(Debug, Clone, clap::Subcommand)]
#[command(after_help = "Example:\n  tongue-fit lengths check my.csv")]
pub enum LengthsAction {
    /// Read a table of lengths and report how it is understood
    Check(Check),
}

#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:\n  \
    tongue-fit lengths check my.csv\n  \
    tongue-fit lengths check my.csv --baseline e --json > understood.json\n\n\
    A row for each subject and vowel; the header names the columns: subject, vowel, and GGa_mm or \"GGa (mm)\" for the lengths of a \
    muscle GGa (cm and m too). Whatever a spreadsheet exports will do.\n\
    Exit status: 0 all understood and every row can be fitted in a body with these muscles, 1 some cells, some rows or the whole table cannot be used.")]
pub struct Check {
    /// The table, or - for stdin
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The vowel that the others are compared with [default: ɯ, and e for subjects without ɯ]
    #[arg(long, value_name = "VOWEL")]
    baseline: Option<Vowel>,
    /// Half width of the rounding of every length, mm [default: from the table or its digits, else 0.5]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    error_mm: Option<f64>,
}

struct SubjectRows<'a> {
    subject: &'a str,
    baseline: Option<&'a Vowel>,
    rows: Vec<&'a Row>,
}

pub fn run(LengthsAction::Check(check): &LengthsAction, global: &Global) -> Result<Outcome> {
    let (data, doubts) = inputs::lengths(Some(&check.file), check.error_mm)?;
    let usual = check.baseline.clone().unwrap_or_else(Vowel::unrounded_u);
    // The plan of a batch of all rows says which rows can be fitted.
    let kinds = TargetKind::ALL.to_vec();
    let selection = Selection { kinds, baseline: check.baseline.clone(), ..Selection::default() };
    let plan = batch::plan(&data, &selection)?;
    let mut rows: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
    data.rows.iter().for_each(|row| rows.entry(&row.lengths.subject).or_default().push(row));
    let baselines: BTreeMap<&str, &Vowel> =
        plan.baselines.iter().map(|row| (row.subject.as_str(), &row.vowel)).collect();
    let subjects = Vec::from_iter(data.subjects().into_iter().map(|subject| SubjectRows {
        subject,
        baseline: baselines.get(subject).copied(),
        rows: rows.remove(subject).unwrap_or_default(),
    }));
    let unknown = unknown(&data.muscles);
    let mut record = json!({
        "version": tongue_fit::VERSION,
        "file": data.origin,
        "reading": data.reading,
        "muscles": data.muscles[..],
        "baseline": usual,
        "subjects": subjects.iter().map(record).collect::<Vec<_>>(),
        "broken": data.broken,
        "bad_cells": data.bad_cells,
        "not_fitted": plan.refusals,
    });
    for (key, sentences) in [("unknown_muscles", &unknown), ("doubts", &doubts)] {
        if !sentences.is_empty() {
            record[key] = json!(sentences);
        }
    }
    output::tell(global, &record, || text(&data, &usual, &subjects, &plan.refusals, &unknown))?;
    let is_misspelt = unknown.iter().any(|sentence| sentence.contains(DID_YOU_MEAN));
    let is_good = !is_misspelt
        && doubts.is_empty()
        && data.broken.is_empty()
        && data.bad_cells.is_empty()
        && plan.refusals.is_empty();
    Ok(if is_good { Outcome::Good } else { Outcome::SomeRowsRefused })
}

fn record(of: &SubjectRows<'_>) -> Value {
    let rows = of.rows.iter().map(|Row { line, lengths, .. }| {
        let measured: BTreeMap<&str, f64> = lengths.measured().collect();
        let names = lengths.muscles.iter().map(String::as_str);
        let half_widths = names.zip(&lengths.half_width_mm).filter(|(name, _)| measured.contains_key(name));
        json!({
            "vowel": lengths.vowel,
            "line": line,
            "lengths_mm": measured,
            "half_widths_mm": half_widths.collect::<BTreeMap<_, _>>(),
            "not_measured": not_measured(lengths),
        })
    });
    json!({ "subject": of.subject, "baseline": of.baseline, "rows": rows.collect::<Vec<_>>() })
}

fn not_measured(lengths: &Lengths) -> Vec<&str> {
    let all = lengths.muscles.iter().zip(&lengths.length_mm);
    all.filter(|(_, mm)| mm.is_none()).map(|(name, _)| name.as_str()).collect()
}

/// A sentence for each muscle of a table that the built-in tongue does not have, with the nearest name that the built-in tongue has and the
/// table lacks.
fn unknown(names: &[String]) -> Vec<String> {
    let known = Muscles::built_in();
    let free = known.all().iter().map(|m| m.name.clone());
    let free = Vec::from_iter(free.filter(|own| names.iter().all(|name| !own.eq_ignore_ascii_case(name))));
    names.iter().filter(|name| known.get(name).is_none()).map(|name| {
        let near = choice::hint(name, free.iter().map(String::as_str));
        let near = if near.starts_with(DID_YOU_MEAN) { format!("; {near}") } else { String::new() };
        format!(
            "the built-in tongue has no muscle {name}{near} (a fit of this table needs a body that has it, or the table without its column)"
        )
    }).collect()
}

/// How a hint begins if a name is probably misspelt.
const DID_YOU_MEAN: &str = "did you mean";

fn text(
    data: &Dataset,
    usual: &Vowel,
    all: &[SubjectRows<'_>],
    not_fitted: &[Refusal],
    unknown: &[String],
) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<20}{value}");
    };
    let reading = &data.reading;
    line("table", data.origin.clone());
    line("text", text_format(reading));
    line("header", format!("line {}", reading.header_line));
    line("subjects, vowels", format!("columns {:?} and {:?}", reading.subject, reading.vowel));
    let mut rows = table::count_of(data.rows.len(), "row");
    if !reading.rows_without_lengths.is_empty() {
        let lines = join_first(reading.rows_without_lengths.iter().map(u64::to_string), MOST_LISTED, ", ");
        let _ = write!(rows, "; ignored, because they have no lengths: line {lines}");
    }
    line("rows", rows);
    if !reading.set_aside.is_empty() {
        let columns =
            reading.set_aside.iter().map(|s| format!("column {} {:?} ({})", s.column, s.name, s.why));
        line("set aside", join_first(columns, MOST_LISTED, &format!("\n{:20}", "")));
    }
    let _ = writeln!(text, "\n{}\n\n{}", muscles(data), subjects(all));
    let substitutes = all.iter().filter_map(|s| {
        let own = s.baseline.filter(|own| *own != usual)?;
        let what = format!("{} has no /{usual}/: batch compares with /{own}/", s.subject);
        Some(format!("{what}, a fit of one vowel needs --baseline {own}"))
    });
    let parts: [(&str, &str, Vec<String>); 3] = [
        ("row", "left out", data.broken.iter().map(|row| row.fault.to_string()).collect()),
        ("cell", "left out", data.bad_cells.iter().map(ToString::to_string).collect()),
        ("fit", "refused", not_fitted.iter().map(ToString::to_string).collect()),
    ];
    let parts = parts.into_iter().filter(|(.., messages)| !messages.is_empty()).map(|(what, verb, all)| {
        format!("{} {verb}:\n{}", table::count_of(all.len(), what), join_first(all, MOST_LISTED, "\n"))
    });
    for part in substitutes.chain(unknown.iter().cloned()).chain(parts) {
        let _ = writeln!(text, "{part}");
    }
    text
}

fn text_format(reading: &Reading) -> String {
    let encoding = match reading.encoding {
        Encoding::Utf8 => "UTF-8",
        Encoding::Utf8Bom => "UTF-8 with byte order mark",
        Encoding::Utf16 => "UTF-16",
    };
    let ends = status_in_words(&reading.line_ends).to_uppercase();
    let mark = status_in_words(&reading.decimal_mark);
    format!("{encoding}, {ends} line ends, {} between fields, decimal {mark}", reading.separator.plural())
}

fn muscles(data: &Dataset) -> comfy_table::Table {
    let header = ["muscle", "column", "measured", "shortest, mm", "longest, mm", "half width"];
    let mut t = rows(&header, data.reading.columns.iter().enumerate(), |(n, column)| {
        let lengths = data.rows.iter().filter_map(|row| *row.lengths.length_mm.get(n)?);
        let [shortest, longest] = [f64::min, f64::max]
            .map(|end| lengths.clone().reduce(end).map_or_else(String::new, |mm| format!("{mm:.1}")));
        let measured = format!("{} of {}", lengths.count(), data.rows.len());
        [column.muscle.clone(), column.name.clone(), measured, shortest, longest, half_width(column)]
    });
    align_left(&mut t, [1, 5]);
    t
}

fn half_width(column: &ReadColumn) -> String {
    match &column.half_width {
        HalfWidth::Column { name, else_mm } => format!("column {name:?}, else {else_mm} mm"),
        HalfWidth::Given { mm } => format!("{mm} mm, as given"),
        HalfWidth::Digits { mm } | HalfWidth::Default { mm } if *mm > 0.5 => {
            format!("{mm} mm, because all lengths are multiples of {} mm", 2.0 * mm)
        }
        HalfWidth::Digits { mm } => format!("{mm} mm, by the digits"),
        HalfWidth::Default { mm } => {
            format!("{mm} mm, by default, because the lengths have more digits than a measurement gives")
        }
    }
}

fn subjects(all: &[SubjectRows<'_>]) -> String {
    let header = ["subject", "vowels", "baseline", "not measured"];
    let mut t = rows(&header, all.iter().take(MOST_LISTED), |subject| {
        let vowels = subject.rows.iter().map(|row| row.lengths.vowel.to_string());
        let missing = subject.rows.iter().map(|row| (&row.lengths.vowel, not_measured(&row.lengths)));
        let missing = missing.filter(|(_, names)| !names.is_empty());
        let missing = missing.map(|(vowel, names)| format!("/{vowel}/ {}", names.join(", ")));
        [
            subject.subject.to_owned(),
            join_first(vowels, MOST_LISTED, " "),
            subject.baseline.map_or("none".to_owned(), Vowel::to_string),
            join_first(missing, MOST_LISTED, "\n"),
        ]
    });
    align_left(&mut t, 1..4);
    match all.len().saturating_sub(MOST_LISTED) {
        0 => t.to_string(),
        more => format!("{t}\nand {more} more subjects"),
    }
}
