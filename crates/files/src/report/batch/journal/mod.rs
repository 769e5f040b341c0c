//! Journal of a batch: the file of its finished jobs, after which a killed run resumes, and which `merge` joins with those of other shards.
//!
//! Its first line has the version, the inputs and the arguments of the command; every other line has a checksum, a space and one finished
//! job as JSON. The checksum includes the inputs, so that a line that is damaged or of another batch is not accepted, and its job is done
//! again. A line is appended in one write; an incomplete last line is cut off. A journal of other inputs or of another version is replaced
//! by a new one.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};

use super::sha256;
use crate::report::ReportError;

pub const NAME: &str = "batch.journal";
/// Format of the journal; a journal of another format is replaced.
const FORMAT: u32 = 6;
const DIGITS: usize = 16;
const LONGEST_LINE: u64 = 64 << 20;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct JournalHeader {
    tongue_fit_batch_journal: u32,
    version: String,
    inputs_sha256: String,
    arguments: Vec<String>,
}

pub fn arguments(path: &Path) -> Result<Vec<String>, ReportError> {
    let fail = |source| ReportError::Journal { path: path.to_owned(), source };
    let file = regular(path).and_then(|()| File::open(path)).map_err(fail)?;
    let mut line = Vec::new();
    BufReader::new(file).take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(fail)?;
    let header: JournalHeader = serde_json::from_slice(&line)
        .map_err(|_| fail(io::Error::other("it is not a journal of a batch")))?;
    if header.version != crate::VERSION {
        return Err(fail(io::Error::other(format!(
            "it was written by version {}, this is {}; merge it with the version that made it",
            header.version,
            crate::VERSION
        ))));
    }
    Ok(header.arguments)
}

/// Refuses anything but a regular file before it is opened: opening a pipe would wait, and a link leads elsewhere.
fn regular(path: &Path) -> io::Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if !found.is_file() => {
            Err(io::Error::other("it is a link, a pipe or a folder, not a journal; move it away"))
        }
        _ => Ok(()),
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry<T> {
    pub job: usize,
    /// Duration of the job. It is in no output file, because these are the same after every run.
    pub wall_s: f64,
    pub result: Result<T, String>,
}

/// Where the line of a finished job is: index of its file, and its place in it, bytes.
#[derive(Debug)]
struct JournalPlace {
    file: usize,
    offset: u64,
    length: usize,
}

/// The finished jobs of one journal, or of the journals of all shards; other runs are locked out.
#[derive(Debug, Default)]
pub struct Journal {
    /// Only the first file is written to, from `end` on.
    files: Vec<(PathBuf, File)>,
    end: u64,
    /// Hash of the inputs, which every checksum includes.
    key: String,
    done: BTreeMap<usize, JournalPlace>,
    notes: Vec<String>,
}

impl Journal {
    /// Opens the journal at `path` for a batch of `jobs` jobs of a command with `arguments`. A journal with the same `key`, the hash of the
    /// inputs, is resumed; another one is replaced. [`Journal::notes`] says what was left out.
    pub fn open(path: PathBuf, key: &str, arguments: &[String], jobs: usize) -> Result<Self, ReportError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut journal = Self { key: key.to_owned(), ..Self::default() };
        journal.lock(path, &options)?;
        journal.resume(arguments, jobs).map_err(|source| journal.error_of(0, source))?;
        Ok(journal)
    }

    /// The finished jobs in the journals of all shards of a batch, for reading only.
    pub fn join(
        paths: impl IntoIterator<Item = PathBuf>,
        key: &str,
        arguments: &[String],
        jobs: usize,
    ) -> Result<Self, ReportError> {
        let mut journal = Self { key: key.to_owned(), ..Self::default() };
        for (number, path) in paths.into_iter().enumerate() {
            journal.lock(path, OpenOptions::new().read(true))?;
            let other = journal.scan(number, &journal.header(arguments), jobs);
            if let Some(of) = other.map_err(|source| journal.error_of(number, source))? {
                let of_other = format!("it is of {of}, so it is not part of this batch");
                return Err(journal.error_of(number, io::Error::other(of_other)));
            }
        }
        Ok(journal)
    }

    fn lock(&mut self, path: PathBuf, options: &OpenOptions) -> Result<(), ReportError> {
        let locked =
            regular(&path).and_then(|()| options.open(&path)).and_then(|file| match file.try_lock() {
                Ok(()) => Ok(file),
                Err(TryLockError::WouldBlock) => Err(io::Error::other("another batch is writing into it")),
                Err(TryLockError::Error(source)) => Err(source),
            });
        match locked {
            Ok(file) => self.files.push((path, file)),
            Err(source) => return Err(ReportError::Journal { path, source }),
        }
        Ok(())
    }

    fn header(&self, arguments: &[String]) -> JournalHeader {
        JournalHeader {
            tongue_fit_batch_journal: FORMAT,
            version: crate::VERSION.to_owned(),
            inputs_sha256: self.key.clone(),
            arguments: arguments.to_vec(),
        }
    }

    /// Reads the finished jobs of a file. If the file has another header, returns what it is of in words.
    fn scan(&mut self, file: usize, header: &JournalHeader, jobs: usize) -> io::Result<Option<String>> {
        let mut reader = BufReader::new(self.files[file].1.try_clone()?);
        let mut line = Vec::new();
        let mut next = |line: &mut Vec<u8>| -> io::Result<bool> {
            line.clear();
            reader.by_ref().take(LONGEST_LINE).read_until(b'\n', line)?;
            Ok(line.last() == Some(&b'\n'))
        };
        if !next(&mut line)? {
            return Ok(None);
        }
        let mut dropped = 0;
        match serde_json::from_slice::<JournalHeader>(&line) {
            Ok(found) if found != *header => {
                let is_of_this_version = found.version == header.version;
                return Ok(Some(if is_of_this_version { "other inputs".to_owned() } else { found.version }));
            }
            found => dropped += usize::from(found.is_err()),
        }
        let mut offset = line.len() as u64;
        while next(&mut line)? {
            match self.read_line::<JournalEntry<IgnoredAny>>(&line).filter(|entry| entry.job < jobs) {
                Some(JournalEntry { job, .. }) => {
                    self.done.insert(job, JournalPlace { file, offset, length: line.len() });
                }
                None => dropped += 1,
            }
            offset += line.len() as u64;
        }
        if file == 0 {
            self.end = offset;
        }
        if dropped > 0 {
            self.notes.push(format!(
                "lines of the journal that are damaged or not of this batch, left out: {dropped}; their jobs are done again"
            ));
        }
        Ok(None)
    }

    fn resume(&mut self, arguments: &[String], jobs: usize) -> io::Result<()> {
        let header = self.header(arguments);
        if let Some(of) = self.scan(0, &header, jobs)? {
            self.notes.push(format!("the journal in this folder was of {of}: it was replaced by a new one"));
        }
        if self.done.is_empty() {
            self.end = 0;
        }
        self.files[0].1.set_len(self.end)?;
        if self.end == 0 {
            let mut first = serde_json::to_vec(&header)?;
            first.push(b'\n');
            self.append_bytes(&first)?;
        }
        Ok(())
    }

    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    pub fn has(&self, job: usize) -> bool {
        self.done.contains_key(&job)
    }

    pub fn len(&self) -> usize {
        self.done.len()
    }

    pub fn is_empty(&self) -> bool {
        self.done.is_empty()
    }

    pub fn append<T: Serialize>(&mut self, entry: &JournalEntry<T>) -> Result<(), ReportError> {
        let place = serde_json::to_string(entry).map_err(io::Error::from).and_then(|json| {
            let line = format!("{} {json}\n", self.checksum(&json));
            let place = JournalPlace { file: 0, offset: self.end, length: line.len() };
            self.append_bytes(line.as_bytes()).map(|()| place)
        });
        self.done.insert(entry.job, place.map_err(|source| self.error_of(0, source))?);
        Ok(())
    }

    /// The entry of a job, or those fields of it that `T` has; `None` if the job is not finished.
    pub fn read<T: DeserializeOwned>(&self, job: usize) -> Result<Option<JournalEntry<T>>, ReportError> {
        let Some(JournalPlace { file, offset, length }) = self.done.get(&job) else { return Ok(None) };
        let mut bytes = vec![0; *length];
        let mut reader = &self.files[*file].1;
        let read = reader.seek(SeekFrom::Start(*offset)).and_then(|_| reader.read_exact(&mut bytes));
        let entry = read.and_then(|()| {
            let entry = self.read_line(&bytes);
            entry.ok_or_else(|| io::Error::other("it was changed while a batch was using it"))
        });
        entry.map(Some).map_err(|source| self.error_of(*file, source))
    }

    pub fn remove(self) -> Result<(), ReportError> {
        self.files.iter().enumerate().try_for_each(|(number, (path, _))| {
            std::fs::remove_file(path).map_err(|source| self.error_of(number, source))
        })
    }

    fn error_of(&self, file: usize, source: io::Error) -> ReportError {
        ReportError::Journal { path: self.files[file].0.clone(), source }
    }

    fn checksum(&self, json: &str) -> String {
        sha256(&[&self.key, json])[..DIGITS].to_owned()
    }

    /// The content of a line after its checksum; `None` if the line is damaged.
    fn read_line<E: DeserializeOwned>(&self, line: &[u8]) -> Option<E> {
        let (sum, json) = std::str::from_utf8(line).ok()?.trim_end_matches('\n').split_once(' ')?;
        (sum == self.checksum(json)).then(|| serde_json::from_str(json).ok())?
    }

    fn append_bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut file = &self.files[0].1;
        file.seek(SeekFrom::Start(self.end))?;
        file.write_all(bytes)?;
        self.end += bytes.len() as u64;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
