//! Finished fits, each kept the moment it is done, so that a run that was killed goes on where it was.
//!
//! A file of JSON lines: the first names the inputs by their hash, every other is one fit with all that the outputs say of
//! it. A line is appended in one piece; what a kill left of a last one is cut off. The journal of other inputs is begun anew.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::page::PageFit;
use super::summary::Digest;
use crate::report::ReportError;

/// The name of the journal in the output folder.
pub const NAME: &str = "batch.journal";
/// Format of the journal; another one is begun anew.
const FORMAT: u32 = 1;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    tongue_fit_batch_journal: u32,
    inputs_sha256: String,
}

/// One finished job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Its number in the plan.
    pub job: usize,
    /// Time it took, s; in no output file, which are to be the same after every run.
    pub wall_s: f64,
    /// What came of it.
    pub result: EntryResult,
}

/// What came of a job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum EntryResult {
    /// A fit, in the words of every output.
    Fitted(Box<Fitted>),
    /// The fit could not begin.
    Refused(String),
}

/// A fit in the words of every output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// For the summary.
    pub digest: Digest,
    /// Its record: a JSON object on one line.
    pub json: String,
    /// Its lines of `muscles.csv`.
    pub muscles: String,
    /// Its line of `fits.csv`.
    pub fits: String,
    /// Its part of the page, for as many fits as the page shows.
    pub page: Option<PageFit>,
}

/// What is known of a finished job without reading its entry.
#[derive(Debug, Clone)]
struct Place {
    offset: u64,
    length: usize,
    digest: Option<Digest>,
}

/// The journal of a batch, locked against other runs.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    end: u64,
    done: BTreeMap<usize, Place>,
}

impl Journal {
    /// Opens the journal in `folder` and goes on with it if it is of these inputs, else begins a new one.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system, and when another run holds the journal.
    pub fn open(folder: &Path, inputs_sha256: &str) -> Result<Self, ReportError> {
        let path = folder.join(NAME);
        let fail = |source| ReportError::File { path: path.clone(), source };
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(fail)?;
        file.try_lock().map_err(|_| fail(io::Error::other("another batch is writing into this folder")))?;
        let mut journal = Self { path: path.clone(), file, end: 0, done: BTreeMap::new() };
        journal.resume(inputs_sha256).map_err(fail)?;
        Ok(journal)
    }

    fn resume(&mut self, inputs_sha256: &str) -> io::Result<()> {
        let header = Header { tongue_fit_batch_journal: FORMAT, inputs_sha256: inputs_sha256.to_owned() };
        let mut reader = BufReader::new(&self.file);
        let mut line = Vec::new();
        let mut next = |line: &mut Vec<u8>| -> io::Result<bool> {
            line.clear();
            reader.read_until(b'\n', line)?;
            Ok(line.last() == Some(&b'\n'))
        };
        if next(&mut line)? && serde_json::from_slice::<Header>(&line).is_ok_and(|h| h == header) {
            self.end = line.len() as u64;
            while next(&mut line)?
                && let Ok(entry) = serde_json::from_slice::<Entry>(&line)
            {
                let place = Place { offset: self.end, length: line.len(), digest: entry.digest() };
                self.done.insert(entry.job, place);
                self.end += line.len() as u64;
            }
        }
        self.file.set_len(self.end)?;
        if self.end == 0 {
            let mut first = serde_json::to_vec(&header)?;
            first.push(b'\n');
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(&first)?;
            self.end = first.len() as u64;
        }
        Ok(())
    }

    /// Whether a job is done.
    pub fn has(&self, job: usize) -> bool {
        self.done.contains_key(&job)
    }

    /// Whether a job is done without a fit.
    pub fn is_refused(&self, job: usize) -> bool {
        self.done.get(&job).is_some_and(|p| p.digest.is_none())
    }

    /// How many jobs are done.
    pub fn len(&self) -> usize {
        self.done.len()
    }

    /// Whether none is.
    pub fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    /// Digests of the finished fits, in the order of the jobs.
    pub fn digests(&self) -> impl Iterator<Item = &Digest> + Clone {
        self.done.values().filter_map(|p| p.digest.as_ref())
    }

    /// Keeps an entry.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system.
    pub fn append(&mut self, entry: &Entry) -> Result<(), ReportError> {
        let write = |this: &mut Self| -> io::Result<usize> {
            let mut line = serde_json::to_vec(entry)?;
            line.push(b'\n');
            this.file.seek(SeekFrom::Start(this.end))?;
            this.file.write_all(&line)?;
            Ok(line.len())
        };
        let length = write(self).map_err(|source| ReportError::File { path: self.path.clone(), source })?;
        self.done.insert(entry.job, Place { offset: self.end, length, digest: entry.digest() });
        self.end += length as u64;
        Ok(())
    }

    /// The entry of a job, or `None` if it is not done.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system.
    pub fn read(&self, job: usize) -> Result<Option<Entry>, ReportError> {
        let Some(place) = self.done.get(&job) else { return Ok(None) };
        let read = || -> io::Result<Entry> {
            let mut bytes = vec![0; place.length];
            let mut file = &self.file;
            file.seek(SeekFrom::Start(place.offset))?;
            file.read_exact(&mut bytes)?;
            Ok(serde_json::from_slice(&bytes)?)
        };
        read().map(Some).map_err(|source| ReportError::File { path: self.path.clone(), source })
    }

    /// Removes the journal: all of it stands in the outputs.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system.
    pub fn remove(self) -> Result<(), ReportError> {
        std::fs::remove_file(&self.path)
            .map_err(|source| ReportError::File { path: self.path.clone(), source })
    }
}

impl Entry {
    fn digest(&self) -> Option<Digest> {
        match &self.result {
            EntryResult::Fitted(f) => Some(f.digest.clone()),
            EntryResult::Refused(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(job: usize) -> Entry {
        Entry { job, wall_s: 0.1 + job as f64, result: EntryResult::Refused(format!("reason {job}")) }
    }

    #[test]
    fn a_line_cut_by_a_kill_is_dropped_and_the_rest_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(folder.path(), "abc").unwrap();
        for job in [2, 0] {
            journal.append(&entry(job)).unwrap();
        }
        let whole = journal.end;
        journal.append(&entry(1)).unwrap();
        drop(journal);
        let path = folder.path().join(NAME);
        let bytes = std::fs::read(&path).unwrap();
        for cut in whole..bytes.len() as u64 {
            std::fs::write(&path, bytes.get(..cut as usize).unwrap()).unwrap();
            let mut journal = Journal::open(folder.path(), "abc").unwrap();
            assert_eq!((journal.len(), journal.has(1)), (2, false));
            assert_eq!(journal.read(2).unwrap(), Some(entry(2)));
            journal.append(&entry(1)).unwrap();
            assert_eq!(journal.read(1).unwrap(), Some(entry(1)));
        }
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }

    #[test]
    fn the_journal_of_other_inputs_is_begun_anew_and_two_runs_exclude_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(folder.path(), "abc").unwrap();
        journal.append(&entry(0)).unwrap();
        let refused = Journal::open(folder.path(), "abc").unwrap_err().to_string();
        assert!(refused.contains("another batch"), "{refused}");
        drop(journal);
        assert!(Journal::open(folder.path(), "abd").unwrap().is_empty());
        assert!(Journal::open(folder.path(), "abc").unwrap().is_empty());
    }
}
