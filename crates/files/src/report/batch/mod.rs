//! Outputs of a batch: tables, one JSON document, one page and one figure, assembled from the parts that each fit wrote into the journal.

pub mod journal;
pub mod page;
pub mod record;
pub mod summary;
mod tables;

use std::io::{self, Write};

use serde::ser::{Error as _, SerializeSeq as _};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use tongue_core::body::Mesh;
use tongue_infer::inverse::batch::{BaselineRow, Job, Refusal};

use self::journal::{Journal, JournalEntry};
use self::record::AssessedRecord;
use super::csv::lines;
use super::{Export, OutputDir, Provenance, ReportError, Table};

pub use self::page::MOST_FITS as MOST_FITS_ON_PAGE;
pub use self::summary::{
    BatchSummary, Digest, PassiveGroup, SubjectContrast, over_subjects, passive_groups, subject_contrasts,
};
pub use record::Shard;

#[derive(Debug, Serialize)]
pub struct Batch<'a> {
    #[serde(flatten)]
    pub provenance: &'a Provenance,
    pub summary: &'a BatchSummary,
    pub fits: FinishedFits<'a>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub contrasts: &'a [SubjectContrast],
    pub baselines: &'a [BaselineRow],
    /// Rows that could not be fitted, and jobs that could not begin.
    #[serde(rename = "not_fitted")]
    pub refusals: &'a [Refusal],
    #[serde(rename = "unreadable_rows")]
    pub unreadable: &'a [String],
    #[serde(skip)]
    pub jobs: &'a [Job],
    #[serde(skip)]
    pub mesh: &'a Mesh<2>,
    /// Names of the mesh's muscles, in the order of columns.
    #[serde(skip)]
    pub muscles: &'a [String],
}

/// The finished jobs. Each is read from the journal when it is written; only its digest stays in memory.
#[derive(Debug)]
pub struct FinishedFits<'a> {
    pub journal: &'a Journal,
    pub digests: &'a [(usize, Digest)],
    /// Whether JSON has their durations, which differ from run to run.
    pub with_times: bool,
}

impl FinishedFits<'_> {
    /// The duration of a finished fit, s, and its parts of the outputs; `None` if it could not begin.
    pub fn read(&self, number: usize) -> Result<Option<(f64, Fitted)>, ReportError> {
        let entry: Option<JournalEntry<Fitted>> = self.journal.read(number)?;
        Ok(entry.and_then(|entry| Some((entry.wall_s, entry.result.ok()?))))
    }
}

impl Serialize for FinishedFits<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = serializer.serialize_seq(None)?;
        for (number, _) in self.digests {
            let Some((wall_s, fit)) = self.read(*number).map_err(S::Error::custom)? else { continue };
            all.serialize_element(&match fit.record {
                Value::Object(fields) if self.with_times => {
                    std::iter::once(("wall_s".to_owned(), wall_s.into())).chain(fields).collect()
                }
                record => record,
            })?;
        }
        all.end()
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    pub digest: Digest,
    pub record: Value,
    /// Rows in `fits.csv`, `muscles.csv` and `posterior.csv`.
    pub tables: [Table; 3],
    /// Label, tensions, those of the posterior if there is one, misfit, error of the passive stretches and number of alarms, as printed.
    pub line: [String; 6],
    pub verdict: Option<String>,
    /// The part on the page, which shows the first fits only.
    pub shown: Option<page::PageFit>,
}

type Digests = Vec<(usize, Digest)>;

pub fn digests(jobs: &[Job], journal: &Journal) -> Result<(Digests, Vec<Refusal>), ReportError> {
    #[derive(Deserialize)]
    struct Digested {
        digest: Digest,
    }
    let (mut digests, mut refusals) = (Vec::new(), Vec::new());
    for (number, job) in jobs.iter().enumerate() {
        match journal.read::<Digested>(number)?.map(|entry| entry.result) {
            Some(Ok(fit)) => digests.push((number, fit.digest)),
            Some(Err(message)) => refusals.push(Refusal {
                line: job.line,
                subject: job.target.subject.clone(),
                vowel: job.target.vowel.clone(),
                kind: Some(job.target.kind),
                message,
            }),
            None => {}
        }
    }
    Ok((digests, refusals))
}

/// SHA-256 of a sequence of texts and their lengths, in hexadecimal.
pub fn sha256(texts: &[&str]) -> String {
    use sha2::Digest as _;
    let mut hash = sha2::Sha256::new();
    for text in texts {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text.as_bytes());
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

#[derive(Debug, Clone)]
pub struct RowPosterior {
    pub report: tongue_infer::posterior::Report,
    /// Differences of tensions between earlier rows of the subject and this one.
    pub contrasts: Vec<tongue_infer::posterior::Contrast>,
    /// A figure of the changes of all tensions (SVG); `None` if the chains have not mixed or the page does not show the fit.
    pub ridges: Option<String>,
}

/// The parts of all outputs of a finished fit, with the posterior of its row. `on_page` is its number if it may be on the page.
pub fn fit_outputs(
    on_page: Option<usize>,
    record: &AssessedRecord,
    (mesh, muscles): (&Mesh<2>, &[String]),
    posterior: Option<&RowPosterior>,
    provenance: &Provenance,
) -> Result<Fitted, ReportError> {
    let ridges = posterior.and_then(|p| p.ridges.as_deref());
    let shown = on_page.filter(|number| *number < page::MOST_FITS);
    let shown = shown.map(|number| page::PageFit::new(number, record, (mesh, muscles), ridges));
    Ok(Fitted {
        digest: Digest::new(record, posterior.map(|p| p.contrasts.clone()).unwrap_or_default()),
        tables: tables::of_fit(record, muscles, provenance),
        line: line(record),
        verdict: record.verdict().map(|verdict| format!("{}: {verdict}", record.row())),
        shown: shown.transpose()?,
        record: serde_json::to_value(record).map_err(|e| ReportError::Record { reason: e.to_string() })?,
    })
}

fn line(r: &AssessedRecord) -> [String; 6] {
    let names = r.fit().active_names();
    let summary = r.record.posterior.as_ref().and_then(|p| p.summary.as_ref());
    let tensions = names.iter().map(|m| format!("{m} {:.1}", r.fit().tension(m).unwrap_or(f64::NAN)));
    let drawn = names.iter().filter_map(|m| summary?.tensions_n.get(m)).map(|t| {
        let (median, [low, high]) = (t.spread.median, t.spread.interval_95);
        let ends = if t.spread.is_fixed() { "fixed".to_owned() } else { format!("{low:.0}–{high:.0}") };
        format!("{median:.0} ({ends})")
    });
    // Two muscles on each line keep the table within 100 columns.
    let pairs = |all: Vec<String>| all.chunks(2).map(|pair| pair.join(", ")).collect::<Vec<_>>().join("\n");
    [
        r.label(),
        pairs(tensions.collect()),
        pairs(drawn.collect()),
        format!("{:.0e}", r.fit().answer.misfit),
        r.passive.rms_stretch.map(|x| format!("{x:.3}")).unwrap_or_default(),
        r.record.alarms.len().to_string(),
    ]
}

/// Writes all files of a finished batch, or none, and returns their paths.
pub fn write_files(out: &OutputDir, batch: &Batch<'_>) -> Result<Vec<std::path::PathBuf>, ReportError> {
    let mut shown = Vec::new();
    for number in 0..batch.jobs.len().min(page::MOST_FITS) {
        shown.extend(batch.fits.read(number)?.and_then(|(_, fit)| fit.shown));
    }
    let has_posterior = batch.fits.digests.iter().any(|(_, digest)| digest.has_posterior);
    let over_subjects = over_subjects(batch.contrasts);
    let files: [(&str, &dyn Export); 8] = [
        ("batch.json", &|w: &mut dyn Write, _: &Provenance| write_json(w, batch)),
        ("fits.csv", &table_of_fits(batch, 0)),
        ("muscles.csv", &table_of_fits(batch, 1)),
        ("batch.html", &|w: &mut dyn Write, _: &Provenance| page::write(w, batch, &shown)),
        ("tensions.svg", &page::tensions(batch.muscles, &shown)),
        ("posterior.csv", &table_of_fits(batch, 2)),
        ("contrasts.csv", &|w: &mut dyn Write, _: &Provenance| summary::write_csv(w, batch)),
        ("over_speakers.csv", &super::over_speakers(&over_subjects)),
    ];
    let is_there = [has_posterior, !batch.contrasts.is_empty(), !over_subjects.is_empty()];
    let count = 5 + is_there.iter().take_while(|there| **there).count();
    out.export(&files[..count], batch.provenance)
}

pub fn write_json(w: &mut dyn Write, batch: &Batch<'_>) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *w, batch)?;
    writeln!(w)
}

/// One of the tables of all fits, which is made while it is written.
fn table_of_fits<'b>(batch: &'b Batch<'b>, which: usize) -> impl Export + 'b {
    move |w: &mut dyn Write, _: &Provenance| {
        let without_fit = (which == 0).then(|| Ok(tables::of_rows_without_fit(batch)));
        let fits = batch.fits.digests.iter().filter_map(|(number, _)| batch.fits.read(*number).transpose());
        let tables = fits.map(|fit| fit.map(|(_, mut fit)| std::mem::take(&mut fit.tables[which])));
        let mut header = true;
        for table in tables.chain(without_fit) {
            let Table { columns, rows } = table.map_err(io::Error::other)?;
            if !rows.is_empty() {
                lines(w, std::mem::take(&mut header).then_some(columns).into_iter().chain(rows))?;
            }
        }
        Ok(())
    }
}
