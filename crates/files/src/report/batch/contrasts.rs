//! Differences of tensions between the vowels of a subject, as rows of `contrasts.csv` and as the picture `contrasts.svg`.

use std::io::{self, Write};

use serde::Serialize;

use super::{Batch, BatchJournal};
use crate::report::Export;
use crate::report::svg;
use tongue_infer::inverse::batch::Job;
use tongue_infer::posterior::Contrast;

/// A contrast with the subject.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubjectContrast {
    /// The subject.
    pub subject: String,
    /// The baseline of the vowels.
    pub baseline: String,
    /// The contrast.
    #[serde(flatten)]
    pub contrast: Contrast,
}

/// The contrasts of all subjects, in the order of rows.
///
/// # Errors
/// As the journal.
pub fn all(jobs: &[Job], journal: &BatchJournal) -> io::Result<Vec<SubjectContrast>> {
    let mut out = Vec::new();
    for (number, job) in jobs.iter().enumerate() {
        let entry = journal.read(number).map_err(io::Error::other)?;
        let fit = entry.and_then(|entry| entry.result.ok());
        out.extend(fit.into_iter().flat_map(|fit| fit.contrasts).map(|contrast| SubjectContrast {
            subject: job.target.subject.clone(),
            baseline: job.target.baseline.to_string(),
            contrast,
        }));
    }
    Ok(out)
}

#[derive(Serialize)]
struct Row<'a> {
    subject: &'a str,
    baseline: &'a str,
    vowel: &'a str,
    other_vowel: &'a str,
    muscle: &'a str,
    difference_median_n_per_m: f64,
    difference_low_95_n_per_m: f64,
    difference_high_95_n_per_m: f64,
    probability_more: f64,
    decided: bool,
    depends_on_prior: bool,
    sign_depends_on_prior: bool,
    version: &'a str,
    command: &'a str,
}

/// Writes `contrasts.csv`.
pub fn write_csv(w: &mut dyn Write, batch: &Batch<'_>) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(w);
    for SubjectContrast { subject, baseline, contrast: c } in batch.contrasts {
        writer.serialize(Row {
            subject,
            baseline,
            vowel: &c.posture,
            other_vowel: &c.other,
            muscle: &c.muscle,
            difference_median_n_per_m: c.median,
            difference_low_95_n_per_m: c.interval_95[0],
            difference_high_95_n_per_m: c.interval_95[1],
            probability_more: c.probability_more,
            decided: c.is_decided(),
            depends_on_prior: c.depends_on_prior,
            sign_depends_on_prior: c.sign_depends_on_prior,
            version: &batch.provenance.version,
            command: &batch.provenance.command,
        })?;
    }
    writer.flush()
}

/// Subjects in their order, each with its contrasts.
pub fn by_subject(all: &[SubjectContrast]) -> Vec<(&str, Vec<Contrast>)> {
    let mut subjects: Vec<(&str, Vec<Contrast>)> = Vec::new();
    for c in all {
        match subjects.iter_mut().find(|(name, _)| *name == c.subject) {
            Some((_, own)) => own.push(c.contrast.clone()),
            None => subjects.push((&c.subject, vec![c.contrast.clone()])),
        }
    }
    subjects
}

/// Writes `contrasts.svg`.
pub fn write_picture(w: &mut dyn Write, batch: &Batch<'_>) -> io::Result<()> {
    let by = crate::report::Provenance::new(&batch.provenance.command);
    svg::contrasts(&by_subject(batch.contrasts), "Differences of tensions between vowels")
        .write(w, &by.with_inputs(&batch.provenance.inputs_sha256))
}
