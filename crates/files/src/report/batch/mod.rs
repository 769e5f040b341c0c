//! Outputs of a batch: tables, one JSON document, one page and one picture, assembled from the
//! parts that each fit wrote when it was done.

pub mod contrasts;
pub mod journal;
pub mod page;
pub mod record;
mod shard;
mod summary;
mod tables;

use std::cell::RefCell;
use std::io::{self, Write};

use serde::ser::{Error as _, SerializeSeq as _};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use tongue_core::body::Mesh;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::batch::{Assessment, BaselineRow, Job, Refusal};
use tongue_infer::posterior::Verdict;
use tongue_input::measured::Dataset;
use tongue_input::measured::thesis::Thesis;

use self::journal::{Entry, Kept};
use self::record::AssessedRecord;
use super::csv::lines;
use super::{OutputDir, ReportError, Table, Writes};

pub use self::page::MOST_FITS as MOST_FITS_ON_PAGE;
pub use self::shard::Shard;
pub use self::summary::{BatchSummary, Digest, PassiveGroup, passive_groups};

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BatchProvenance {
    pub version: String,
    pub command: String,
    pub inputs_sha256: String,
}

#[derive(Debug)]
pub struct Batch<'a> {
    pub provenance: &'a BatchProvenance,
    pub jobs: &'a [Job],
    pub baselines: &'a [BaselineRow],
    /// The rows that could not be fitted; rows that fail later are added.
    pub refusals: &'a [Refusal],
    pub unreadable: &'a [String],
    pub summary: &'a BatchSummary,
    pub mesh: &'a Mesh<2>,
    /// Names of its muscles, in the order of columns.
    pub muscles: &'a [String],
    pub contrasts: &'a [contrasts::SubjectContrast],
}

/// A fit as the journal keeps it: its parts of all outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    pub digest: Digest,
    pub record: Value,
    /// Its rows in `fits.csv`, `muscles.csv` and `posterior.csv`.
    pub tables: [Table; 3],
    /// Its row on the terminal: name, tensions, misfit, error of the passive stretches and number of alarms.
    pub line: [String; 5],
    /// The verdict on its row, where there is one.
    pub verdict: Option<String>,
    /// What the page shows of it, for as many fits as the page shows.
    pub shown: Option<page::PageFit>,
}

/// What of a [`Fitted`] stays in memory.
#[derive(Debug, Deserialize)]
pub struct Digested {
    digest: Digest,
}

impl Kept for Fitted {
    type Digest = Digested;

    fn digest(&self) -> Digested {
        Digested { digest: self.digest.clone() }
    }
}

pub type BatchJournal = journal::Journal<Fitted>;

pub fn digests(journal: &BatchJournal) -> impl Iterator<Item = (usize, &Digest)> + Clone {
    journal.digests().map(|(job, fit)| (job, &fit.digest))
}

/// SHA-256 of a sequence of texts with their lengths, in hexadecimal.
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
    /// The ridges of its changes, SVG; `None` if it has not mixed or the page does not show the fit.
    pub ridges: Option<String>,
}

/// Names of a mesh's muscles in the order of columns: those that the table has, in its order, then the
/// others.
pub fn columns(data: &Dataset, mesh: &Mesh<2>) -> Vec<String> {
    let has = |name: &&String| mesh.muscles.iter().any(|m| m.name.eq_ignore_ascii_case(name));
    let mut names: Vec<String> = data.muscles().iter().filter(has).cloned().collect();
    for chain in &mesh.muscles {
        if !names.iter().any(|n| n.eq_ignore_ascii_case(&chain.name)) {
            names.push(chain.name.clone());
        }
    }
    names
}

/// Puts a finished fit into its record, with the thesis's simulation and the posterior of the row if there are any.
pub fn fitted(
    number: usize,
    job: &Job,
    assessment: &Assessment,
    (mesh, muscles): (&Mesh<2>, &[String]),
    (thesis, posterior): (Option<&Thesis>, Option<&Result<RowPosterior, String>>),
    provenance: &BatchProvenance,
) -> Result<Fitted, ReportError> {
    let mut record = AssessedRecord::new(job, assessment, thesis, &provenance.command);
    let untold = match posterior {
        Some(Err(reason)) => Some(reason),
        Some(Ok(posterior)) => Some(&posterior.report.why).filter(|_| posterior.report.summary.is_none()),
        None => None,
    };
    record.fit.alarms.extend(untold.map(|reason| Alarm::NoPosterior { reason: reason.clone() }));
    let posterior = posterior.and_then(|p| p.as_ref().ok());
    record.fit.posterior = posterior.map(|p| p.report.clone());
    let with_tones = record.fit.posterior.as_ref().filter(|report| !report.priors.baseline.off);
    record.fit.verdict = with_tones.and_then(Verdict::of);
    let ridges = posterior.and_then(|p| p.ridges.as_deref());
    let moved = || page::displacements(&assessment.fit.positions, mesh);
    let shown =
        (number < page::MOST_FITS).then(|| page::PageFit::new(number, &record, (moved(), ridges), muscles));
    Ok(Fitted {
        digest: Digest {
            posterior_untold: untold.is_some(),
            contrasts: posterior.map(|p| p.contrasts.clone()).unwrap_or_default(),
            ..Digest::new(&record)
        },
        tables: [
            tables::of_rows(muscles, &[tables::Row::Fit(&record)], provenance),
            tables::of_muscles(&record, provenance),
            tables::of_posterior(&record, provenance),
        ],
        line: line(&record),
        verdict: record.verdict_of_row(),
        shown: shown.transpose()?,
        record: serde_json::to_value(&record).map_err(|e| ReportError::Record { reason: e.to_string() })?,
    })
}

fn line(r: &AssessedRecord) -> [String; 5] {
    let summary = r.fit.posterior.as_ref().and_then(|p| p.summary.as_ref());
    let tension = |m: &String| {
        let tension = r.fit.tensions_n.of(m).copied().unwrap_or(f64::NAN);
        match summary.and_then(|s| s.tensions_n.of(m)).map(|t| t.spread.interval_95) {
            Some([low, high]) => format!("{m} {tension:.1} (95 % {low:.0}–{high:.0})"),
            None => format!("{m} {tension:.1}"),
        }
    };
    let tensions: Vec<String> = r.fit.active.iter().map(tension).collect();
    [
        r.label(),
        // Two on each line, so that the table stays within 100 columns.
        tensions.chunks(2).map(|pair| pair.join(", ")).collect::<Vec<_>>().join("\n"),
        format!("{:.0e}", r.fit.misfit),
        r.passive.rms_stretch.map(|x| format!("{x:.3}")).unwrap_or_default(),
        r.fit.alarms.len().to_string(),
    ]
}

/// Writes all files of a finished batch, completely or not at all, and returns their paths.
pub fn write_files(
    out: &OutputDir,
    batch: &Batch<'_>,
    journal: &BatchJournal,
) -> Result<Vec<std::path::PathBuf>, ReportError> {
    // Fits are read once for the longest file, for what the shorter ones say of them, and once more for `muscles.csv`.
    let (rows, shown) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let also = |_: usize, fit: &mut Fitted| {
        let mut rows = rows.borrow_mut();
        let mut is_first = rows.is_empty();
        write_table(&mut *rows, std::mem::take(&mut fit.tables[0]), &mut is_first)?;
        shown.borrow_mut().extend(fit.shown.take());
        Ok(())
    };
    let has_posterior = digests(journal).any(|(_, digest)| digest.has_posterior);
    let files: [(&str, &Writes<'_>); 7] = [
        ("batch.json", &|w| write_json(w, batch, journal, false, &also)),
        ("fits.csv", &|w| write_fits(w, batch, journal, &rows.borrow())),
        ("muscles.csv", &|w| write_rows(w, batch, journal, 1)),
        ("batch.html", &|w| page::write(w, batch, journal, &shown.borrow())),
        ("tensions.svg", &|w| page::write_tensions(w, batch, &shown.borrow())),
        ("posterior.csv", &|w| write_rows(w, batch, journal, 2)),
        ("contrasts.csv", &|w| contrasts::write_csv(w, batch)),
    ];
    let count = match (has_posterior, !batch.contrasts.is_empty()) {
        (_, true) => 7,
        (true, false) => 6,
        (false, false) => 5,
    };
    out.write_streams(files[..count].iter().copied())
}

/// What else is made of each fit while the JSON document is written.
pub type Also<'a> = dyn Fn(usize, &mut Fitted) -> io::Result<()> + 'a;

/// Writes the JSON document; `with_times` adds the durations, which differ from run to run.
pub fn write_json(
    w: &mut dyn Write,
    batch: &Batch<'_>,
    journal: &BatchJournal,
    with_times: bool,
    also: &Also<'_>,
) -> io::Result<()> {
    #[derive(Serialize)]
    struct Document<'a> {
        #[serde(flatten)]
        provenance: &'a BatchProvenance,
        summary: &'a BatchSummary,
        fits: Fits<'a>,
        #[serde(skip_serializing_if = "<[_]>::is_empty")]
        contrasts: &'a [contrasts::SubjectContrast],
        baselines: &'a [BaselineRow],
        not_fitted: Vec<Refusal>,
        unreadable_rows: &'a [String],
    }
    let document = Document {
        provenance: batch.provenance,
        summary: batch.summary,
        fits: Fits { batch, journal, with_times, also },
        contrasts: batch.contrasts,
        baselines: batch.baselines,
        not_fitted: all_refusals(batch, journal)?,
        unreadable_rows: batch.unreadable,
    };
    let mut kept = KeepsError { to: w, error: None };
    if let Err(error) = serde_json::to_writer_pretty(&mut kept, &document) {
        return Err(kept.error.unwrap_or_else(|| error.into()));
    }
    writeln!(w)
}

/// Keeps the error of a write, because a serializer passes on only its text.
struct KeepsError<'a> {
    to: &'a mut dyn Write,
    error: Option<io::Error>,
}

impl Write for KeepsError<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to.write(bytes).inspect_err(|e| {
            self.error = Some(e.raw_os_error().map_or_else(|| e.kind().into(), io::Error::from_raw_os_error));
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// The records of all fits, each read from the journal when it is written.
struct Fits<'a> {
    batch: &'a Batch<'a>,
    journal: &'a BatchJournal,
    with_times: bool,
    also: &'a Also<'a>,
}

impl Serialize for Fits<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = serializer.serialize_seq(None)?;
        each_fit(self.batch, self.journal, |number, wall_s, mut fit| {
            (self.also)(number, &mut fit)?;
            let record = match fit.record {
                Value::Object(fields) if self.with_times => {
                    std::iter::once(("wall_s".to_owned(), wall_s.into())).chain(fields).collect()
                }
                record => record,
            };
            all.serialize_element(&record).map_err(|e| io::Error::other(e.to_string()))
        })
        .map_err(S::Error::custom)?;
        all.end()
    }
}

fn write_table(w: &mut dyn Write, table: Table, header: &mut bool) -> io::Result<()> {
    if table.rows.is_empty() {
        return Ok(());
    }
    lines(w, std::mem::take(header).then_some(table.columns).into_iter().chain(table.rows))
}

fn write_rows(w: &mut dyn Write, batch: &Batch<'_>, journal: &BatchJournal, table: usize) -> io::Result<()> {
    let mut header = true;
    each_fit(batch, journal, |_, _, mut fit| {
        write_table(w, std::mem::take(&mut fit.tables[table]), &mut header)
    })
}

fn write_fits(w: &mut dyn Write, batch: &Batch<'_>, journal: &BatchJournal, fits: &[u8]) -> io::Result<()> {
    w.write_all(fits)?;
    let refusals = all_refusals(batch, journal)?;
    let rows =
        batch.baselines.iter().map(tables::Row::Baseline).chain(refusals.iter().map(tables::Row::Refused));
    let rows: Vec<_> = rows.collect();
    write_table(w, tables::of_rows(batch.muscles, &rows, batch.provenance), &mut fits.is_empty())
}

/// The fits in the order of the jobs, with the duration of each, s.
fn each_fit(
    batch: &Batch<'_>,
    journal: &BatchJournal,
    mut then: impl FnMut(usize, f64, Fitted) -> io::Result<()>,
) -> io::Result<()> {
    for number in 0..batch.jobs.len() {
        if let Some(Entry { wall_s, result: Ok(fit), .. }) = journal.read(number).map_err(io::Error::other)? {
            then(number, wall_s, fit)?;
        }
    }
    Ok(())
}

/// The refused rows of the plan and the jobs that could not begin.
fn all_refusals(batch: &Batch<'_>, journal: &BatchJournal) -> io::Result<Vec<Refusal>> {
    let mut all = batch.refusals.to_vec();
    for (number, job) in batch.jobs.iter().enumerate().filter(|(n, _)| journal.is_refused(*n)) {
        if let Some(Entry { result: Err(message), .. }) = journal.read(number).map_err(io::Error::other)? {
            let t = &job.target;
            all.push(Refusal {
                line: job.line,
                subject: t.subject.clone(),
                vowel: t.vowel.clone(),
                kind: Some(t.kind),
                message,
            });
        }
    }
    Ok(all)
}
