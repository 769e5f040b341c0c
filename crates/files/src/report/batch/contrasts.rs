//! Differences of tensions between the vowels of a subject: the rows of `contrasts.csv`.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::json;

use super::tables::provenance;
use super::{Batch, Digest};
use crate::report::{column, csv};
use tongue_infer::inverse::batch::Job;
use tongue_infer::posterior::{Contrast, OverSpeakers};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubjectContrast {
    pub subject: String,
    pub baseline: String,
    #[serde(flatten)]
    pub contrast: Contrast,
}

pub fn all(jobs: &[Job], digests: &[(usize, Digest)]) -> Vec<SubjectContrast> {
    digests
        .iter()
        .flat_map(|(number, digest)| {
            let target = &jobs[*number].target;
            let with_subject = |contrast: &Contrast| SubjectContrast {
                subject: target.subject.clone(),
                baseline: target.baseline.to_string(),
                contrast: contrast.clone(),
            };
            digest.contrasts.iter().map(with_subject).collect::<Vec<_>>()
        })
        .collect()
}

/// The same differences over all subjects; the tier is that of vowels against one baseline.
pub fn over_subjects(all: &[SubjectContrast]) -> Vec<OverSpeakers> {
    let tiers: Vec<String> = all.iter().map(|c| format!("vowel against /{}/", c.baseline)).collect();
    OverSpeakers::all(tiers.iter().map(String::as_str).zip(all.iter().map(|c| &c.contrast)))
}

pub fn write_csv(w: &mut dyn Write, batch: &Batch<'_>) -> io::Result<()> {
    let mut columns = column::columns::<SubjectContrast, _>([
        ("subject", "", "", |c| json!(c.subject)),
        ("baseline", "", "", |c| json!(c.baseline)),
        ("vowel", "", "", |c| json!(c.contrast.a)),
        ("other_vowel", "", "", |c| json!(c.contrast.b)),
        ("muscle", "", "", |c| json!(c.contrast.muscle)),
        ("difference_median_n_per_m", "N/m", "", |c| c.contrast.median.into()),
        ("difference_low_95_n_per_m", "N/m", "", |c| c.contrast.interval_95[0].into()),
        ("difference_high_95_n_per_m", "N/m", "", |c| c.contrast.interval_95[1].into()),
        ("probability_more", "", "", |c| c.contrast.probability_more.into()),
        ("decided", "", "", |c| c.contrast.is_decided().into()),
        ("depends_on_prior", "", "", |c| json!(c.contrast.depends_on_prior)),
        ("sign_depends_on_prior", "", "", |c| json!(c.contrast.sign_depends_on_prior)),
    ]);
    let [version, _, command] = provenance(batch.provenance);
    columns.extend([version, command]);
    let table = column::table(&columns, batch.contrasts);
    csv::lines(w, std::iter::once(table.columns).chain(table.rows))
}
