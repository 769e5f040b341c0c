//! Starts the program as a user does.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;

/// Status and output of a run.
pub struct Done {
    pub status: Option<i32>,
    pub out: String,
    pub err: String,
}

impl From<Output> for Done {
    fn from(output: Output) -> Self {
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(!err.contains("panicked"), "{err}");
        Self { status: output.status.code(), out, err }
    }
}

impl Done {
    /// The record that `--json` prints, whatever the status.
    pub fn record(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}{}", self.out, self.err))
    }

    /// The message without the line breaks of the terminal.
    pub fn message(&self) -> String {
        self.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
    }
}

/// The program with the words of a line; a word with spaces is put in apostrophes.
pub fn program(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(cargo_bin("tongue-fit"));
    for (number, part) in line.split('\'').enumerate() {
        match number % 2 {
            0 => command.args(part.split_whitespace()),
            _ => command.arg(part),
        };
    }
    command.current_dir(folder).stdin(Stdio::null());
    command
}

pub fn run(folder: &Path, line: &str) -> Done {
    program(folder, line).output().unwrap().into()
}

/// Runs a line of the shell in which `$TONGUE_FIT` is the program; all output together.
#[cfg(unix)]
pub fn shell(folder: &Path, line: &str) -> Done {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("{{ {line}; }} 2>&1")]).current_dir(folder);
    command.env("TONGUE_FIT", cargo_bin("tongue-fit")).output().unwrap().into()
}

/// The record of a run that ends with 0.
pub fn json(folder: &Path, line: &str) -> Value {
    let done = run(folder, line);
    assert_eq!(done.status, Some(0), "{line}: {}", done.err);
    done.record()
}

/// The record in a file of a run in its folder.
pub fn record(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(file)).unwrap()).unwrap()
}

/// The sources of Rust in a folder of the repository and those in it, with their paths.
pub fn sources(folder: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: std::path::PathBuf| match path.is_dir() {
        true => sources(path.to_str().unwrap()),
        false => vec![(path.display().to_string(), std::fs::read_to_string(path).unwrap())],
    };
    paths.flat_map(of).collect()
}

/// Names of the files in a folder, in order; none if there is no folder.
pub fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Number of files and folders in a folder and those in it.
fn files(folder: &Path) -> usize {
    let count = |path: &Path| 1 + if path.is_dir() { files(path) } else { 0 };
    std::fs::read_dir(folder).unwrap().map(|entry| count(&entry.unwrap().path())).sum()
}

/// The only message of a run that ends with this status, prints nothing and leaves no file.
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
