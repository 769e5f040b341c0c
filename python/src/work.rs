//! Long work: without Python's lock, and stopped by Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How often Ctrl-C is looked for.
const EVERY: Duration = Duration::from_millis(20);

/// Does `work` on a thread of its own while others may use Python. After Ctrl-C the answer is waited for no longer: the thread ends
/// by itself, and what it finds is dropped.
///
/// # Errors
/// `KeyboardInterrupt`; a `RuntimeError` where the work panics, which is a defect.
pub fn aside<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (sender, mut receiver) = channel();
    std::thread::spawn(move || sender.send(catch_unwind(AssertUnwindSafe(work))));
    next(py, &mut receiver)?.ok_or_else(defect)?.map_err(|_| defect())
}

/// What is sent next; `None` when nothing will come any more.
///
/// # Errors
/// `KeyboardInterrupt`.
pub fn next<T: Send>(py: Python<'_>, receiver: &mut Receiver<T>) -> PyResult<Option<T>> {
    loop {
        // By a reference of its own: one that is shared could not go where Python's lock is not held.
        let wait = || {
            let own: &mut Receiver<T> = &mut *receiver;
            own.recv_timeout(EVERY)
        };
        match py.detach(wait) {
            Ok(item) => return Ok(Some(item)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
        }
    }
}

/// The exception for a panic.
pub fn defect() -> PyErr {
    PyRuntimeError::new_err(
        "tongue-fit failed where it never should; please report it with what was asked for",
    )
}
