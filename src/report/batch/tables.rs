//! The two tables of a batch: a row for every muscle of every fit, and a row for every fit.

use crate::muscle::{COUNT, Muscle};
use crate::report::record::ByMuscle;

use super::Provenance;
use super::record::AssessedRecord;
use crate::inverse::batch::{BaselineRow, Refusal};

/// Columns of `muscles.csv`, one row for every subject, vowel, kind of target and muscle. Lengths in mm: measured ones are the
/// subject's; target, simulated and residual are the model's, whose size is another. Ratios are to GGa, stretches to the
/// baseline (measured) or rest (model).
pub const MUSCLE_COLUMNS: [&str; 33] = [
    "subject",
    "vowel",
    "baseline",
    "substitute_baseline",
    "target_kind",
    "status",
    "muscle",
    "active",
    "fitted",
    "uncertain",
    "tension_n_per_m",
    "tension_low_n_per_m",
    "tension_high_n_per_m",
    "baseline_length_mm",
    "measured_length_mm",
    "rest_length_mm",
    "target_length_mm",
    "simulated_length_mm",
    "residual_mm",
    "target_ratio",
    "simulated_ratio",
    "residual_ratio",
    "ratio_low",
    "ratio_high",
    "target_stretch",
    "simulated_stretch",
    "residual_stretch",
    "stretch_low",
    "stretch_high",
    "version",
    "seed",
    "inputs_sha256",
    "command",
];

/// The first columns of `fits.csv`; then come tension, low and high of every muscle, then [`FIT_COLUMNS_AFTER`].
const FIT_COLUMNS_BEFORE: [&str; 10] = [
    "subject",
    "vowel",
    "baseline",
    "substitute_baseline",
    "target_kind",
    "status",
    "message",
    "active",
    "equations",
    "undetermined",
];

const FIT_COLUMNS_AFTER: [&str; 26] = [
    "cost",
    "misfit",
    "passive_rms_stretch",
    "no_change_rms_stretch",
    "thesis_rms_stretch",
    "passive_rms_ratio",
    "no_change_rms_ratio",
    "thesis_rms_ratio",
    "rest_to_baseline_rms_ratio",
    "smallest_singular_value_per_n",
    "draws",
    "draws_failed",
    "draws_not_met",
    "other_optima",
    "other_subsets_within_rounding",
    "best_other_subset",
    "pattern_found",
    "pattern_missing",
    "pattern_unexpected",
    "alarms",
    "evaluations",
    "line",
    "version",
    "seed",
    "inputs_sha256",
    "command",
];

/// The header of `fits.csv`.
pub fn fit_columns() -> Vec<String> {
    let tensions = Muscle::ALL
        .into_iter()
        .flat_map(|m| ["", "_low", "_high"].map(|what| format!("tension_{m}{what}_n_per_m")));
    let before = FIT_COLUMNS_BEFORE.into_iter().map(str::to_owned);
    before.chain(tensions).chain(FIT_COLUMNS_AFTER.into_iter().map(str::to_owned)).collect()
}

/// Lines of `muscles.csv` for one fit.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn muscle_lines(r: &AssessedRecord, p: &Provenance) -> csv::Result<String> {
    let f = &r.fit;
    let gga_mm = f.lengths_mm.0[Muscle::GGa.index()];
    let mut lines = Lines::new();
    for m in Muscle::ALL {
        let i = m.index();
        let active = f.active.contains(&m);
        let target_mm = match f.target_kind {
            crate::measured::TargetKind::Ratio => f.target_ratios.0[i] * gga_mm,
            crate::measured::TargetKind::Stretch => f.target_stretches.0[i] * f.rest_lengths_mm.0[i],
        };
        let interval =
            |of: fn(&super::record::IntervalsRecord) -> &ByMuscle<crate::inverse::uncertainty::Interval>| {
                let found = r.intervals.as_ref().map(|all| of(all).0[i]);
                [found.map(|x| x.low), found.map(|x| x.high)].map(optional)
            };
        let [tension_low, tension_high] = interval(|i| &i.tensions_n);
        let [ratio_low, ratio_high] = interval(|i| &i.ratios);
        let [stretch_low, stretch_high] = interval(|i| &i.stretches);
        lines.add([
            f.subject.clone(),
            f.vowel.to_string(),
            f.baseline.to_string(),
            r.substitute_baseline.to_string(),
            f.target_kind.to_string(),
            name(&f.status),
            m.to_string(),
            active.to_string(),
            r.fitted.contains(&m).to_string(),
            f.uncertain.contains(&m).to_string(),
            f.tensions_n.0[i].to_string(),
            tension_low,
            tension_high,
            f.baseline_lengths_mm.0[i].to_string(),
            f.measured_lengths_mm.0[i].to_string(),
            f.rest_lengths_mm.0[i].to_string(),
            target_mm.to_string(),
            f.lengths_mm.0[i].to_string(),
            (f.lengths_mm.0[i] - target_mm).to_string(),
            f.target_ratios.0[i].to_string(),
            f.ratios.0[i].to_string(),
            (f.ratios.0[i] - f.target_ratios.0[i]).to_string(),
            ratio_low,
            ratio_high,
            f.target_stretches.0[i].to_string(),
            f.stretches.0[i].to_string(),
            (f.stretches.0[i] - f.target_stretches.0[i]).to_string(),
            stretch_low,
            stretch_high,
            p.version.clone(),
            p.seed.to_string(),
            p.inputs_sha256.clone(),
            p.command.clone(),
        ])?;
    }
    lines.finish()
}

/// The line of `fits.csv` for one fit.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn fit_line(r: &AssessedRecord, p: &Provenance) -> csv::Result<String> {
    let f = &r.fit;
    let mut row = vec![
        f.subject.clone(),
        f.vowel.to_string(),
        f.baseline.to_string(),
        r.substitute_baseline.to_string(),
        f.target_kind.to_string(),
        name(&f.status),
        String::new(),
        joined(&f.active),
        r.fitted.len().to_string(),
        f.identifiability.as_ref().map(|i| i.undetermined.to_string()).unwrap_or_default(),
    ];
    for i in 0..COUNT {
        let interval = r.intervals.as_ref().map(|all| all.tensions_n.0[i]);
        row.push(f.tensions_n.0[i].to_string());
        row.push(optional(interval.map(|x| x.low)));
        row.push(optional(interval.map(|x| x.high)));
    }
    let draws = |of: fn(&super::record::IntervalsRecord) -> usize| {
        r.intervals.as_ref().map(|i| of(i).to_string()).unwrap_or_default()
    };
    let smallest = r.within_rounding.as_ref().and_then(|s| s.last()).map(|s| s.singular_value);
    let best = r.other_subsets.first().map(|s| {
        let muscles: Vec<_> = s.tensions_n.0.iter().map(|(m, _)| *m).collect();
        joined(&muscles)
    });
    let alarms: Vec<&str> = r.alarms.iter().map(|a| a.message.as_str()).collect();
    row.extend([
        r.cost.to_string(),
        f.misfit.to_string(),
        optional(r.passive.rms_stretch),
        optional(r.passive.no_change_rms_stretch),
        optional(r.passive.thesis_rms_stretch),
        optional(r.passive.rms_ratio),
        optional(r.passive.no_change_rms_ratio),
        optional(r.passive.thesis_rms_ratio),
        r.rest_shape.rms_ratio.to_string(),
        optional(smallest),
        draws(|i| i.draws),
        draws(|i| i.failed),
        draws(|i| i.not_met),
        r.other_optima.len().to_string(),
        r.other_subsets_within_rounding.to_string(),
        best.unwrap_or_default(),
        joined(&r.pattern.found),
        joined(&r.pattern.missing),
        joined(&r.pattern.unexpected),
        alarms.join("; "),
        f.evaluations.to_string(),
        r.line.to_string(),
        p.version.clone(),
        p.seed.to_string(),
        p.inputs_sha256.clone(),
        p.command.clone(),
    ]);
    let mut lines = Lines::new();
    lines.add(row)?;
    lines.finish()
}

/// The line of `fits.csv` for a row that is a baseline.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn baseline_line(b: &BaselineRow, p: &Provenance) -> csv::Result<String> {
    let vowel = b.vowel.to_string();
    bare(
        [&b.subject, &vowel, &vowel, &b.substitute.to_string(), "", "baseline", "the baseline itself"],
        b.line,
        p,
    )
}

/// The line of `fits.csv` for a row that could not be fitted.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn refusal_line(r: &Refusal, p: &Provenance) -> csv::Result<String> {
    let kind = r.kind.map(|k| k.to_string()).unwrap_or_default();
    bare([&r.subject, &r.vowel.to_string(), "", "", &kind, "not_fitted", &r.message], r.line, p)
}

/// A line with nothing but its first columns and where it comes from.
fn bare(first: [&str; 7], line: u64, p: &Provenance) -> csv::Result<String> {
    let values = fit_columns().into_iter().enumerate().map(|(i, column)| match column.as_str() {
        "line" => line.to_string(),
        "version" => p.version.clone(),
        "seed" => p.seed.to_string(),
        "inputs_sha256" => p.inputs_sha256.clone(),
        "command" => p.command.clone(),
        _ => first.get(i).copied().unwrap_or_default().to_owned(),
    });
    let mut lines = Lines::new();
    lines.add(values)?;
    lines.finish()
}

/// The name that serde gives a unit variant.
pub(super) fn name(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

fn joined(parts: &[impl serde::Serialize]) -> String {
    parts.iter().map(name).collect::<Vec<_>>().join("+")
}

fn optional(value: Option<f64>) -> String {
    value.map(|v| v.to_string()).unwrap_or_default()
}

/// CSV lines without a header.
struct Lines(csv::Writer<Vec<u8>>);

impl Lines {
    fn new() -> Self {
        Self(csv::Writer::from_writer(Vec::new()))
    }

    fn add(&mut self, fields: impl IntoIterator<Item = String>) -> csv::Result<()> {
        self.0.write_record(fields)
    }

    fn finish(self) -> csv::Result<String> {
        let bytes = self.0.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
        String::from_utf8(bytes).map_err(|e| std::io::Error::other(e).into())
    }
}

/// A header line.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn header(columns: &[impl AsRef<str>]) -> csv::Result<String> {
    let mut lines = Lines::new();
    lines.add(columns.iter().map(|c| c.as_ref().to_owned()))?;
    lines.finish()
}
