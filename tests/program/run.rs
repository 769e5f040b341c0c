//! Runs of the program: what they print and which files they leave.

use std::collections::BTreeSet;
use std::path::Path;
#[cfg(unix)]
use std::process::Command;

#[cfg(unix)]
use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

pub use crate::program::{Done, names, program, run};

impl Done {
    /// The record that `--json` prints, whatever the exit status.
    pub fn record(&self) -> Value {
        parsed(&self.out).unwrap_or_else(|e| panic!("{e}: {}{}", self.out, self.err))
    }

    /// The message without the line breaks of the terminal.
    pub fn message(&self) -> String {
        self.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
    }
}

/// Runs a line of the shell in which `$TONGUE_FIT` is the program; standard output and standard error are joined.
#[cfg(unix)]
pub fn shell(folder: &Path, line: &str) -> Done {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{{ {line}; }} 2>&1")]).current_dir(folder);
    command.env("TONGUE_FIT", cargo_bin("tongue-fit")).output().unwrap().into()
}

/// The record of a run that ends with status 0.
pub fn json(folder: &Path, line: &str) -> Value {
    let done = run(folder, line);
    assert_eq!(done.status, Some(0), "{line}: {}", done.err);
    done.record()
}

/// The record in a file in this folder.
pub fn record(folder: &Path, file: &str) -> Value {
    parsed(&std::fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// Parses a record after checking that its own keys, which are indented by two spaces, are all different.
fn parsed(text: &str) -> serde_json::Result<Value> {
    let mut keys = BTreeSet::new();
    for (key, _) in text.lines().filter_map(|l| l.strip_prefix("  \"")?.split_once("\":")) {
        assert!(keys.insert(key), "{key} is there twice");
    }
    serde_json::from_str(text)
}

/// The Rust sources in a folder of the repository and below it, with their paths.
pub fn sources(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: std::path::PathBuf| match path.is_dir() {
        true => sources(path.to_str().unwrap()),
        false => vec![(path.display().to_string(), std::fs::read_to_string(path).unwrap())],
    };
    paths.flat_map(of).collect()
}

/// Number of files and folders in a folder and below it.
fn files(folder: &Path) -> usize {
    let count = |path: &Path| 1 + if path.is_dir() { files(path) } else { 0 };
    std::fs::read_dir(folder).unwrap().map(|entry| count(&entry.unwrap().path())).sum()
}

/// The only message of a run that ends with this status, prints no result and leaves no file.
pub fn refused_with(status: i32, folder: &Path, line: &str) -> String {
    let before = files(folder);
    let done = run(folder, line);
    assert_eq!((done.status, done.out.as_str()), (Some(status), ""), "{line}: {}", done.err);
    assert_eq!(done.err.matches("error:").count(), 1, "{line}: {}", done.err);
    assert_eq!(files(folder), before, "{line} left something");
    done.message()
}

pub fn refused(folder: &Path, line: &str) -> String {
    refused_with(1, folder, line)
}
