//! The program `tongue-fit` itself, for a process that is nothing else.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with a command line (its name first) and returns its exit status; wrong usage ends the process. Once in a process.
#[pyfunction]
pub fn run_program(words: Vec<OsString>) -> u8 {
    tongue_fit::cli::run(words)
}

/// What is wrong with the usage of a command line (its name first), which is not run; `None` if nothing is.
#[pyfunction]
pub fn wrong_usage(words: Vec<OsString>) -> Option<String> {
    tongue_fit::cli::wrong_usage(words)
}
