//! The JSON record of one fit of a batch.

use serde::Serialize;

use crate::report::{FitRecord, Provenance};
use tongue_infer::inverse::Fit;
use tongue_infer::inverse::alternatives::Optimum;
use tongue_infer::inverse::batch::{Assessment, Job};
use tongue_infer::posterior::Verdict;
use tongue_input::measured::TargetKind;
use tongue_input::measured::lengths::rest_distance::RestDistance;
use tongue_input::measured::published_patterns::PatternCheck;
use tongue_input::measured::thesis::Thesis;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AssessedRecord {
    #[serde(flatten)]
    pub record: FitRecord,
    pub line: u64,
    pub substitute_baseline: bool,
    pub fitted: Vec<String>,
    pub cost: f64,
    /// Errors of the muscles that the fit does not see, with two references.
    pub passive: Passive,
    pub rest_shape: Option<RestDistance>,
    pub other_optima: Vec<Optimum>,
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

impl AssessedRecord {
    /// The record of a finished job of the batch of `command`; `thesis` is for comparison.
    pub fn new(job: &Job, a: Assessment, thesis: Option<&Thesis>, command: &str) -> Self {
        let Assessment { fit, alarms, optima, pattern, rest } = a;
        let target = &fit.target;
        Self {
            line: job.line,
            substitute_baseline: job.substitute,
            fitted: target.fitted.iter().map(|&m| target.muscles[m].clone()).collect(),
            cost: fit.starts.iter().map(|s| s.cost).fold(f64::INFINITY, f64::min),
            passive: passive(&fit, thesis),
            rest_shape: rest,
            other_optima: optima,
            pattern,
            record: FitRecord::new(fit, alarms, &Provenance::new(command)),
        }
    }

    pub fn fit(&self) -> &Fit {
        &self.record.fit
    }

    /// `S2 /a/`, with a mark where the baseline replaces a missing /ɯ/.
    pub fn row(&self) -> String {
        let target = &self.fit().target;
        format!("{}{} /{}/", target.subject, self.mark(), target.vowel)
    }

    /// The same with the kind of target: `S2 /a/ ratio`.
    pub fn label(&self) -> String {
        format!("{} {}", self.row(), self.fit().target.kind)
    }

    /// What the program says first of a row with a posterior.
    pub fn verdict(&self) -> Option<String> {
        let verdict = Verdict { hyoid_mm: None, ..self.record.verdict.clone()? };
        Some(verdict.sentences(self.fit().target.baseline.label()).join(" "))
    }

    pub fn mark(&self) -> &'static str {
        if self.substitute_baseline { "†" } else { "" }
    }
}

/// Errors of the passive muscles and their references; `thesis` is used if it simulated this row.
fn passive(fit: &Fit, thesis: Option<&Thesis>) -> Passive {
    let target = &fit.target;
    let (stretch, ratio) = (TargetKind::Stretch, TargetKind::Ratio);
    let (measured, reference) = (target.muscles.len(), target.reference);
    let rms = |kind: TargetKind, simulated: &[f64], wanted: &[f64]| {
        let unseen = |m: &usize| !target.active.contains(m) && kind.constrains(*m, reference);
        let squares: Vec<f64> =
            (0..measured).filter(unseen).map(|m| (simulated[m] - wanted[m]).powi(2)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let simulated = |kind: TargetKind| fit.simulated_in(kind);
    let no_change = |kind: TargetKind| kind.values(&target.baseline_mm, &target.baseline_mm, reference);
    let error = |kind: TargetKind, values: &[f64]| rms(kind, values, &target.measured_in(kind));
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
