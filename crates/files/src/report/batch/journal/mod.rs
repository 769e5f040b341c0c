//! Journal of a batch: finished jobs are written at once, so that a killed run can be resumed and runs that
//! shared the jobs can be merged.
//!
//! The journal is a file of lines. The first has the version, the inputs and the arguments of the command;
//! every other has a checksum, a space and one entry as JSON. The checksum includes the inputs, so that a
//! line that is damaged or of another batch is not accepted, and its job is done again. A line is appended in
//! one write; an incomplete last line is cut off. A journal of other inputs or of another version is replaced
//! by a new one. The journal does not depend on the type of its records.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::sha256;
use crate::report::ReportError;
use tongue_infer::track::TrackedRecording;

pub const NAME: &str = "batch.journal";
/// Format of the journal; a journal of another format is replaced.
const FORMAT: u32 = 5;
/// Number of digits of the checksum in front of a line.
const DIGITS: usize = 16;
/// Maximum length of a line, bytes.
const LONGEST_LINE: u64 = 64 << 20;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    tongue_fit_batch_journal: u32,
    version: String,
    inputs_sha256: String,
    /// Arguments of the command, without those that do not change results.
    arguments: Vec<String>,
}

/// The arguments of the command whose jobs are in the journal at `path`.
pub fn arguments(path: &Path) -> Result<Vec<String>, ReportError> {
    let fail = |source| ReportError::Journal { path: path.to_owned(), source };
    let file = regular(path).and_then(|()| File::open(path)).map_err(fail)?;
    let mut line = Vec::new();
    BufReader::new(file).take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(fail)?;
    let header: Header = serde_json::from_slice(&line)
        .map_err(|_| fail(io::Error::other("it is not a journal of a batch")))?;
    match header.version == crate::VERSION {
        true => Ok(header.arguments),
        false => Err(fail(io::Error::other(format!(
            "it was written by version {}, this is {}; merge it with the version that made it",
            header.version,
            crate::VERSION
        )))),
    }
}

/// Refuses anything but a regular file before it is opened: opening a pipe waits, and a link leads elsewhere.
fn regular(path: &Path) -> io::Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => {
            Err(io::Error::other("it is a link, a pipe or a folder, not a journal; move it away"))
        }
        _ => Ok(()),
    }
}

/// The record that a journal keeps of a successful job.
pub trait Kept: Serialize + DeserializeOwned {
    /// The part of it that is kept in memory while the batch runs.
    type Digest: Clone;

    fn digest(&self) -> Self::Digest;
}

impl Kept for TrackedRecording {
    type Digest = ();

    fn digest(&self) -> Self::Digest {}
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry<T> {
    pub job: usize,
    /// Its duration, s. It is in no output file, because these are the same after every run.
    pub wall_s: f64,
    /// The record, or why the job failed.
    pub result: Result<T, String>,
}

/// The place of a finished job's entry in the file.
#[derive(Debug)]
struct Place<D> {
    offset: u64,
    length: usize,
    digest: Option<D>,
}

/// Lines of a journal's file that do not belong to this batch.
struct Scan {
    /// The batch that the whole file belongs to, if it is another one.
    other: Option<String>,
    dropped: usize,
}

/// The journal of a batch, locked against other runs.
#[derive(Debug)]
pub struct Journal<T: Kept> {
    path: PathBuf,
    file: File,
    /// Hash of the inputs, which every checksum includes.
    key: String,
    end: u64,
    done: BTreeMap<usize, Place<T::Digest>>,
    notes: Vec<String>,
}

impl<T: Kept> Journal<T> {
    /// Opens the journal at `path` for a batch of `jobs` jobs of a command with `arguments`. It resumes a
    /// journal with the same `key`, the hash of the inputs, or else begins a new one; [`Journal::notes`] says
    /// what was left out.
    pub fn open(path: PathBuf, key: &str, arguments: &[String], jobs: usize) -> Result<Self, ReportError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut journal = Self::begin(path, key, &options)?;
        journal.resume(arguments, jobs).map_err(|source| journal.failed(source))?;
        Ok(journal)
    }

    /// Opens the journal of another run of the same batch for reading only.
    pub fn open_finished(
        path: PathBuf,
        key: &str,
        arguments: &[String],
        jobs: usize,
    ) -> Result<Self, ReportError> {
        let mut journal = Self::begin(path, key, OpenOptions::new().read(true))?;
        let header = journal.header(arguments);
        match journal.scan(&header, jobs) {
            Ok(Scan { other: None, .. }) => Ok(journal),
            Ok(Scan { other: Some(of), .. }) => {
                Err(journal
                    .failed(io::Error::other(format!("it is of {of}, so it is not part of this batch"))))
            }
            Err(source) => Err(journal.failed(source)),
        }
    }

    fn begin(path: PathBuf, key: &str, options: &OpenOptions) -> Result<Self, ReportError> {
        let fail = |source| ReportError::Journal { path: path.clone(), source };
        regular(&path).map_err(fail)?;
        let file = options.open(&path).map_err(fail)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => fail(io::Error::other("another batch is writing into it")),
            TryLockError::Error(source) => fail(source),
        })?;
        let (done, notes) = (BTreeMap::new(), Vec::new());
        Ok(Self { path: path.clone(), file, key: key.to_owned(), end: 0, done, notes })
    }

    fn header(&self, arguments: &[String]) -> Header {
        Header {
            tongue_fit_batch_journal: FORMAT,
            version: crate::VERSION.to_owned(),
            inputs_sha256: self.key.clone(),
            arguments: arguments.to_vec(),
        }
    }

    /// Reads the entries of the batch with this header.
    fn scan(&mut self, header: &Header, jobs: usize) -> io::Result<Scan> {
        let mut reader = BufReader::new(self.file.try_clone()?);
        let mut line = Vec::new();
        let mut next = |line: &mut Vec<u8>| -> io::Result<bool> {
            line.clear();
            reader.by_ref().take(LONGEST_LINE).read_until(b'\n', line)?;
            Ok(line.last() == Some(&b'\n'))
        };
        let mut scan = Scan { other: None, dropped: 0 };
        if next(&mut line)? {
            let found = serde_json::from_slice::<Header>(&line);
            match found {
                Ok(found) if found != *header => {
                    let of = if found.version == header.version { "other inputs" } else { &found.version };
                    scan.other = Some(of.to_owned());
                }
                found => {
                    scan.dropped += usize::from(found.is_err());
                    self.end = line.len() as u64;
                    while next(&mut line)? {
                        match self.entry(&line).filter(|entry| entry.job < jobs) {
                            Some(entry) => self.place(&entry, self.end, line.len()),
                            None => scan.dropped += 1,
                        }
                        self.end += line.len() as u64;
                    }
                }
            }
        }
        if scan.dropped > 0 {
            self.notes.push(format!(
                "lines of the journal that are damaged or not of this batch, left out: {}; their jobs are done again",
                scan.dropped
            ));
        }
        Ok(scan)
    }

    fn resume(&mut self, arguments: &[String], jobs: usize) -> io::Result<()> {
        let header = self.header(arguments);
        if let Some(of) = self.scan(&header, jobs)?.other {
            self.notes.push(format!("the journal in this folder was of {of}: it was replaced by a new one"));
        }
        if self.done.is_empty() {
            self.end = 0;
        }
        self.file.set_len(self.end)?;
        if self.end == 0 {
            let mut first = serde_json::to_vec(&header)?;
            first.push(b'\n');
            self.append_bytes(&first)?;
        }
        Ok(())
    }

    /// Adds the entries of another journal of the same batch that this one lacks.
    pub fn take_over(&mut self, other: &Self) -> Result<(), ReportError> {
        for &job in other.done.keys() {
            if !self.has(job)
                && let Some(entry) = other.read(job)?
            {
                self.append(&entry)?;
            }
        }
        Ok(())
    }

    /// Notes about parts of an earlier journal that were left out.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    pub fn has(&self, job: usize) -> bool {
        self.done.contains_key(&job)
    }

    pub fn is_refused(&self, job: usize) -> bool {
        self.done.get(&job).is_some_and(|p| p.digest.is_none())
    }

    pub fn len(&self) -> usize {
        self.done.len()
    }

    pub fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    /// Digests of the records, in the order of the jobs.
    pub fn digests(&self) -> impl Iterator<Item = &T::Digest> + Clone {
        self.done.values().filter_map(|p| p.digest.as_ref())
    }

    /// Appends an entry.
    pub fn append(&mut self, entry: &Entry<T>) -> Result<(), ReportError> {
        let write = |this: &mut Self| -> io::Result<()> {
            let json = serde_json::to_string(entry)?;
            let line = format!("{} {json}\n", this.checksum(&json));
            let offset = this.end;
            this.append_bytes(line.as_bytes())?;
            this.place(entry, offset, line.len());
            Ok(())
        };
        write(self).map_err(|source| self.failed(source))
    }

    /// The entry of a job, or `None` if it is not done.
    pub fn read(&self, job: usize) -> Result<Option<Entry<T>>, ReportError> {
        let Some(place) = self.done.get(&job) else { return Ok(None) };
        let read = || -> io::Result<Entry<T>> {
            let mut bytes = vec![0; place.length];
            let mut file = &self.file;
            file.seek(SeekFrom::Start(place.offset))?;
            file.read_exact(&mut bytes)?;
            self.entry(&bytes).ok_or_else(|| io::Error::other("it was changed while a batch was using it"))
        };
        read().map(Some).map_err(|source| self.failed(source))
    }

    /// Removes the journal after its content was written to the outputs.
    pub fn remove(self) -> Result<(), ReportError> {
        std::fs::remove_file(&self.path).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> ReportError {
        ReportError::Journal { path: self.path.clone(), source }
    }

    fn checksum(&self, json: &str) -> String {
        sha256(&[&self.key, json])[..DIGITS].to_owned()
    }

    /// The entry of a line; `None` if the line is damaged.
    fn entry(&self, line: &[u8]) -> Option<Entry<T>> {
        let (sum, json) = std::str::from_utf8(line).ok()?.trim_end_matches('\n').split_once(' ')?;
        (sum == self.checksum(json)).then(|| serde_json::from_str(json).ok())?
    }

    /// Stores the offset and the length of an entry's line.
    fn place(&mut self, entry: &Entry<T>, offset: u64, length: usize) {
        let digest = entry.result.as_ref().ok().map(Kept::digest);
        self.done.insert(entry.job, Place { offset, length, digest });
    }

    fn append_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.end))?;
        self.file.write_all(bytes)?;
        self.end += bytes.len() as u64;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
