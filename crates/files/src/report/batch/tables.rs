//! The tables of a batch: `muscles.csv` with a row for each muscle of each fit, and `fits.csv` with a row for
//! each fit, baseline and row that could not be fitted.

use serde::Serialize;

use super::BatchProvenance;
use super::record::{AssessedRecord, IntervalsRecord};
use crate::report::ByMuscle;
use crate::report::cells::{self, AsText};
use tongue_infer::inverse::Tone;
use tongue_infer::inverse::batch::{BaselineRow, Refusal};
use tongue_infer::inverse::uncertainty::Interval;
use tongue_input::measured::published_patterns::PatternCheck;
use tongue_input::measured::{TargetKind, Vowel};

/// A row of `muscles.csv`. Lengths in mm: measured ones are the subject's; target, simulated and residual
/// lengths have the size of the model. Ratios are to the reference muscle, stretches to the baseline
/// (measured, or the model's with its tone). Missing measurements are empty.
#[derive(Serialize)]
struct MuscleRow<'a> {
    subject: &'a str,
    vowel: &'a Vowel,
    baseline: &'a Vowel,
    substitute_baseline: bool,
    target_kind: TargetKind,
    status: tongue_infer::inverse::Status,
    muscle: &'a str,
    active: bool,
    fitted: bool,
    uncertain: bool,
    tension_n_per_m: f64,
    tension_low_n_per_m: Option<f64>,
    tension_high_n_per_m: Option<f64>,
    tone_n_per_m: f64,
    baseline_length_mm: Option<f64>,
    measured_length_mm: Option<f64>,
    rest_length_mm: f64,
    model_baseline_length_mm: f64,
    target_length_mm: Option<f64>,
    simulated_length_mm: f64,
    residual_mm: Option<f64>,
    target_ratio: Option<f64>,
    simulated_ratio: f64,
    residual_ratio: Option<f64>,
    ratio_low: Option<f64>,
    ratio_high: Option<f64>,
    target_stretch: Option<f64>,
    simulated_stretch: f64,
    residual_stretch: Option<f64>,
    stretch_low: Option<f64>,
    stretch_high: Option<f64>,
    version: &'a str,
    seed: u64,
    inputs_sha256: &'a str,
    command: &'a str,
}

/// The rows of `muscles.csv` for one fit, with the header if `with_header`.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn muscle_lines(r: &AssessedRecord, p: &BatchProvenance, with_header: bool) -> csv::Result<String> {
    let f = &r.fit;
    let reference_mm = f.lengths_mm.of(&f.reference).copied().unwrap_or(f64::NAN);
    let mut writer = csv::WriterBuilder::new().has_headers(with_header).from_writer(AsText::new(Vec::new()));
    for (i, (muscle, tension)) in f.tensions_n.0.iter().enumerate() {
        let of = |values: &ByMuscle<f64>| values.of(muscle).copied();
        let (target_ratio, target_stretch) = (of(&f.target_ratios), of(&f.target_stretches));
        let (ratio, stretch) = (f.ratios.0[i].1, f.stretches.0[i].1);
        let (length, rest) = (f.lengths_mm.0[i].1, f.rest_lengths_mm.0[i].1);
        let model_baseline_length_mm = f.model_baseline_lengths_mm.0[i].1;
        let target_length_mm = match f.target_kind {
            TargetKind::Ratio => target_ratio.map(|t| t * reference_mm),
            TargetKind::Stretch => target_stretch.map(|t| t * model_baseline_length_mm),
        };
        let ends = |of: fn(&IntervalsRecord) -> &ByMuscle<Interval>| {
            let found = r.intervals.as_ref().map(|all| of(all).0[i].1);
            (found.map(|x| x.low), found.map(|x| x.high))
        };
        let tension_interval = r.intervals.as_ref().and_then(|all| all.tensions_n.0[i].1);
        let (ratio_low, ratio_high) = ends(|i| &i.ratios);
        let (stretch_low, stretch_high) = ends(|i| &i.stretches);
        writer.serialize(MuscleRow {
            subject: &f.subject,
            vowel: &f.vowel,
            baseline: &f.baseline,
            substitute_baseline: r.substitute_baseline,
            target_kind: f.target_kind,
            status: f.status,
            muscle,
            active: f.active.contains(muscle),
            fitted: r.fitted.contains(muscle),
            uncertain: f.uncertain.contains(muscle),
            tension_n_per_m: *tension,
            tension_low_n_per_m: tension_interval.map(|x| x.low),
            tension_high_n_per_m: tension_interval.map(|x| x.high),
            tone_n_per_m: f.tone_n_per_m.of(muscle),
            baseline_length_mm: of(&f.baseline_lengths_mm),
            measured_length_mm: of(&f.measured_lengths_mm),
            rest_length_mm: rest,
            model_baseline_length_mm,
            target_length_mm,
            simulated_length_mm: length,
            residual_mm: target_length_mm.map(|t| length - t),
            target_ratio,
            simulated_ratio: ratio,
            residual_ratio: target_ratio.map(|t| ratio - t),
            ratio_low,
            ratio_high,
            target_stretch,
            simulated_stretch: stretch,
            residual_stretch: target_stretch.map(|t| stretch - t),
            stretch_low,
            stretch_high,
            version: &p.version,
            seed: p.seed,
            inputs_sha256: &p.inputs_sha256,
            command: &p.command,
        })?;
    }
    finish(writer)
}

/// A muscle of a posterior.
#[derive(Serialize)]
struct PosteriorRow<'a> {
    subject: &'a str,
    vowel: &'a Vowel,
    baseline: &'a Vowel,
    muscle: &'a str,
    status: tongue_infer::posterior::Status,
    change_median_n_per_m: Option<f64>,
    change_low_50_n_per_m: Option<f64>,
    change_high_50_n_per_m: Option<f64>,
    change_low_95_n_per_m: Option<f64>,
    change_high_95_n_per_m: Option<f64>,
    probability_rises: Option<f64>,
    tension_low_95_n_per_m: Option<f64>,
    tension_high_95_n_per_m: Option<f64>,
    depends_on_prior: Option<bool>,
    shrinkage: f64,
    measured_stretch: Option<f64>,
    left_out_mean: Option<f64>,
    left_out_low_95: Option<f64>,
    left_out_high_95: Option<f64>,
    r_hat: f64,
    version: &'a str,
    command: &'a str,
}

/// The rows of `posterior.csv` for one fit with their header; empty if it has no posterior.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn posterior_lines(r: &AssessedRecord, p: &BatchProvenance) -> csv::Result<String> {
    let Some(posterior) = &r.fit.posterior else { return Ok(String::new()) };
    let summary = posterior.summary.as_ref();
    let mut writer = cells::writer(Vec::new());
    for (muscle, shrinkage) in &posterior.shrinkage.0 {
        let change = summary.and_then(|s| s.changes_n.of(muscle));
        let tension = summary.and_then(|s| s.tensions_n.of(muscle));
        let stretch = summary.and_then(|s| s.stretches.of(muscle));
        let left_out = stretch.and_then(|s| s.left_out.as_ref());
        writer.serialize(PosteriorRow {
            subject: &r.fit.subject,
            vowel: &r.fit.vowel,
            baseline: &r.fit.baseline,
            muscle,
            status: posterior.status,
            change_median_n_per_m: change.map(|c| c.spread.median),
            change_low_50_n_per_m: change.map(|c| c.spread.interval_50[0]),
            change_high_50_n_per_m: change.map(|c| c.spread.interval_50[1]),
            change_low_95_n_per_m: change.map(|c| c.spread.interval_95[0]),
            change_high_95_n_per_m: change.map(|c| c.spread.interval_95[1]),
            probability_rises: change.map(|c| c.probability_rises),
            tension_low_95_n_per_m: tension.map(|t| t.spread.interval_95[0]),
            tension_high_95_n_per_m: tension.map(|t| t.spread.interval_95[1]),
            depends_on_prior: tension.map(|t| t.depends_on_prior),
            shrinkage: *shrinkage,
            measured_stretch: stretch.map(|s| s.measured),
            left_out_mean: left_out.map(|l| l.spread.mean),
            left_out_low_95: left_out.map(|l| l.spread.interval_95[0]),
            left_out_high_95: left_out.map(|l| l.spread.interval_95[1]),
            r_hat: posterior.r_hat,
            version: &p.version,
            command: &p.command,
        })?;
    }
    finish(writer)
}

/// The columns of `fits.csv` before those of the tensions.
const BEFORE: [&str; 10] = [
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

/// The columns after them.
const AFTER: [&str; 29] = [
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
    "tone_n_per_m",
    "hyoid_x_mm",
    "hyoid_y_mm",
    "line",
    "version",
    "seed",
    "inputs_sha256",
    "command",
];

/// The columns of `fits.csv` for a body with these muscles: tension, low and high of each muscle are in the
/// middle.
fn fit_columns(muscles: &[String]) -> Vec<String> {
    let tensions =
        muscles.iter().flat_map(|m| ["", "_low", "_high"].map(|what| format!("tension_{m}{what}_n_per_m")));
    let before = BEFORE.into_iter().map(str::to_owned);
    before.chain(tensions).chain(AFTER.into_iter().map(str::to_owned)).collect()
}

/// The header of `fits.csv`.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn fit_header(muscles: &[String]) -> csv::Result<String> {
    line(fit_columns(muscles))
}

/// The line of `fits.csv` for one fit.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn fit_line(muscles: &[String], r: &AssessedRecord, p: &BatchProvenance) -> csv::Result<String> {
    let (f, i) = (&r.fit, r.intervals.as_ref());
    let before: [String; BEFORE.len()] = [
        f.subject.clone(),
        f.vowel.to_string(),
        f.baseline.to_string(),
        r.substitute_baseline.to_string(),
        f.target_kind.to_string(),
        name(&f.status),
        String::new(),
        f.active.join("+"),
        r.fitted.len().to_string(),
        optional(f.identifiability.as_ref().map(|i| i.undetermined)),
    ];
    let tensions = muscles.iter().flat_map(|m| {
        let interval = i.and_then(|all| *all.tensions_n.of(m)?);
        [f.tensions_n.of(m).copied(), interval.map(|x| x.low), interval.map(|x| x.high)]
            .map(|value| optional(value.map(shortest)))
    });
    let smallest = r.within_rounding.as_ref().and_then(|s| s.last()).map(|s| s.singular_value);
    let best = r
        .other_subsets
        .first()
        .map(|s| s.tensions_n.0.iter().map(|(m, _)| m.as_str()).collect::<Vec<_>>().join("+"));
    let group = |of: fn(&PatternCheck) -> &Vec<String>| optional(r.pattern.as_ref().map(|c| of(c).join("+")));
    let alarms: Vec<&str> = f.alarms.iter().map(|a| a.text.as_str()).collect();
    let tone = match &f.tone_n_per_m {
        Tone::Uniform(tone) => tone.to_string(),
        Tone::ByMuscle(all) => all.iter().map(|(m, t)| format!("{m} {t}")).collect::<Vec<_>>().join("; "),
    };
    let hyoid = |axis: usize| optional(f.hyoid_mm.as_ref().and_then(|mm| mm.get(axis)));
    let after: [String; AFTER.len()] = [
        shortest(r.cost),
        shortest(f.misfit),
        optional(r.passive.rms_stretch.map(shortest)),
        optional(r.passive.no_change_rms_stretch.map(shortest)),
        optional(r.passive.thesis_rms_stretch.map(shortest)),
        optional(r.passive.rms_ratio.map(shortest)),
        optional(r.passive.no_change_rms_ratio.map(shortest)),
        optional(r.passive.thesis_rms_ratio.map(shortest)),
        optional(r.rest_shape.map(|d| d.rms_ratio)),
        optional(smallest.map(shortest)),
        optional(i.map(|i| i.draws)),
        optional(i.map(|i| i.failed)),
        optional(i.map(|i| i.not_met)),
        r.other_optima.len().to_string(),
        r.other_subsets_within_rounding.to_string(),
        optional(best),
        group(|c| &c.found),
        group(|c| &c.missing),
        group(|c| &c.unexpected),
        alarms.join("; "),
        f.evaluations.to_string(),
        tone,
        hyoid(0),
        hyoid(1),
        r.line.to_string(),
        p.version.clone(),
        p.seed.to_string(),
        p.inputs_sha256.clone(),
        p.command.clone(),
    ];
    line(before.into_iter().chain(tensions).chain(after))
}

/// The line of `fits.csv` for a row that is a baseline.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn baseline_line(muscles: &[String], b: &BaselineRow, p: &BatchProvenance) -> csv::Result<String> {
    let (vowel, substitute) = (b.vowel.label(), b.substitute.to_string());
    let first = [&b.subject, vowel, vowel, &substitute, "", "baseline", "the baseline itself"];
    bare(muscles, first, b.line, p)
}

/// The line of `fits.csv` for a row that could not be fitted.
///
/// # Errors
/// As [`csv::Writer`]; none when writing to memory.
pub fn refusal_line(muscles: &[String], r: &Refusal, p: &BatchProvenance) -> csv::Result<String> {
    let kind = optional(r.kind);
    bare(muscles, [&r.subject, r.vowel.label(), "", "", &kind, "not_fitted", &r.message], r.line, p)
}

/// A line with only its first columns and the provenance.
fn bare(muscles: &[String], first: [&str; 7], number: u64, p: &BatchProvenance) -> csv::Result<String> {
    line(fit_columns(muscles).into_iter().enumerate().map(|(i, column)| match column.as_str() {
        "line" => number.to_string(),
        "version" => p.version.clone(),
        "seed" => p.seed.to_string(),
        "inputs_sha256" => p.inputs_sha256.clone(),
        "command" => p.command.clone(),
        _ => first.get(i).copied().unwrap_or_default().to_owned(),
    }))
}

fn optional(value: Option<impl ToString>) -> String {
    value.map(|v| v.to_string()).unwrap_or_default()
}

/// A number in its shortest form: with an exponent if it is very small or large.
fn shortest(value: f64) -> String {
    format!("{value:?}")
}

fn line(fields: impl IntoIterator<Item = String>) -> csv::Result<String> {
    let mut writer = cells::writer(Vec::new());
    writer.write_record(fields.into_iter().collect::<Vec<_>>())?;
    finish(writer)
}

/// The name that serde gives a unit variant.
pub(super) fn name(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}

fn finish(writer: csv::Writer<AsText<Vec<u8>>>) -> csv::Result<String> {
    let cells = writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    String::from_utf8(cells.into_inner()).map_err(|e| std::io::Error::other(e).into())
}
