//! The JSON record of one fit of a batch.

use serde::Serialize;

use crate::report::ByMuscle;
use crate::report::Provenance;
use crate::report::record::FitRecord;
use tongue_infer::inverse::alternatives::Optimum;
use tongue_infer::inverse::batch::{Assessment, Job};
use tongue_infer::posterior::Verdict;
use tongue_input::measured::TargetKind;
use tongue_input::measured::lengths::rest_distance::RestDistance;
use tongue_input::measured::published_patterns::PatternCheck;
use tongue_input::measured::thesis::Thesis;

/// One fit of a batch: the record of the fit, and its reliability.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssessedRecord {
    #[serde(flatten)]
    pub fit: FitRecord,
    pub line: u64,
    pub substitute_baseline: bool,
    pub fitted: Vec<String>,
    pub cost: f64,
    /// Errors of the muscles that the fit does not see, with two references.
    pub passive: Passive,
    pub rest_shape: Option<RestDistance>,
    pub other_optima: Vec<OptimumRecord>,
    pub pattern: Option<PatternCheck>,
}

/// Root mean square residuals of the passive muscles; null if there is no such number. Ratios are without
/// GGa, whose ratio is 1 by definition.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Passive {
    pub rms_stretch: Option<f64>,
    pub no_change_rms_stretch: Option<f64>,
    /// Stretches of the thesis's own simulation (table 4.8 over table 4.5), with the stretch of GGa of this
    /// fit.
    pub thesis_rms_stretch: Option<f64>,
    pub rms_ratio: Option<f64>,
    pub no_change_rms_ratio: Option<f64>,
    /// Ratios of the thesis's own simulation (table 4.8).
    pub thesis_rms_ratio: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OptimumRecord {
    pub tensions_n: ByMuscle<f64>,
    pub cost: f64,
    pub starts: usize,
}

impl AssessedRecord {
    /// The record of a finished job of the batch of `command`; `thesis` is for comparison.
    pub fn new<const D: usize>(job: &Job, a: &Assessment<D>, thesis: Option<&Thesis>, command: &str) -> Self {
        let fit = FitRecord::new(&a.fit, &a.alarms, Provenance::new(command));
        let names = &a.fit.muscles;
        let named = |values: &[f64]| ByMuscle::new(&fit.active, values.iter().copied());
        let optimum =
            |o: &Optimum| OptimumRecord { tensions_n: named(&o.tensions), cost: o.cost, starts: o.starts };
        Self {
            line: job.line,
            substitute_baseline: job.substitute,
            fitted: a.fit.target.fitted.iter().map(|&m| names[m].clone()).collect(),
            cost: a.fit.starts.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min),
            passive: passive(a, thesis),
            rest_shape: a.rest,
            other_optima: a.optima.iter().map(optimum).collect(),
            pattern: a.pattern.clone(),
            fit,
        }
    }
}

impl AssessedRecord {
    /// `S2 /a/`, with a mark where the baseline replaces a missing /ɯ/.
    fn row(&self) -> String {
        let FitRecord { subject, vowel, .. } = &self.fit;
        format!("{subject}{} /{vowel}/", self.mark())
    }

    /// The same with the kind of target: `S2 /a/ ratio`.
    pub fn label(&self) -> String {
        format!("{} {}", self.row(), self.fit.target_kind)
    }

    /// What the program says first of a row with a posterior.
    pub fn verdict(&self) -> Option<String> {
        let verdict = Verdict { hyoid_mm: None, ..self.fit.verdict.clone()? };
        Some(verdict.sentences(self.fit.baseline.label()).join(" "))
    }

    /// The same with the name of the row before it.
    pub fn verdict_of_row(&self) -> Option<String> {
        self.verdict().map(|said| format!("{}: {said}", self.row()))
    }

    pub fn mark(&self) -> &'static str {
        if self.substitute_baseline { "†" } else { "" }
    }
}

/// Errors of the passive muscles and their references; `thesis` is used if it simulated this row.
fn passive<const D: usize>(a: &Assessment<D>, thesis: Option<&Thesis>) -> Passive {
    let (fit, target) = (&a.fit, &a.fit.target);
    let (stretch, ratio) = (TargetKind::Stretch, TargetKind::Ratio);
    let (measured, reference) = (target.muscles.len(), target.reference);
    let (lengths, rest) = (&fit.lengths[..measured], &fit.rest_lengths[..measured]);
    let rms = |kind: TargetKind, simulated: &[f64], wanted: &[f64]| {
        let unseen = |m: &usize| !target.active.contains(m) && kind.constrains(*m, reference);
        let squares: Vec<f64> =
            (0..measured).filter(unseen).map(|m| (simulated[m] - wanted[m]).powi(2)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let wanted = |kind: TargetKind| kind.values(&target.measured_mm, &target.baseline_mm, reference);
    let simulated = |kind: TargetKind| kind.values(lengths, rest, reference);
    let no_change = |kind: TargetKind| kind.values(&target.baseline_mm, &target.baseline_mm, reference);
    let error = |kind: TargetKind, values: &[f64]| rms(kind, values, &wanted(kind));
    let thesis = thesis.filter(|t| t.simulated(target));
    let thesis_stretches = thesis.and_then(|t| t.stretches_a(&target.muscles, simulated(stretch)[reference]));
    let thesis_ratios = thesis.and_then(|t| t.ratios_a(&target.muscles));
    Passive {
        rms_stretch: error(stretch, &simulated(stretch)),
        no_change_rms_stretch: error(stretch, &no_change(stretch)),
        thesis_rms_stretch: thesis_stretches.and_then(|values| error(stretch, &values)),
        rms_ratio: error(ratio, &simulated(ratio)),
        no_change_rms_ratio: error(ratio, &no_change(ratio)),
        thesis_rms_ratio: thesis_ratios.and_then(|values| error(ratio, &values)),
    }
}
