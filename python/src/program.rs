//! The program `tongue-fit`: in a process of its own, and as calls within a process.

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;

use super::work::alone;

/// Runs the program with a command line (its name first) and returns its exit status; wrong usage ends the process. Once in a process.
#[pyfunction]
pub fn run_program(words: Vec<OsString>) -> u8 {
    tongue_fit::cli::run(words)
}

/// Runs a command line (the program's name first) on threads of its own while other threads may use Python. Returns its exit status, its
/// standard output, and its standard error. After Ctrl-C it ends at its next report of progress.
#[pyfunction]
pub fn call_program(py: Python<'_>, words: Vec<OsString>) -> PyResult<(u8, String, String)> {
    let stop = Arc::new(AtomicBool::new(false));
    let of_call = Arc::clone(&stop);
    let called = alone(py, move || tongue_fit::cli::call(words, &of_call));
    stop.store(called.is_err(), Ordering::Relaxed);
    called.map(|c| (c.status, c.stdout, c.stderr))
}
