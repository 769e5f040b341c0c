//! The columns of the tables of a batch: `muscles.csv`, a row for each muscle of each fit; `fits.csv`, a row for each fit, baseline
//! and row that could not be fitted; `posterior.csv`, a row for each muscle of each posterior.

use serde::Serialize;
use serde_json::{Value, json};

use super::BatchProvenance;
use crate::report::Told;
use crate::report::column::{Column, lines};
use crate::report::of_muscle::{self, OfMuscle};
use tongue_infer::inverse::batch::{BaselineRow, Refusal};

/// The columns of `muscles.csv`. Lengths in mm: measured ones are the subject's; target, simulated and residual are the model's, whose size
/// is another. What was not measured is empty.
fn muscle_columns<'a>(by: &'a BatchProvenance) -> Vec<Column<'a, OfMuscle<'a>>> {
    let mut columns = of_muscle::columns();
    columns.extend(provenance(by));
    columns
}

/// The last columns of every table.
fn provenance<'a, R: 'a>(by: &'a BatchProvenance) -> [Column<'a, R>; 3] {
    [
        Column::new("version", "", "version of tongue-fit", |_| by.version.as_str().into()),
        Column::new("inputs_sha256", "", "hash of all inputs", |_| by.inputs_sha256.as_str().into()),
        Column::new("command", "", "command line", |_| by.command.as_str().into()),
    ]
}

/// The columns of `posterior.csv`.
fn posterior_columns<'a>(by: &'a BatchProvenance) -> Vec<Column<'a, OfMuscle<'a>>> {
    type Of<'a> = fn(&OfMuscle<'a>) -> Value;
    const CHANGES: &str = "/posterior/summary/changes_n";
    const TENSIONS: &str = "/posterior/summary/tensions_n";
    const STRETCHES: &str = "/posterior/summary/stretches";
    fn part(r: &OfMuscle<'_>, of: &str, pointer: &str) -> Value {
        r.record.of(of, r.muscle).pointer(pointer).cloned().unwrap_or_default()
    }
    let columns: [(_, _, _, Of<'a>); 19] = [
        ("subject", "", "subject", |r| r.fit("/subject")),
        ("vowel", "", "vowel", |r| r.fit("/vowel")),
        ("baseline", "", "vowel that changes are counted from", |r| r.fit("/baseline")),
        ("muscle", "", "muscle", |r| r.muscle.into()),
        ("status", "", "whether the chains have mixed", |r| r.fit("/posterior/status")),
        ("change_median_n_per_m", "N/m", "median of the change of tension", |r| part(r, CHANGES, "/median")),
        ("change_low_50_n_per_m", "N/m", "lower end of its 50 % interval", |r| {
            part(r, CHANGES, "/interval_50/0")
        }),
        ("change_high_50_n_per_m", "N/m", "upper end", |r| part(r, CHANGES, "/interval_50/1")),
        ("change_low_95_n_per_m", "N/m", "lower end of its 95 % interval", |r| {
            part(r, CHANGES, "/interval_95/0")
        }),
        ("change_high_95_n_per_m", "N/m", "upper end", |r| part(r, CHANGES, "/interval_95/1")),
        ("probability_rises", "", "probability that the muscle pulls harder than in the baseline", |r| {
            part(r, CHANGES, "/probability_rises")
        }),
        ("tension_low_95_n_per_m", "N/m", "lower end of the 95 % interval of the tension", |r| {
            part(r, TENSIONS, "/interval_95/0")
        }),
        ("tension_high_95_n_per_m", "N/m", "upper end", |r| part(r, TENSIONS, "/interval_95/1")),
        ("depends_on_prior", "", "whether that interval is the prior's rather than the data's", |r| {
            part(r, TENSIONS, "/depends_on_prior")
        }),
        ("measured_stretch", "", "measured length over that in the baseline", |r| {
            part(r, STRETCHES, "/measured")
        }),
        ("left_out_mean", "", "mean of what is predicted without this measurement", |r| {
            part(r, STRETCHES, "/left_out/mean")
        }),
        ("left_out_low_95", "", "lower end of its 95 % interval", |r| {
            part(r, STRETCHES, "/left_out/interval_95/0")
        }),
        ("left_out_high_95", "", "upper end", |r| part(r, STRETCHES, "/left_out/interval_95/1")),
        ("r_hat", "", "largest split R-hat of the posterior", |r| r.fit("/posterior/r_hat")),
    ];
    let columns =
        columns.into_iter().map(|(name, unit, meaning, value)| Column::new(name, unit, meaning, value));
    // Without the hash: its draws have seeds of their own.
    let [version, _, command] = provenance(by);
    columns.chain([version, command]).collect()
}

/// A fit, a baseline or a row that could not be fitted.
struct OfRow<'a>(&'a Told);

impl OfRow<'_> {
    fn joined(&self, pointer: &str, between: &str) -> Value {
        match self.0.at(pointer) {
            Value::Null => Value::Null,
            _ => self.0.names(pointer).join(between).into(),
        }
    }

    fn count(&self, pointer: &str) -> Value {
        self.0.at(pointer).as_array().map_or(Value::Null, |all| all.len().into())
    }

    fn alarms(&self) -> Value {
        let all: Vec<_> = self.0.list("/alarms").iter().filter_map(|a| a.get("text")?.as_str()).collect();
        all.join("; ").into()
    }
}

/// The columns of `fits.csv` for a body with these muscles.
fn fit_columns<'a>(muscles: &'a [String], by: &'a BatchProvenance) -> Vec<Column<'a, OfRow<'a>>> {
    type Of<'a> = fn(&OfRow<'a>) -> Value;
    /// Where the value stands in the record, or how it is made of it.
    enum From<'a> {
        At(&'static str),
        Made(Of<'a>),
    }
    use From::{At, Made};
    let before: [(_, _, _, From<'a>); 10] = [
        ("subject", "", "subject", At("/subject")),
        ("vowel", "", "vowel", At("/vowel")),
        ("baseline", "", "vowel that changes are counted from", At("/baseline")),
        ("substitute_baseline", "", "whether it stands in for a missing /ɯ/", At("/substitute_baseline")),
        ("target_kind", "", "quantity that was fitted: ratio or stretch", At("/target_kind")),
        ("status", "", "how the fit ended; baseline or not_fitted where there is none", At("/status")),
        ("message", "", "why there is no fit", At("/message")),
        ("active", "", "muscles that may contract", Made(|r| r.joined("/active", "+"))),
        ("equations", "", "muscles that the fit has to meet", Made(|r| r.count("/fitted"))),
        ("undetermined", "", "directions that the data leave open", At("/identifiability/undetermined")),
    ];
    let after: [(_, _, _, From<'a>); 17] = [
        ("cost", "", "smallest objective", At("/cost")),
        ("misfit", "", "RMS residual of the fitted muscles", At("/misfit")),
        ("passive_rms_stretch", "", "RMS residual of the passive stretches", At("/passive/rms_stretch")),
        ("no_change_rms_stretch", "", "the same if nothing changed", At("/passive/no_change_rms_stretch")),
        ("thesis_rms_stretch", "", "the same of the thesis's simulation", At("/passive/thesis_rms_stretch")),
        ("passive_rms_ratio", "", "RMS residual of the passive ratios", At("/passive/rms_ratio")),
        ("no_change_rms_ratio", "", "the same if nothing changed", At("/passive/no_change_rms_ratio")),
        ("thesis_rms_ratio", "", "the same of the thesis's simulation", At("/passive/thesis_rms_ratio")),
        (
            "rest_to_baseline_rms_ratio",
            "",
            "distance of the model at rest from the baseline",
            At("/rest_shape/rms_ratio"),
        ),
        (
            "smallest_singular_value_per_n",
            "1/N",
            "how weakly the fitted values answer to tensions",
            Made(|r| r.0.list("/identifiability/singular_values").last().cloned().unwrap_or_default()),
        ),
        ("other_optima", "", "other local optima", Made(|r| r.count("/other_optima"))),
        (
            "pattern_found",
            "",
            "muscles of the published pattern that were found",
            Made(|r| r.joined("/pattern/found", "+")),
        ),
        ("pattern_missing", "", "muscles of it that were not", Made(|r| r.joined("/pattern/missing", "+"))),
        (
            "pattern_unexpected",
            "",
            "muscles that are not in it",
            Made(|r| r.joined("/pattern/unexpected", "+")),
        ),
        ("alarms", "", "reasons for doubt", Made(OfRow::alarms)),
        ("evaluations", "", "equilibria that were solved", At("/evaluations")),
        ("line", "", "line of the row in its file", At("/line")),
    ];
    let column = |(name, unit, meaning, from): (&'static str, _, _, From<'a>)| match from {
        At(pointer) => Column::new(name, unit, meaning, move |r: &OfRow<'a>| r.0.at(pointer).clone()),
        Made(value) => Column::new(name, unit, meaning, value),
    };
    let tensions = muscles.iter().map(|m| {
        let own = move |r: &OfRow<'a>| r.0.of("/tensions_n", m).clone();
        Column::new(format!("tension_{m}_n_per_m"), "N/m", "tension that was found", own)
    });
    before
        .into_iter()
        .map(column)
        .chain(tensions)
        .chain(after.into_iter().map(column))
        .chain(provenance(by))
        .collect()
}

/// A row that is a baseline as a record.
pub fn of_baseline(b: &BaselineRow) -> Told {
    told(&json!({
        "subject": b.subject, "vowel": b.vowel, "baseline": b.vowel, "substitute_baseline": b.substitute, "status": "baseline",
        "message": "the baseline itself", "line": b.line,
    }))
}

/// A row that could not be fitted as a record.
pub fn of_refusal(r: &Refusal) -> Told {
    told(&json!({
        "subject": r.subject, "vowel": r.vowel, "target_kind": r.kind, "status": "not_fitted", "message": r.message, "line": r.line,
    }))
}

fn told(record: &Value) -> Told {
    Told::new(record).unwrap_or_default()
}

/// The rows of `muscles.csv` for one fit, with the header in front where that is asked for.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn muscle_lines(record: &Told, by: &BatchProvenance, with_header: bool) -> std::io::Result<String> {
    rows(&muscle_columns(by), &of_muscles(record, "/tensions_n"), with_header)
}

/// The rows of `posterior.csv` for one fit; none where it has no posterior.
pub fn posterior_lines(record: &Told, by: &BatchProvenance, with_header: bool) -> std::io::Result<String> {
    let has_posterior = !record.at("/posterior").is_null();
    let muscles = if has_posterior { of_muscles(record, "/tensions_n") } else { Vec::new() };
    rows(&posterior_columns(by), &muscles, with_header)
}

/// The row of `fits.csv` for a fit, a baseline or a row that could not be fitted, with the header in front where that is asked for.
pub fn fit_line(
    muscles: &[String],
    record: &Told,
    by: &BatchProvenance,
    with_header: bool,
) -> std::io::Result<String> {
    rows(&fit_columns(muscles, by), &[OfRow(record)], with_header)
}

fn of_muscles<'a>(record: &'a Told, pointer: &str) -> Vec<OfMuscle<'a>> {
    record.muscles(pointer).into_iter().map(|muscle| OfMuscle { record, muscle }).collect()
}

fn rows<'a, R: 'a>(columns: &[Column<'a, R>], rows: &[R], with_header: bool) -> std::io::Result<String> {
    let header = with_header.then(|| columns.iter().map(|c| c.name.clone().into_owned()).collect());
    let cells = rows.iter().map(|row| columns.iter().map(|c| c.cell(row)).collect());
    let mut out = Vec::new();
    lines(&mut out, header.into_iter().chain(cells))?;
    String::from_utf8(out).map_err(std::io::Error::other)
}

/// The name that serde gives a unit variant.
pub(super) fn name(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::column;

    /// The columns of all tables, explained: the content of docs/columns.md.
    fn explained() -> String {
        let by =
            BatchProvenance { version: String::new(), command: String::new(), inputs_sha256: String::new() };
        format!(
            "# Columns of the tables of a batch\n\nWritten by `tongue-fit batch`. Empty where a value does not exist.\n\n\
             ## fits.csv: a row for each fit, baseline and row that could not be fitted\n\n{}\n\
             ## muscles.csv: a row for each muscle of each fit\n\n{}\n\
             ## posterior.csv: a row for each muscle of each posterior (`--posterior N`)\n\n{}",
            column::explained(&fit_columns(&["MUSCLE".to_owned()], &by)),
            column::explained(&muscle_columns(&by)),
            column::explained(&posterior_columns(&by))
        )
    }

    #[test]
    fn the_page_of_columns_is_that_of_the_tables() {
        let written = include_str!("../../../../../docs/columns.md");
        assert_eq!(written, explained(), "write what stands on the right into docs/columns.md");
    }
}
