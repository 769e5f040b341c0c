//! The columns of the tables of a batch: `muscles.csv` and `posterior.csv` (a row for each muscle of each fit), and `fits.csv`.

use serde_json::{Value, json};

use super::Batch;
use super::record::AssessedRecord;
use crate::report::column::{self, Column};
use crate::report::export::text;
use crate::report::muscle_columns::{self, OfMuscle};
use crate::report::{Provenance, Table, joined};
use tongue_infer::posterior::{Change, LeftOut, Summary, Tension};

/// The columns of `muscles.csv`: those of every fit ([`muscle_columns::columns`]), and the provenance.
fn muscle_columns<'a>(by: &'a Provenance) -> Vec<Column<'a, OfMuscle<'a>>> {
    muscle_columns::columns().into_iter().chain(provenance(by)).collect()
}

pub(super) fn provenance<'a, R: 'a>(by: &'a Provenance) -> [Column<'a, R>; 3] {
    [
        Column::new("version", "", "version of tongue-fit", |_| by.version.into()),
        Column::new("inputs_sha256", "", "hash of all inputs", |_| json!(by.inputs_sha256)),
        Column::new("command", "", "command line", |_| by.command.as_str().into()),
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
        ("status", "", "whether the chains have mixed", |r| {
            json!(r.record.posterior.as_ref().map(|p| p.diagnostics.status))
        }),
        ("change_median_n_per_m", "N/m", "median of the change of tension", |r| {
            change(r, |c| c.spread.median.into())
        }),
        ("change_low_50_n_per_m", "N/m", "lower end of its 50 % interval", |r| {
            change(r, |c| c.spread.interval_50[0].into())
        }),
        ("change_high_50_n_per_m", "N/m", "upper end", |r| change(r, |c| c.spread.interval_50[1].into())),
        ("change_low_95_n_per_m", "N/m", "lower end of its 95 % interval", |r| {
            change(r, |c| c.spread.interval_95[0].into())
        }),
        ("change_high_95_n_per_m", "N/m", "upper end", |r| change(r, |c| c.spread.interval_95[1].into())),
        ("probability_rises", "", "probability that the muscle pulls harder than in the baseline; empty if the priors fix both tensions", |r| {
            change(r, |c| c.probability_rises.into())
        }),
        ("tension_low_95_n_per_m", "N/m", "lower end of the 95 % interval of the tension", |r| {
            tension(r, |t| t.spread.interval_95[0].into())
        }),
        ("tension_high_95_n_per_m", "N/m", "upper end", |r| tension(r, |t| t.spread.interval_95[1].into())),
        ("depends_on_prior", "", "whether that interval depends more on the prior than on the data", |r| {
            tension(r, |t| t.depends_on_prior.into())
        }),
        ("measured_stretch", "", "measured length over that in the baseline", |r| {
            json!(summary(r).and_then(|s| s.stretches.get(r.name())).map(|s| s.measured))
        }),
        ("left_out_mean", "", "mean of what is predicted without this measurement", |r| {
            left_out(r, |l| l.spread.mean)
        }),
        ("left_out_low_95", "", "lower end of its 95 % interval", |r| {
            left_out(r, |l| l.spread.interval_95[0])
        }),
        ("left_out_high_95", "", "upper end", |r| left_out(r, |l| l.spread.interval_95[1])),
        ("r_hat", "", "largest split R-hat of the posterior", |r| {
            json!(r.record.posterior.as_ref().map(|p| p.diagnostics.r_hat))
        }),
    ]));
    // The hash of all inputs is left out, because the draws have seeds of their own.
    let [version, _, command] = provenance(by);
    columns.extend([version, command]);
    columns
}

fn fit_columns<'a>(muscles: &'a [String], by: &'a Provenance) -> Vec<Column<'a, AssessedRecord>> {
    let before = column::columns::<AssessedRecord, _>([
        ("subject", "", "subject", |r| json!(r.target().subject)),
        ("vowel", "", "vowel", |r| json!(r.target().vowel)),
        ("baseline", "", "vowel with which this one is compared", |r| json!(r.target().baseline)),
        ("substitute_baseline", "", "whether it stands in for a missing /ɯ/", |r| {
            r.substitute_baseline.into()
        }),
        ("target_kind", "", "quantity that was fitted: ratio or stretch", |r| json!(r.target().kind)),
        ("status", "", "how the fit ended; baseline or not_fitted where there is none", |r| {
            json!(r.fit().answer.status)
        }),
        ("message", "", "why there is no fit", |_| Value::Null),
        ("active", "", "muscles that may contract", |r| r.fit().active_names().join("+").into()),
        ("equations", "", "muscles that the fit has to meet", |r| r.fitted.len().into()),
        ("undetermined", "", "directions that the data leave open", |r| json!(r.fit().answer.undetermined())),
    ]);
    let after = column::columns::<AssessedRecord, _>([
        ("cost", "", "objective where the search ended, before the answer was moved onto the target", |r| {
            r.cost.into()
        }),
        ("misfit", "", "RMS residual of the fitted muscles", |r| r.fit().answer.misfit.into()),
        ("passive_rms_stretch", "", "RMS residual of the passive stretches", |r| {
            json!(r.passive.rms_stretch)
        }),
        ("no_change_rms_stretch", "", "the same if nothing changed", |r| {
            json!(r.passive.no_change_rms_stretch)
        }),
        ("thesis_rms_stretch", "", "the same of the thesis's simulation", |r| {
            json!(r.passive.thesis_rms_stretch)
        }),
        ("passive_rms_ratio", "", "RMS residual of the passive ratios, without the reference muscle", |r| {
            json!(r.passive.rms_ratio)
        }),
        ("no_change_rms_ratio", "", "the same if nothing changed", |r| json!(r.passive.no_change_rms_ratio)),
        ("thesis_rms_ratio", "", "the same of the thesis's simulation", |r| {
            json!(r.passive.thesis_rms_ratio)
        }),
        ("rest_to_baseline_rms_ratio", "", "distance of the model at rest from the baseline", |r| {
            json!(r.rest_shape.map(|d| d.rms_ratio))
        }),
        ("smallest_singular_value_per_n", "m/N", "smallest singular value of the derivatives", |r| {
            json!(r.fit().answer.identifiability.as_ref().and_then(|i| i.singular_values.last()))
        }),
        ("other_optima", "", "other local optima", |r| r.other_optima.len().into()),
        ("pattern_found", "", "muscles of the published pattern that were found", |r| {
            json!(r.pattern.as_ref().map(|p| p.found.join("+")))
        }),
        ("pattern_missing", "", "muscles of it that were not", |r| {
            json!(r.pattern.as_ref().map(|p| p.missing.join("+")))
        }),
        ("pattern_unexpected", "", "muscles that are not in it", |r| {
            json!(r.pattern.as_ref().map(|p| p.unexpected.join("+")))
        }),
        ("alarms", "", "reasons for doubt", |r| joined(&r.record.alarms, "; ").into()),
        ("evaluations", "", "equilibria that were solved", |r| r.fit().answer.counts.evaluations.into()),
        ("line", "", "line of the row in its file", |r| r.line.into()),
    ]);
    let tensions = muscles.iter().map(|m| {
        Column::new(
            format!("tension_{m}_n_per_m"),
            "N/m",
            "tension that was found",
            move |r: &AssessedRecord| json!(r.fit().tension(m)),
        )
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

    fn explained() -> String {
        let by = Provenance::new("");
        format!(
            "# Columns of the tables of fits\n\nThese are the tables of `tongue-fit batch` and, the last one, of `tongue-fit --vowel V`. \
             A cell is empty if its value does not exist.\n\n\
             ## fits.csv: a row for each fit, baseline and row that could not be fitted\n\n{}\n\
             ## muscles.csv: a row for each muscle of each fit\n\n{}\n\
             ## posterior.csv: a row for each muscle of each posterior (`--posterior N`)\n\n{}\n\
             ## contrasts.csv: a row for each muscle and two vowels of a subject (`--joint`)\n\n{}\n\
             ## over_speakers.csv: a row for each muscle and two vowels of at least two subjects (also of `track`: labels of speakers)\n\n{}\n\
             ## fit.csv: a row for each muscle of one fit\n\n{}\n\
             `version`, `command`, `tissue`, `body` and, for a continuum, `chosen` follow, as in every CSV file of one run.\n",
            column::explanations(&fit_columns(&["MUSCLE".to_owned()], &by)),
            column::explanations(&muscle_columns(&by)),
            column::explanations(&posterior_columns(&by)),
            column::explanations(&column::columns(CONTRASTS)),
            column::explanations(&column::columns(OVER_SPEAKERS)),
            column::explanations(&muscle_columns::select_columns(muscle_columns::OF_ONE_FIT))
        )
    }

    #[test]
    fn the_page_of_columns_is_that_of_the_tables() {
        let written = include_str!("../../../../../docs/columns.md");
        assert_eq!(written, explained(), "write what stands on the right into docs/columns.md");
    }
}
