//! Long work: without Python's lock, on threads that the process itself started, and stopped by Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::errors::wrong;

/// How often Ctrl-C is looked for.
const EVERY: Duration = Duration::from_millis(20);

/// More threads than this are surely a slip.
const MOST_THREADS: usize = 1024;

/// The threads for work that asks for no number of them, and the process that started them. Locked only while Python's lock is held,
/// so a fork never finds it locked.
static SHARED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Threads to work on: `threads` of them, or those that all such work shares. After a fork the child has none of its parent's
/// threads, so it starts its own.
///
/// # Errors
/// No or too many threads; the operating system's where it starts no more.
pub fn pool(_py: Python<'_>, threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    if threads.is_some_and(|n| n == 0 || n > MOST_THREADS) {
        return Err(wrong(format!("threads must be from 1 to {MOST_THREADS}")));
    }
    let start = |count: Option<usize>| {
        let made = ThreadPoolBuilder::new().num_threads(count.unwrap_or(0)).build();
        let asked = count.map_or_else(String::new, |n| format!("{n} "));
        made.map(Arc::new)
            .map_err(|e| wrong(format!("cannot start {asked}threads: {e}; ask for fewer (threads=)")))
    };
    if threads.is_some() {
        return start(threads);
    }
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*shared
        && *process == std::process::id()
    {
        return Ok(Arc::clone(pool));
    }
    let pool = start(None)?;
    // Ending the parent's pool would wait for threads that are not there.
    std::mem::forget(shared.replace((std::process::id(), Arc::clone(&pool))));
    Ok(pool)
}

/// Does `work` on a thread of its own while others may use Python; what it does in parallel is done by the threads that all such work
/// shares. After Ctrl-C the answer is waited for no longer: the thread ends by itself, and what it finds is dropped.
///
/// # Errors
/// `KeyboardInterrupt`; a `RuntimeError` where the work panics, which is a defect.
pub fn aside<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    aside_on(py, &pool(py, None)?, work)
}

/// The same on the threads of a pool.
///
/// # Errors
/// As [`aside`].
pub fn aside_on<T: Send + 'static>(
    py: Python<'_>,
    pool: &Arc<ThreadPool>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let threads = Arc::clone(pool);
    let done = alone(py, move || threads.install(work));
    if done.is_err() {
        give_up(pool);
    }
    done
}

/// Leaves the shared threads to what still runs on them; later work gets others.
pub fn give_up(pool: &Arc<ThreadPool>) {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if shared.as_ref().is_some_and(|(_, current)| Arc::ptr_eq(current, pool)) {
        *shared = None;
    }
}

/// Does `work`, which does nothing in parallel, on a thread of its own, as [`aside`] does.
///
/// # Errors
/// As [`aside`].
pub fn alone<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
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
