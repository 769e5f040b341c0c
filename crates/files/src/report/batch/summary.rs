//! Summary of a batch, and differences of tensions between the vowels of a subject, which are the rows of `contrasts.csv`.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::Batch;
use super::record::AssessedRecord;
use super::tables::provenance;
use crate::report::column::{Column, NamedColumn};
use crate::report::{column, csv, status_name};
use tongue_core::statistics::distinct;
use tongue_infer::inverse::FitStatus;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::batch::Job;
use tongue_infer::posterior::{Contrast, OverSpeakers};
use tongue_input::measured::lengths::rest_distance::NearestRow;
use tongue_input::measured::{TargetKind, Vowel};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Digest {
    /// The status of the fit, or `doubted` if it converged and an alarm forbids trust.
    pub status: String,
    /// Mean square residual of the passive stretches, and mean square of their changes, which is the error of "no change".
    pub passive: Option<[f64; 2]>,
    pub passive_muscles: usize,
    /// Whether the passive muscles decided which tensions were taken of those that the target leaves undetermined.
    pub seen_in_part: bool,
    pub has_posterior: bool,
    /// Whether a posterior was asked for and cannot be reported.
    pub posterior_untold: bool,
    /// Whether the posterior contradicts the measured stretches.
    pub contradicted: bool,
    pub contrasts: Vec<Contrast>,
}

impl Digest {
    pub fn new(r: &AssessedRecord, contrasts: Vec<Contrast>) -> Self {
        let (fit, target, alarms) = (r.fit(), r.target(), &r.record.alarms);
        let is_doubted = fit.answer.status == FitStatus::Converged && !fit.answer.is_trustworthy();
        Self {
            status: if is_doubted { "doubted".to_owned() } else { status_name(&fit.answer.status) },
            passive: r.passive.rms_stretch.zip(r.passive.no_change_rms_stretch).map(|(a, b)| [a * a, b * b]),
            passive_muscles: fit.residuals().len() - target.active.len(),
            seen_in_part: fit.answer.undetermined().is_some_and(|open| open > 0),
            has_posterior: r.record.posterior.is_some(),
            posterior_untold: alarms.iter().any(|alarm| matches!(alarm, Alarm::NoPosterior { .. })),
            contradicted: alarms.iter().any(Alarm::is_contradiction),
            contrasts,
        }
    }
}

/// Root mean square errors of the passive stretches of a group of fits, and of "no change".
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PassiveGroup {
    pub target_kind: TargetKind,
    pub vowel: Option<Vowel>,
    pub substitute_baseline: bool,
    pub fits: usize,
    /// Over the fits, each of the same weight.
    pub rms_stretch: f64,
    /// Of "no change", over the fits.
    pub no_change_rms_stretch: f64,
    /// Over all passive muscles, each of the same weight.
    pub rms_stretch_over_muscles: f64,
    /// Of "no change", over all passive muscles.
    pub no_change_rms_stretch_over_muscles: f64,
    pub worse_than_no_change: bool,
    /// Number of fits for which the passive muscles decided between tensions; if there are any, the errors are not errors of prediction.
    pub seen_in_part: usize,
}

impl PassiveGroup {
    pub fn columns<'a>() -> Vec<Column<'a, Self>> {
        type RowColumn<'a> = Column<'a, PassiveGroup>;
        vec![
            RowColumn::of_page("target", |g| {
                format!("{}{}", g.target_kind, if g.substitute_baseline { "†" } else { "" }).into()
            }),
            RowColumn::of_page("vowel", |g| {
                g.vowel.as_ref().map_or("all".to_owned(), |v| format!("/{v}/")).into()
            }),
            RowColumn::of_page("fits", |g| g.fits.into()),
            RowColumn::of_page("model", |g| g.rms_stretch.into()).decimals(3),
            RowColumn::of_page("no change", |g| g.no_change_rms_stretch.into()).decimals(3),
            RowColumn::of_page("verdict", |g| g.verdict().into()),
        ]
    }

    fn verdict(&self) -> String {
        match (self.seen_in_part, self.worse_than_no_change) {
            (0, false) => "better".to_owned(),
            (0, true) => "worse than no change".to_owned(),
            (seen, _) => format!("no test: {seen} of {} saw them in part", self.fits),
        }
    }
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_none(count: &usize) -> bool {
    *count == 0
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BatchSummary {
    pub rows: usize,
    pub fits: usize,
    pub statuses: BTreeMap<String, usize>,
    pub baselines: usize,
    pub not_fitted: usize,
    pub unreadable_rows: usize,
    /// Number of posteriors that were asked for and cannot be reported; the alarms of their fits say why.
    #[serde(skip_serializing_if = "is_none")]
    pub posteriors_untold: usize,
    #[serde(skip_serializing_if = "is_none")]
    pub posteriors_contradicted: usize,
    pub substitute_baselines: Vec<String>,
    pub rest_shape_measure: String,
    pub nearest_row_to_rest: Option<NearestRow>,
    pub passive: Vec<PassiveGroup>,
    pub thickness_m: f64,
}

/// Groups the digests by kind of target and by own or substitute baseline: every vowel, and then all vowels together.
pub fn passive_groups(jobs: &[Job], digests: &[(usize, Digest)]) -> Vec<PassiveGroup> {
    let fits: Vec<(&Job, &Digest)> =
        digests.iter().map(|(number, digest)| (&jobs[*number], digest)).collect();
    let mut out = Vec::new();
    // Vowels are in the order of the rows.
    let vowels: Vec<&Vowel> = distinct(fits.iter().map(|(job, _)| &job.target.vowel));
    for kind in TargetKind::ALL {
        for substitute in [false, true] {
            for vowel in vowels.iter().copied().map(Some).chain([None]) {
                let members = fits.iter().filter(|(Job { target, substitute: own, .. }, _)| {
                    target.kind == kind && *own == substitute && vowel.is_none_or(|v| *v == target.vowel)
                });
                out.extend(group(kind, vowel, substitute, members.map(|(_, digest)| *digest)));
            }
        }
    }
    out
}

fn group<'a>(
    target_kind: TargetKind,
    vowel: Option<&Vowel>,
    substitute_baseline: bool,
    members: impl Iterator<Item = &'a Digest>,
) -> Option<PassiveGroup> {
    let known: Vec<([f64; 2], &Digest)> = members.filter_map(|d| Some((d.passive?, d))).collect();
    let [model, no_change] = [0, 1].map(|which| known.iter().map(|(errors, _)| errors[which]).sum::<f64>());
    let [rms_stretch_over_muscles, no_change_rms_stretch_over_muscles] = [0, 1].map(|which| {
        let errors = known.iter().map(|(errors, d)| errors[which] * (d.passive_muscles as f64)).sum::<f64>();
        (errors / known.iter().map(|(_, d)| d.passive_muscles as f64).sum::<f64>()).sqrt()
    });
    let fits = known.len();
    (fits > 0).then(|| PassiveGroup {
        target_kind,
        vowel: vowel.cloned(),
        substitute_baseline,
        fits,
        rms_stretch: (model / fits as f64).sqrt(),
        no_change_rms_stretch: (no_change / fits as f64).sqrt(),
        rms_stretch_over_muscles,
        no_change_rms_stretch_over_muscles,
        worse_than_no_change: model > no_change,
        seen_in_part: known.iter().filter(|(_, d)| d.seen_in_part).count(),
    })
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubjectContrast {
    pub subject: String,
    pub baseline: String,
    #[serde(flatten)]
    pub contrast: Contrast,
}

pub fn subject_contrasts(jobs: &[Job], digests: &[(usize, Digest)]) -> Vec<SubjectContrast> {
    Vec::from_iter(digests.iter().flat_map(|(number, digest)| {
        let target = &jobs[*number].target;
        Vec::from_iter(digest.contrasts.iter().map(|contrast| SubjectContrast {
            subject: target.subject.clone(),
            baseline: target.baseline.to_string(),
            contrast: contrast.clone(),
        }))
    }))
}

/// The differences over all subjects; a tier has the vowels against one baseline.
pub fn over_subjects(all: &[SubjectContrast]) -> Vec<OverSpeakers> {
    let tiers: Vec<String> = all.iter().map(|c| format!("vowel against /{}/", c.baseline)).collect();
    OverSpeakers::all(tiers.iter().map(String::as_str).zip(all.iter().map(|c| &c.contrast)))
}

/// The columns of `contrasts.csv`, but for the provenance.
pub(super) const CONTRASTS: [NamedColumn<SubjectContrast>; 12] = [
    ("subject", "", "subject", |c| json!(c.subject)),
    ("baseline", "", "vowel with which both are compared", |c| json!(c.baseline)),
    ("vowel", "", "vowel", |c| json!(c.contrast.a)),
    ("other_vowel", "", "another vowel of the subject", |c| json!(c.contrast.b)),
    ("muscle", "", "muscle", |c| json!(c.contrast.muscle)),
    ("difference_median_n_per_m", "N/m", "tension less that in the other vowel", |c| {
        c.contrast.median.into()
    }),
    ("difference_low_95_n_per_m", "N/m", "lower end of its 95 % interval", |c| {
        c.contrast.interval_95[0].into()
    }),
    ("difference_high_95_n_per_m", "N/m", "upper end", |c| c.contrast.interval_95[1].into()),
    ("probability_more", "", "probability that it is above 0", |c| c.contrast.probability_more.into()),
    ("decided", "", "whether that is at least 0.95 or at most 0.05", |c| c.contrast.is_decided().into()),
    ("depends_on_prior", "", "whether its size is mostly of the prior", |c| {
        json!(c.contrast.depends_on_prior)
    }),
    ("sign_depends_on_prior", "", "whether its sign is as well", |c| json!(c.contrast.sign_depends_on_prior)),
];

pub fn write_csv(w: &mut dyn Write, batch: &Batch<'_>) -> io::Result<()> {
    let mut columns = column::columns(CONTRASTS);
    let [version, _, command] = provenance(batch.provenance);
    columns.extend([version, command]);
    let table = column::table(&columns, batch.contrasts);
    csv::lines(w, std::iter::once(table.columns).chain(table.rows))
}
