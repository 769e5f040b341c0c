//! The columns of the tables of a batch: `muscles.csv` and `posterior.csv` (a row for each muscle of each fit), and `fits.csv`.

use serde_json::{Value, json};

use super::Batch;
use super::record::AssessedRecord;
use crate::report::column::{self, Column};
use crate::report::csv::text;
use crate::report::muscle_columns::{self, OfMuscle};
use crate::report::{Provenance, Table, joined};
use tongue_infer::posterior::{Change, LeftOut, Summary, Tension};

/// The columns of `muscles.csv`: those of every fit ([`muscle_columns::columns`]), and the provenance.
fn muscle_columns<'a>(by: &'a Provenance) -> Vec<Column<'a, OfMuscle<'a>>> {
    muscle_columns::columns().into_iter().chain(provenance(by)).collect()
}

pub(super) fn provenance<'a, R: 'a>(by: &'a Provenance) -> [Column<'a, R>; 3] {
    [
        Column::new("version", |_| by.version.into()),
        Column::new("inputs_sha256", |_| json!(by.inputs_sha256)),
        Column::new("command", |_| by.command.as_str().into()),
    ]
}

fn posterior_columns<'a>(by: &'a Provenance) -> Vec<Column<'a, OfMuscle<'a>>> {
    fn summary<'r>(r: &OfMuscle<'r>) -> Option<&'r Summary> {
        r.record.posterior.as_ref()?.summary.as_ref()
    }
    fn change(r: &OfMuscle<'_>, value: fn(&Change) -> Value) -> Value {
        json!(summary(r).and_then(|s| s.changes_n.get(r.name())).map(value))
    }
    fn tension(r: &OfMuscle<'_>, value: fn(&Tension) -> Value) -> Value {
        json!(summary(r).and_then(|s| s.tensions_n.get(r.name())).map(value))
    }
    fn left_out(r: &OfMuscle<'_>, value: fn(&LeftOut) -> f64) -> Value {
        json!(summary(r).and_then(|s| s.stretches.get(r.name())?.left_out.as_ref()).map(value))
    }
    let mut columns = muscle_columns::select_columns("subject,vowel,baseline,muscle");
    columns.extend(column::columns::<OfMuscle<'a>, _>([
        ("status", |r| json!(r.record.posterior.as_ref().map(|p| p.diagnostics.status))),
        ("change_median_n_per_m", |r| change(r, |c| c.spread.median.into())),
        ("change_low_50_n_per_m", |r| change(r, |c| c.spread.interval_50[0].into())),
        ("change_high_50_n_per_m", |r| change(r, |c| c.spread.interval_50[1].into())),
        ("change_low_95_n_per_m", |r| change(r, |c| c.spread.interval_95[0].into())),
        ("change_high_95_n_per_m", |r| change(r, |c| c.spread.interval_95[1].into())),
        ("probability_rises", |r| change(r, |c| c.probability_rises.into())),
        ("tension_low_95_n_per_m", |r| tension(r, |t| t.spread.interval_95[0].into())),
        ("tension_high_95_n_per_m", |r| tension(r, |t| t.spread.interval_95[1].into())),
        ("depends_on_prior", |r| tension(r, |t| t.depends_on_prior.into())),
        ("measured_stretch", |r| {
            json!(summary(r).and_then(|s| s.stretches.get(r.name())).map(|s| s.measured))
        }),
        ("left_out_mean", |r| left_out(r, |l| l.spread.mean)),
        ("left_out_low_95", |r| left_out(r, |l| l.spread.interval_95[0])),
        ("left_out_high_95", |r| left_out(r, |l| l.spread.interval_95[1])),
        ("r_hat", |r| json!(r.record.posterior.as_ref().map(|p| p.diagnostics.r_hat))),
    ]));
    // The hash of all inputs is left out, because the draws have seeds of their own.
    let [version, _, command] = provenance(by);
    columns.extend([version, command]);
    columns
}

fn fit_columns<'a>(muscles: &'a [String], by: &'a Provenance) -> Vec<Column<'a, AssessedRecord>> {
    let before = column::columns::<AssessedRecord, _>([
        ("subject", |r| json!(r.target().subject)),
        ("vowel", |r| json!(r.target().vowel)),
        ("baseline", |r| json!(r.target().baseline)),
        ("substitute_baseline", |r| r.substitute_baseline.into()),
        ("target_kind", |r| json!(r.target().kind)),
        ("status", |r| json!(r.fit().answer.status)),
        ("message", |_| Value::Null),
        ("active", |r| r.fit().active_names().join("+").into()),
        ("equations", |r| r.fitted.len().into()),
        ("undetermined", |r| json!(r.fit().answer.undetermined())),
    ]);
    let after = column::columns::<AssessedRecord, _>([
        ("cost", |r| r.cost.into()),
        ("misfit", |r| r.fit().answer.misfit.into()),
        ("passive_rms_stretch", |r| json!(r.passive.rms_stretch)),
        ("no_change_rms_stretch", |r| json!(r.passive.no_change_rms_stretch)),
        ("thesis_rms_stretch", |r| json!(r.passive.thesis_rms_stretch)),
        ("passive_rms_ratio", |r| json!(r.passive.rms_ratio)),
        ("no_change_rms_ratio", |r| json!(r.passive.no_change_rms_ratio)),
        ("thesis_rms_ratio", |r| json!(r.passive.thesis_rms_ratio)),
        ("rest_to_baseline_rms_ratio", |r| json!(r.rest_shape.map(|d| d.rms_ratio))),
        ("smallest_singular_value_per_n", |r| {
            json!(r.fit().answer.identifiability.as_ref().and_then(|i| i.singular_values.last()))
        }),
        ("other_optima", |r| r.other_optima.len().into()),
        ("pattern_found", |r| json!(r.pattern.as_ref().map(|p| p.found.join("+")))),
        ("pattern_missing", |r| json!(r.pattern.as_ref().map(|p| p.missing.join("+")))),
        ("pattern_unexpected", |r| json!(r.pattern.as_ref().map(|p| p.unexpected.join("+")))),
        ("alarms", |r| joined(&r.record.alarms, "; ").into()),
        ("evaluations", |r| r.fit().answer.counts.evaluations.into()),
        ("line", |r| r.line.into()),
    ]);
    let tensions = muscles.iter().map(|m| {
        Column::new(format!("tension_{m}_n_per_m"), move |r: &AssessedRecord| json!(r.fit().tension(m)))
    });
    before.into_iter().chain(tensions).chain(after).chain(provenance(by)).collect()
}

/// The headers of `fits.csv` (for a body with muscles of these names), `muscles.csv` and `posterior.csv`, and their rows for one fit.
pub fn of_fit(r: &AssessedRecord, names: &[String], by: &Provenance) -> [Table; 3] {
    let muscles = r.record.muscles(r.substitute_baseline);
    let of_posterior = if r.record.posterior.is_some() { &muscles[..] } else { &[] };
    [
        column::table(&fit_columns(names, by), std::slice::from_ref(r)),
        column::table(&muscle_columns(by), &muscles),
        column::table(&posterior_columns(by), of_posterior),
    ]
}

/// The header of `fits.csv`, and its rows for baselines and for rows that could not be fitted.
pub fn of_rows_without_fit(batch: &Batch<'_>) -> Table {
    let columns = fit_columns(batch.muscles, batch.provenance);
    let mut table = column::table(&columns, &[]);
    let baselines = batch.baselines.iter().map(|r| {
        json!({"line": r.line, "subject": r.subject, "vowel": r.vowel, "baseline": r.vowel,
            "substitute_baseline": r.substitute, "status": "baseline", "message": "the baseline itself"})
    });
    let refusals = batch.refusals.iter().map(|r| {
        json!({"line": r.line, "subject": r.subject, "vowel": r.vowel, "target_kind": r.kind,
            "status": "not_fitted", "message": r.message})
    });
    let by = json!(batch.provenance);
    for row in baselines.chain(refusals) {
        let value = |name: &str| row.get(name).or(by.get(name)).cloned().unwrap_or_default();
        table.rows.push(columns.iter().map(|column| text(value(&column.name))).collect());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::batch::summary::CONTRASTS;
    use crate::report::track::tables::OVER_SPEAKERS;

    #[test]
    fn the_page_of_columns_explains_those_of_the_tables_in_their_order() {
        let by = Provenance::new("");
        let tables = [
            column::table(&fit_columns(&["MUSCLE".to_owned()], &by), &[]),
            column::table(&muscle_columns(&by), &[]),
            column::table(&posterior_columns(&by), &[]),
            column::table(&column::columns(CONTRASTS), &[]),
            column::table(&column::columns(OVER_SPEAKERS), &[]),
            column::table(&muscle_columns::select_columns(muscle_columns::OF_ONE_FIT), &[]),
        ];
        let page = include_str!("../../../../../docs/columns.md");
        let explained = page.split("\n## ").skip(1).map(|section| {
            let rows = section.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
            rows.map(|(name, _)| name.to_owned()).collect::<Vec<_>>()
        });
        assert_eq!(explained.collect::<Vec<_>>(), tables.map(|table| table.columns));
    }
}
