//! Differences of tensions between the vowels of a subject: the rows of `contrasts.csv`.

use std::io::{self, Write};

use serde::Serialize;

use super::{Batch, BatchJournal, Digest, digests};
use tongue_infer::inverse::batch::Job;
use tongue_infer::posterior::Contrast;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubjectContrast {
    pub subject: String,
    pub baseline: String,
    #[serde(flatten)]
    pub contrast: Contrast,
}

pub fn all(jobs: &[Job], journal: &BatchJournal) -> Vec<SubjectContrast> {
    let of_fit = |(number, digest): (usize, &Digest)| {
        let target = &jobs[number].target;
        let with_subject = |contrast: &Contrast| SubjectContrast {
            subject: target.subject.clone(),
            baseline: target.baseline.to_string(),
            contrast: contrast.clone(),
        };
        digest.contrasts.iter().map(with_subject).collect::<Vec<_>>()
    };
    digests(journal).flat_map(of_fit).collect()
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
