//! Finished jobs, each kept the moment it is done, so that a run that was killed goes on where it was.
//!
//! A file of lines. The first names the version and the inputs, every other is a checksum, a space and one entry as JSON. The
//! checksum is over the inputs too, so a line that was damaged, or that another batch wrote, is not taken for one of this
//! batch: its job is done again. A line is appended in one piece; what a kill left of a last one is cut off. The journal of
//! other inputs or of another version is begun anew. What records are, it does not know.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::sha256;
use crate::report::ReportError;

/// The name of the journal in the output folder.
pub const NAME: &str = "batch.journal";
/// Format of the journal; another one is begun anew.
const FORMAT: u32 = 2;
/// Digits of a checksum that stand before a line.
const DIGITS: usize = 16;
/// No line is longer, bytes.
const LONGEST_LINE: u64 = 64 << 20;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    tongue_fit_batch_journal: u32,
    version: String,
    inputs_sha256: String,
}

/// What a journal keeps of a job that ended well.
pub trait Kept: Serialize + DeserializeOwned {
    /// What is held in memory of it while the batch runs.
    type Digest: Clone;

    /// It.
    fn digest(&self) -> Self::Digest;
}

/// One finished job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry<T> {
    /// Its number in the plan.
    pub job: usize,
    /// Time it took, s; in no output file, which are to be the same after every run.
    pub wall_s: f64,
    /// What came of it, or why nothing did.
    pub result: Result<T, String>,
}

/// What is known of a finished job without reading its entry.
#[derive(Debug)]
struct Place<D> {
    offset: u64,
    length: usize,
    digest: Option<D>,
}

/// The journal of a batch, locked against other runs.
#[derive(Debug)]
pub struct Journal<T: Kept> {
    path: PathBuf,
    file: File,
    /// Of the inputs; goes into every checksum.
    key: String,
    end: u64,
    done: BTreeMap<usize, Place<T::Digest>>,
    notes: Vec<String>,
}

impl<T: Kept> Journal<T> {
    /// Opens the journal in `folder` of a batch of `jobs` jobs, and goes on with it if it is of the inputs that `key` is a hash
    /// of, else begins a new one; [`Journal::notes`] says what was not taken over.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system, for what is no regular file (a link, a pipe), and when another run holds
    /// the journal.
    pub fn open(folder: &Path, key: &str, jobs: usize) -> Result<Self, ReportError> {
        let path = folder.join(NAME);
        let fail = |source| ReportError::File { path: path.clone(), source };
        let other = |why: &str| fail(io::Error::other(why));
        // Not opened before it is known to be a file: opening a pipe waits, and a link leads elsewhere.
        if std::fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(other("it is a link, a pipe or a folder, not a journal; move it away"));
        }
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(false).open(&path).map_err(fail)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => other("another batch is writing into this folder"),
            TryLockError::Error(source) => fail(source),
        })?;
        let (done, notes) = (BTreeMap::new(), Vec::new());
        let mut journal = Self { path: path.clone(), file, key: key.to_owned(), end: 0, done, notes };
        journal.resume(jobs).map_err(fail)?;
        Ok(journal)
    }

    fn resume(&mut self, jobs: usize) -> io::Result<()> {
        let header = Header {
            tongue_fit_batch_journal: FORMAT,
            version: crate::VERSION.to_owned(),
            inputs_sha256: self.key.clone(),
        };
        let mut reader = BufReader::new(self.file.try_clone()?);
        let mut line = Vec::new();
        let mut next = |line: &mut Vec<u8>| -> io::Result<bool> {
            line.clear();
            reader.by_ref().take(LONGEST_LINE).read_until(b'\n', line)?;
            Ok(line.last() == Some(&b'\n'))
        };
        let mut dropped = 0;
        if next(&mut line)? {
            let found = serde_json::from_slice::<Header>(&line);
            match found {
                Ok(found) if found != header => {
                    let of = if found.version == header.version { "other inputs" } else { &found.version };
                    self.notes.push(format!("the journal in this folder was of {of}: begun anew"));
                }
                found => {
                    dropped += usize::from(found.is_err());
                    self.end = line.len() as u64;
                    while next(&mut line)? {
                        match self.entry(&line).filter(|entry| entry.job < jobs) {
                            Some(entry) => self.place(&entry, self.end, line.len()),
                            None => dropped += 1,
                        }
                        self.end += line.len() as u64;
                    }
                }
            }
        }
        if dropped > 0 {
            self.notes.push(format!(
                "lines of the journal that are damaged or not of this batch, left out: {dropped}; what they held is done again"
            ));
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

    /// What of an earlier journal could not be taken over, in sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether a job is done.
    pub fn has(&self, job: usize) -> bool {
        self.done.contains_key(&job)
    }

    /// Whether a job is done without a result.
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

    /// Digests of what was kept, in the order of the jobs.
    pub fn digests(&self) -> impl Iterator<Item = &T::Digest> + Clone {
        self.done.values().filter_map(|p| p.digest.as_ref())
    }

    /// Keeps an entry.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system.
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
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system, and where the journal was changed while it was in use.
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

    /// Removes the journal: all of it stands in the outputs.
    ///
    /// # Errors
    /// [`ReportError::File`] as the operating system.
    pub fn remove(self) -> Result<(), ReportError> {
        std::fs::remove_file(&self.path).map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> ReportError {
        ReportError::File { path: self.path.clone(), source }
    }

    fn checksum(&self, json: &str) -> String {
        sha256(&[&self.key, json])[..DIGITS].to_owned()
    }

    /// The entry of a line, if it is one and whole.
    fn entry(&self, line: &[u8]) -> Option<Entry<T>> {
        let (sum, json) = std::str::from_utf8(line).ok()?.trim_end_matches('\n').split_once(' ')?;
        (sum == self.checksum(json)).then(|| serde_json::from_str(json).ok())?
    }

    /// Remembers where the line of an entry begins and how many bytes it has.
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
mod tests {
    use super::*;

    impl Kept for f64 {
        type Digest = ();

        fn digest(&self) {}
    }

    const JOBS: usize = 4;

    fn open(folder: &Path, key: &str) -> Journal<f64> {
        Journal::open(folder, key, JOBS).unwrap()
    }

    fn entry(job: usize) -> Entry<f64> {
        let result = if job == 2 { Err("reason".into()) } else { Ok(1.0 / (3.0 + job as f64)) };
        Entry { job, wall_s: 0.1 + job as f64, result }
    }

    #[test]
    fn a_line_cut_by_a_kill_is_dropped_and_the_rest_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = open(folder.path(), "abc");
        for job in [2, 0] {
            journal.append(&entry(job)).unwrap();
        }
        let whole = journal.end;
        journal.append(&entry(1)).unwrap();
        drop(journal);
        let path = folder.path().join(NAME);
        let bytes = std::fs::read(&path).unwrap();
        for cut in whole..bytes.len() as u64 {
            std::fs::write(&path, &bytes[..cut as usize]).unwrap();
            let mut journal = open(folder.path(), "abc");
            assert_eq!((journal.len(), journal.has(1), journal.notes().len()), (2, false, 0));
            assert_eq!(journal.read(2).unwrap(), Some(entry(2)));
            assert!(journal.is_refused(2) && !journal.is_refused(0));
            journal.append(&entry(1)).unwrap();
            assert_eq!(journal.read(1).unwrap(), Some(entry(1)));
        }
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }

    #[test]
    fn whatever_byte_is_changed_what_is_taken_over_is_what_was_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = open(folder.path(), "abc");
        (0..3).for_each(|job| journal.append(&entry(job)).unwrap());
        drop(journal);
        let path = folder.path().join(NAME);
        let bytes = std::fs::read(&path).unwrap();
        for at in 0..bytes.len() {
            for other in [bytes[at] ^ 1, bytes[at] ^ 0x80, b'\n', b' ', 0] {
                let mut damaged = bytes.clone();
                damaged[at] = other;
                std::fs::write(&path, &damaged).unwrap();
                let mut journal = open(folder.path(), "abc");
                assert!(!journal.is_empty() || at < 200, "a line that is whole is kept: {at}");
                for job in (0..JOBS).filter(|job| journal.has(*job)).collect::<Vec<_>>() {
                    assert_eq!(journal.read(job).unwrap(), Some(entry(job)), "byte {at} as {other}");
                }
                let told = !journal.notes().is_empty() || damaged == bytes || journal.len() == 2;
                assert!(told, "byte {at} as {other}");
                for job in 0..JOBS {
                    if !journal.has(job) {
                        journal.append(&entry(job)).unwrap();
                    }
                }
                drop(journal);
                let journal = open(folder.path(), "abc");
                assert_eq!(journal.len(), JOBS, "and goes on: byte {at} as {other}");
                (0..JOBS).for_each(|job| assert_eq!(journal.read(job).unwrap(), Some(entry(job))));
            }
        }
    }

    #[test]
    fn lines_of_other_batches_and_jobs_out_of_the_plan_are_dropped_with_a_note() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let mut other = open(folder.path(), "other");
        other.append(&entry(1)).unwrap();
        drop(other);
        let foreign = std::fs::read_to_string(&path).unwrap().lines().nth(1).unwrap().to_owned();
        let mut journal = Journal::<f64>::open(folder.path(), "abc", 10).unwrap();
        assert!(journal.is_empty() && journal.notes()[0].contains("of other inputs: begun anew"));
        [0, 7].iter().for_each(|job| journal.append(&entry(*job)).unwrap());
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap() + &foreign + "\nnonsense\n";
        std::fs::write(&path, &text).unwrap();
        let journal = open(folder.path(), "abc");
        assert_eq!((journal.len(), journal.has(0)), (1, true));
        assert!(journal.notes()[0].contains("not of this batch, left out: 3"), "{:?}", journal.notes());
        drop(journal);
        std::fs::write(&path, text.replace(crate::VERSION, "0.0.1 (f00)")).unwrap();
        let journal = open(folder.path(), "abc");
        assert!(journal.is_empty() && journal.notes()[0].contains("of 0.0.1 (f00): begun anew"));
    }

    #[test]
    fn two_runs_exclude_each_other_and_what_is_no_file_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let journal = open(folder.path(), "abc");
        let refused = Journal::<f64>::open(folder.path(), "abc", JOBS).unwrap_err().to_string();
        assert!(refused.contains("another batch"), "{refused}");
        journal.remove().unwrap();
        #[cfg(unix)]
        {
            let precious = folder.path().join("precious");
            std::fs::write(&precious, "mine").unwrap();
            std::os::unix::fs::symlink(&precious, folder.path().join(NAME)).unwrap();
            let refused = Journal::<f64>::open(folder.path(), "abc", JOBS).unwrap_err().to_string();
            assert!(refused.contains("it is a link"), "{refused}");
            assert_eq!(std::fs::read_to_string(&precious).unwrap(), "mine");
        }
    }
}
