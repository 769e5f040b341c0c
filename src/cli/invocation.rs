//! One run of the program: its command line, how much it prints, and where. It is a process of its own, or a call within the process of a
//! program such as Python, which gets what is printed as text and can stop the run.

use std::cell::RefCell;
use std::ffi::OsString;
use std::io::{self, Write};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

use tongue_fit::inner::report::{Provenance, joined};

/// What a call printed, and how it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Called {
    /// The exit status that a process would have.
    pub status: u8,
    pub stdout: String,
    pub stderr: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Volume {
    /// `-q`: errors, warnings, and results that are in no file.
    Quiet,
    /// Results and notes; progress if stderr is a terminal.
    Normal,
    /// `-v`: also each step, with the time since the start.
    Verbose,
}

#[derive(Debug)]
pub struct Invocation {
    pub words: Vec<OsString>,
    pub volume: Volume,
    pub start: Instant,
    /// What was printed to standard output and to standard error, if it is kept for a caller.
    kept: Option<[Mutex<Vec<u8>>; 2]>,
    /// Whether the caller no longer waits.
    stop: Arc<AtomicBool>,
}

static PROCESS: OnceLock<Arc<Invocation>> = OnceLock::new();

thread_local! {
    static CALL: RefCell<Option<Arc<Invocation>>> = const { RefCell::new(None) };
}

/// The run that this thread works for; `None` in tests of functions.
pub fn current() -> Option<Arc<Invocation>> {
    CALL.with_borrow(|call| call.clone().or_else(|| PROCESS.get().cloned()))
}

/// Ends the work of this thread if its caller no longer waits: the thread unwinds, and the call with it.
pub fn stop_if_asked() {
    if current().is_some_and(|i| i.stop.load(Ordering::Relaxed)) {
        resume_unwind(Box::new("stopped by its caller"));
    }
}

impl Invocation {
    pub fn begin(words: Vec<OsString>, volume: Volume) {
        let process = Self { words, volume, start: Instant::now(), kept: None, stop: Arc::default() };
        let _ = PROCESS.set(Arc::new(process));
    }

    /// A call within a process, which ends soon after `stop` becomes true.
    pub fn call(words: Vec<OsString>, volume: Volume, stop: Arc<AtomicBool>) -> Arc<Self> {
        Arc::new(Self { words, volume, start: Instant::now(), kept: Some(Default::default()), stop })
    }

    pub fn enter(self: &Arc<Self>) {
        CALL.set(Some(Arc::clone(self)));
    }

    pub fn is_call(&self) -> bool {
        self.kept.is_some()
    }

    pub fn captured_output(&self) -> [String; 2] {
        let text = |bytes: &Mutex<Vec<u8>>| {
            String::from_utf8_lossy(&bytes.lock().unwrap_or_else(PoisonError::into_inner)).into_owned()
        };
        self.kept.as_ref().map(|kept| kept.each_ref().map(text)).unwrap_or_default()
    }
}

#[derive(Debug, Clone, Copy)]
pub enum Stream {
    Stdout,
    Stderr,
}

impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let invocation = current();
        if let Some(kept) = invocation.as_ref().and_then(|i| i.kept.as_ref()) {
            return kept[*self as usize].lock().unwrap_or_else(PoisonError::into_inner).write(bytes);
        }
        match self {
            Self::Stdout => io::stdout().write(bytes),
            Self::Stderr => io::stderr().write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Stdout => io::stdout().flush(),
            Self::Stderr => io::stderr().flush(),
        }
    }
}

/// The command that outputs name; for a call without its output folder, which the caller removes.
pub fn provenance() -> Provenance {
    let is_call = current().is_some_and(|run| run.is_call());
    Provenance::new(line_of(if is_call { words_of_the_result() } else { words() }))
}

/// The words of the command line without options that do not change results, so that outputs are the same wherever they are made.
pub fn words_of_the_result() -> Vec<String> {
    let mut words = words().into_iter();
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--json" | "-q" | "--quiet" | "-v" | "--verbose" => {}
            "--threads" | "--out" | "--shard" => {
                words.next();
            }
            w if ["--threads=", "--out=", "--shard="].iter().any(|option| w.starts_with(option)) => {}
            _ => kept.push(word),
        }
    }
    kept
}

fn words() -> Vec<String> {
    let run = current();
    run.iter().flat_map(|run| &run.words).skip(1).map(|a| a.to_string_lossy().into_owned()).collect()
}

/// The words as one line for a shell; a word that the shell would split or change is quoted.
pub fn line_of(words: Vec<String>) -> String {
    let quoted = words.into_iter().map(|word| {
        if !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "_@%+=:,./-".contains(c)) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    });
    joined(std::iter::once("tongue-fit".to_owned()).chain(quoted), " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_that_a_shell_would_split_is_quoted() {
        let words = ["--tension", "my own=2", "it's", "--vowel", "ɯ", ""].map(str::to_owned).to_vec();
        assert_eq!(line_of(words), r"tongue-fit --tension 'my own=2' 'it'\''s' --vowel ɯ ''");
    }
}
