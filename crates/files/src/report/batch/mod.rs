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

use tongue_core::body::Mesh;
use tongue_infer::inverse::alarms::Alarm;
use tongue_infer::inverse::batch::{Assessment, BaselineRow, Job, Refusal};
use tongue_infer::posterior::Verdict;
use tongue_input::measured::Dataset;
use tongue_input::measured::thesis::Thesis;

use self::journal::{Entry, Kept};
use self::record::AssessedRecord;
use super::record::AlarmRecord;
use super::{OutputDir, ReportError, Told, Writes};

pub use self::page::MOST_FITS as MOST_FITS_ON_PAGE;
pub use self::shard::Shard;
pub use self::summary::{BatchSummary, Digest, PassiveGroup, passive_groups};
pub use self::tables::muscle_lines;

/// Provenance of an output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct BatchProvenance {
    /// Version of tongue-fit.
    pub version: String,
    /// The command line without options that do not change results.
    pub command: String,
    /// Hash of all inputs: version, data, mesh, model and settings.
    pub inputs_sha256: String,
}

/// Content of a batch beside the fits.
#[derive(Debug)]
pub struct Batch<'a> {
    pub provenance: &'a BatchProvenance,
    /// The jobs, in order.
    pub jobs: &'a [Job],
    /// The rows that are baselines.
    pub baselines: &'a [BaselineRow],
    /// The rows that could not be fitted; rows that fail later are added.
    pub refusals: &'a [Refusal],
    /// Faults of the rows and cells that could not be read.
    pub unreadable: &'a [String],
    pub summary: &'a BatchSummary,
    pub mesh: &'a Mesh<2>,
    /// Names of its muscles, in the order of columns.
    pub muscles: &'a [String],
    /// The contrasts between the vowels of each subject; none without posteriors.
    pub contrasts: &'a [contrasts::SubjectContrast],
}

/// A fit as the journal keeps it: its record, from which all outputs are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// For the summary.
    pub digest: Digest,
    pub record: Told,
    /// What the page shows of it beside the record, for as many fits as the page shows.
    pub shown: Option<page::Shown>,
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

/// The journal of a batch.
pub type BatchJournal = journal::Journal<Fitted>;

/// The digests of the fits in a journal, with the numbers of their jobs.
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
    mesh: &Mesh<2>,
    (thesis, posterior): (Option<&Thesis>, Option<&Result<RowPosterior, String>>),
    provenance: &BatchProvenance,
) -> Result<Fitted, ReportError> {
    let mut record = AssessedRecord::new(job, assessment, thesis, &provenance.command);
    let untold = match posterior {
        Some(Err(reason)) => Some(reason),
        Some(Ok(posterior)) => Some(&posterior.report.why).filter(|_| posterior.report.summary.is_none()),
        None => None,
    };
    let alarm = untold.map(|reason| Alarm::NoPosterior { reason: reason.clone() });
    record.fit.alarms.extend(alarm.as_ref().map(AlarmRecord::from));
    let posterior = posterior.and_then(|p| p.as_ref().ok());
    record.fit.posterior = posterior.map(|p| p.report.clone());
    let with_tones = record.fit.posterior.as_ref().filter(|report| !report.priors.baseline.off);
    record.fit.verdict = with_tones.and_then(Verdict::of);
    let shown = (number < page::MOST_FITS).then(|| page::Shown {
        moved: page::displacements(&assessment.fit.positions, mesh),
        ridges: posterior.and_then(|p| p.ridges.clone()),
    });
    Ok(Fitted {
        digest: Digest {
            posterior_untold: untold.is_some(),
            contrasts: posterior.map(|p| p.contrasts.clone()).unwrap_or_default(),
            ..Digest::new(&record)
        },
        record: Told::new(&record).map_err(|e| ReportError::Record { reason: e.to_string() })?,
        shown,
    })
}

/// Writes all files of a finished batch, completely or not at all, and returns their paths.
pub fn write_files(
    out: &OutputDir,
    batch: &Batch<'_>,
    journal: &BatchJournal,
) -> Result<Vec<std::path::PathBuf>, ReportError> {
    // Fits are read once for the longest file, for what the shorter ones say of them, and once more for `muscles.csv`.
    let (lines, shown) = (RefCell::new(String::new()), RefCell::new(Vec::new()));
    let also = |number: usize, fit: &mut Fitted| {
        let mut lines = lines.borrow_mut();
        let is_first = lines.is_empty();
        *lines += &tables::fit_line(batch.muscles, &fit.record, batch.provenance, is_first)?;
        if let Some(page) = fit.shown.take() {
            let page = page::PageFit::new(number, &fit.record, page, batch.muscles);
            shown.borrow_mut().push(page.map_err(io::Error::other)?);
        }
        Ok(())
    };
    let has_posterior = digests(journal).any(|(_, digest)| digest.has_posterior);
    let files: [(&str, &Writes<'_>); 7] = [
        ("batch.json", &|w| write_json(w, batch, journal, false, &also)),
        ("fits.csv", &|w| write_fits(w, batch, journal, &lines.borrow())),
        ("muscles.csv", &|w| write_rows(w, batch, journal, muscle_lines)),
        ("batch.html", &|w| page::write(w, batch, journal, &shown.borrow())),
        ("tensions.svg", &|w| page::write_tensions(w, batch, &shown.borrow())),
        ("posterior.csv", &|w| write_rows(w, batch, journal, tables::posterior_lines)),
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
            let record = if self.with_times { fit.record.with_first("wall_s", wall_s) } else { fit.record };
            all.serialize_element(&record).map_err(|e| io::Error::other(e.to_string()))
        })
        .map_err(S::Error::custom)?;
        all.end()
    }
}

/// Writes the rows of every fit under one header.
fn write_rows(
    w: &mut dyn Write,
    batch: &Batch<'_>,
    journal: &BatchJournal,
    rows: fn(&Told, &BatchProvenance, bool) -> io::Result<String>,
) -> io::Result<()> {
    let mut first = true;
    each_fit(batch, journal, |_, _, fit| {
        let text = rows(&fit.record, batch.provenance, first)?;
        // A fit without rows has no header either.
        if text.lines().count() > usize::from(first) {
            first = false;
            w.write_all(text.as_bytes())?;
        }
        Ok(())
    })
}

/// Writes the lines of the fits, and then those of the other rows.
fn write_fits(w: &mut dyn Write, batch: &Batch<'_>, journal: &BatchJournal, fits: &str) -> io::Result<()> {
    w.write_all(fits.as_bytes())?;
    let mut first = fits.is_empty();
    let mut write = |record: &Told| {
        let header = std::mem::take(&mut first);
        w.write_all(tables::fit_line(batch.muscles, record, batch.provenance, header)?.as_bytes())
    };
    batch.baselines.iter().map(tables::of_baseline).try_for_each(|row| write(&row))?;
    all_refusals(batch, journal)?.iter().map(tables::of_refusal).try_for_each(|row| write(&row))
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
