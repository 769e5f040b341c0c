//! Journal of a batch: the file of its finished jobs, after which a killed run resumes, and which `merge` joins with those of other shards.
//!
//! Its first line has the version, the inputs and the arguments of the command; every other line is one finished job as JSON. A last line
//! that was not written to its end is cut off. A journal of other inputs or of another version is replaced by a new one.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};

use crate::report::ReportError;

pub const NAME: &str = "batch.journal";
/// Format of the journal; a journal of another format is replaced.
const FORMAT: u32 = 7;
const LONGEST_LINE: u64 = 64 << 20;
const HEADER_START: &[u8] = b"{\"tongue_fit_batch_journal\":";
const NO_JOURNAL: &str = "line 1: it is no journal; move the file away";

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct JournalHeader {
    tongue_fit_batch_journal: u32,
    version: String,
    inputs_sha256: String,
    arguments: Vec<String>,
}

impl JournalHeader {
    fn new(key: &str, arguments: &[String]) -> Self {
        Self {
            tongue_fit_batch_journal: FORMAT,
            version: crate::VERSION.to_owned(),
            inputs_sha256: key.to_owned(),
            arguments: arguments.to_vec(),
        }
    }

    fn read(line: &[u8]) -> io::Result<Self> {
        serde_json::from_slice(line).map_err(|_| io::Error::other(NO_JOURNAL))
    }
}

pub fn arguments(path: &Path) -> Result<Vec<String>, ReportError> {
    let fail = |source| ReportError::Journal { path: path.to_owned(), source };
    let mut line = Vec::new();
    let file = regular(path).and_then(|()| File::open(path)).map_err(fail)?;
    BufReader::new(file).take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(fail)?;
    let header = JournalHeader::read(&line).map_err(fail)?;
    if header.version != crate::VERSION {
        let why = format!("it was written by version {}, this is {}", header.version, crate::VERSION);
        return Err(fail(io::Error::other(why + "; merge it with the version that made it")));
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

fn damaged(line: usize) -> io::Error {
    io::Error::other(format!("line {line} is damaged; delete this line, and its job is done again"))
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry<T> {
    pub job: usize,
    /// Duration of the job. It is in no output file, because these are the same after every run.
    pub wall_s: f64,
    pub result: Result<T, String>,
}

/// Where the line of a finished job is: index of its file, number of the line, and its place in it, bytes.
#[derive(Debug)]
struct JournalPlace {
    file: usize,
    line: usize,
    offset: u64,
    length: usize,
}

/// The finished jobs of one journal, or of the journals of all shards; other runs are locked out.
#[derive(Debug, Default)]
pub struct Journal {
    /// Only the first file is written to, from `end` on.
    files: Vec<(PathBuf, File)>,
    end: u64,
    done: BTreeMap<usize, JournalPlace>,
    /// What the journal was of that was replaced.
    pub replaced: Option<String>,
}

impl Journal {
    /// Opens the journal at `path` for a batch of `jobs` jobs of a command with `arguments`. A journal with the same `key`, the hash of the
    /// inputs, is resumed; another one is replaced, which [`Journal::replaced`] says.
    pub fn open(path: PathBuf, key: &str, arguments: &[String], jobs: usize) -> Result<Self, ReportError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let (mut journal, header) = (Self::default(), JournalHeader::new(key, arguments));
        journal.replaced = journal.add(path, &options, &header, jobs)?;
        let cut = journal.files[0].1.set_len(journal.end);
        let begun = cut.and_then(|()| if journal.end == 0 { journal.append_line(&header) } else { Ok(0) });
        begun.map_err(|source| journal.error_of(0, source))?;
        Ok(journal)
    }

    /// The finished jobs in the journals of all shards of a batch, for reading only.
    pub fn join(
        paths: impl IntoIterator<Item = PathBuf>,
        key: &str,
        arguments: &[String],
        jobs: usize,
    ) -> Result<Self, ReportError> {
        let (mut journal, header) = (Self::default(), JournalHeader::new(key, arguments));
        for path in paths {
            if let Some(of) = journal.add(path, OpenOptions::new().read(true), &header, jobs)? {
                let why = format!("it is of {of}, so it is not part of this batch");
                return Err(journal.error_of(journal.files.len() - 1, io::Error::other(why)));
            }
        }
        Ok(journal)
    }

    /// Opens and locks one more file and reads its finished jobs. If it has another header, returns what it is of in words.
    fn add(
        &mut self,
        path: PathBuf,
        options: &OpenOptions,
        header: &JournalHeader,
        jobs: usize,
    ) -> Result<Option<String>, ReportError> {
        let opened = regular(&path).and_then(|()| options.open(&path));
        let locked = opened.and_then(|file| match file.try_lock() {
            Ok(()) => Ok(file),
            Err(TryLockError::WouldBlock) => Err(io::Error::other("another batch is writing into it")),
            Err(TryLockError::Error(source)) => Err(source),
        });
        let read = locked.and_then(|file| {
            self.files.push((path.clone(), file));
            self.scan(header, jobs)
        });
        read.map_err(|source| ReportError::Journal { path, source })
    }

    /// Reads the finished jobs of the last file.
    fn scan(&mut self, header: &JournalHeader, jobs: usize) -> io::Result<Option<String>> {
        let file = self.files.len() - 1;
        let mut reader = BufReader::new(self.files[file].1.try_clone()?);
        let mut line = Vec::new();
        let (mut offset, mut number) = (0, 0);
        while reader.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line)? > 0 && line.ends_with(b"\n") {
            number += 1;
            if number == 1 {
                let found = JournalHeader::read(&line)?;
                if found.version != header.version {
                    return Ok(Some(found.version));
                } else if found != *header {
                    return Ok(Some("other inputs".to_owned()));
                }
            } else {
                let entry: Option<JournalEntry<IgnoredAny>> = serde_json::from_slice(&line).ok();
                let entry = entry.filter(|entry| entry.job < jobs).ok_or_else(|| damaged(number))?;
                let place = JournalPlace { file, line: number, offset, length: line.len() };
                self.done.insert(entry.job, place);
            }
            offset += line.len() as u64;
            line.clear();
        }
        if line.len() as u64 == LONGEST_LINE {
            let why = format!("line {} is longer than any job; move the file away", number + 1);
            return Err(io::Error::other(why));
        }
        if number == 0 && !line.iter().zip(HEADER_START).all(|(a, b)| a == b) {
            return Err(io::Error::other(NO_JOURNAL));
        }
        self.end = offset;
        Ok(None)
    }

    pub fn has(&self, job: usize) -> bool {
        self.done.contains_key(&job)
    }

    pub fn finished(&self) -> usize {
        self.done.len()
    }

    pub fn append<T: Serialize>(&mut self, entry: &JournalEntry<T>) -> Result<(), ReportError> {
        let offset = self.end;
        let written = self.append_line(entry);
        let length = written.map_err(|source| self.error_of(0, source))?;
        let line = self.done.len() + 2;
        self.done.insert(entry.job, JournalPlace { file: 0, line, offset, length });
        Ok(())
    }

    /// The entry of a job, or those fields of it that `T` has; `None` if the job is not finished.
    pub fn read<T: DeserializeOwned>(&self, job: usize) -> Result<Option<JournalEntry<T>>, ReportError> {
        let Some(JournalPlace { file, line, offset, length }) = self.done.get(&job) else { return Ok(None) };
        let mut bytes = vec![0; *length];
        let mut reader = &self.files[*file].1;
        let read = reader.seek(SeekFrom::Start(*offset)).and_then(|_| reader.read_exact(&mut bytes));
        let entry = read.and_then(|()| serde_json::from_slice(&bytes).map_err(|_| damaged(*line)));
        entry.map(Some).map_err(|source| self.error_of(*file, source))
    }

    pub fn remove(self) -> Result<(), ReportError> {
        self.files.into_iter().try_for_each(|(path, _)| {
            std::fs::remove_file(&path).map_err(|source| ReportError::Journal { path, source })
        })
    }

    fn error_of(&self, file: usize, source: io::Error) -> ReportError {
        ReportError::Journal { path: self.files[file].0.clone(), source }
    }

    /// Appends a line in one write and returns its length.
    fn append_line(&mut self, value: &impl Serialize) -> io::Result<usize> {
        let mut line = serde_json::to_vec(value)?;
        line.push(b'\n');
        let mut file = &self.files[0].1;
        file.seek(SeekFrom::Start(self.end))?;
        file.write_all(&line)?;
        self.end += line.len() as u64;
        Ok(line.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOBS: usize = 4;

    fn open(folder: &Path, key: &str) -> Journal {
        Journal::open(folder.join(NAME), key, &[], JOBS).unwrap()
    }

    fn refused(folder: &Path) -> String {
        Journal::open(folder.join(NAME), "abc", &[], JOBS).unwrap_err().to_string()
    }

    fn entry(job: usize) -> JournalEntry<f64> {
        let result = if job == 2 { Err("reason".into()) } else { Ok(1.0 / (3.0 + job as f64)) };
        JournalEntry { job, wall_s: 0.1 + job as f64, result }
    }

    #[test]
    fn a_line_cut_by_a_kill_is_dropped_and_the_rest_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut journal = open(folder.path(), "abc");
        let header = journal.end;
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
            assert_eq!((journal.finished(), journal.has(1), journal.replaced.clone()), (2, false, None));
            assert_eq!(journal.read(2).unwrap(), Some(entry(2)));
            journal.append(&entry(1)).unwrap();
            assert_eq!(journal.read(1).unwrap(), Some(entry(1)));
        }
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        for cut in 0..header as usize {
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let journal = open(folder.path(), "abc");
            assert!(journal.finished() == 0 && journal.end == header, "a header that was cut: {cut}");
        }
    }

    #[test]
    fn a_line_that_cannot_be_read_is_named_and_nothing_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let mut journal = open(folder.path(), "abc");
        (0..3).for_each(|job| journal.append(&entry(job)).unwrap());
        drop(journal);
        let whole = std::fs::read_to_string(&path).unwrap();
        let outside = serde_json::to_string(&entry(JOBS)).unwrap();
        for line in ["nonsense", "", outside.as_str()] {
            let mut lines: Vec<&str> = whole.lines().collect();
            lines[2] = line;
            let damaged = lines.join("\n") + "\n";
            std::fs::write(&path, &damaged).unwrap();
            let message = refused(folder.path());
            assert!(message.contains("batch.journal\": line 3 is damaged; delete this line"), "{message}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), damaged);
            lines.remove(2);
            std::fs::write(&path, lines.join("\n") + "\n").unwrap();
            let journal = open(folder.path(), "abc");
            assert_eq!((journal.finished(), journal.has(1)), (2, false));
        }
        let not_entries = whole.replace("\"result\"", "\"results\"");
        std::fs::write(&path, &not_entries).unwrap();
        assert!(refused(folder.path()).contains("line 2 is damaged"));
        for text in ["mine\n", "mine"] {
            std::fs::write(&path, text).unwrap();
            let message = refused(folder.path());
            assert!(message.contains("it is no journal; move the file away"), "{message}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    fn a_journal_of_another_batch_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        open(folder.path(), "other").append(&entry(1)).unwrap();
        let mut journal = open(folder.path(), "abc");
        assert!(journal.finished() == 0 && journal.replaced.as_deref() == Some("other inputs"));
        journal.append(&entry(0)).unwrap();
        drop(journal);
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 2);
        std::fs::write(&path, text.replace(crate::VERSION, "0.0.1 (f00)")).unwrap();
        let journal = open(folder.path(), "abc");
        assert!(journal.finished() == 0 && journal.replaced.as_deref() == Some("0.0.1 (f00)"));
    }

    #[test]
    fn two_runs_exclude_each_other_and_links_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let journal = open(folder.path(), "abc");
        let message = refused(folder.path());
        assert!(message.contains("another batch"), "{message}");
        journal.remove().unwrap();
        assert!(!folder.path().join(NAME).exists());
        #[cfg(unix)]
        {
            let precious = folder.path().join("precious");
            std::fs::write(&precious, "mine").unwrap();
            std::os::unix::fs::symlink(&precious, folder.path().join(NAME)).unwrap();
            assert!(refused(folder.path()).contains("it is a link"));
            assert_eq!(std::fs::read_to_string(&precious).unwrap(), "mine");
        }
    }
}
