//! Long computations run without Python's lock, on threads of this process, and stop on Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::errors::wrong;

/// Interval between checks for Ctrl-C.
const EVERY: Duration = Duration::from_millis(20);

const MOST_THREADS: usize = 1024;

/// The threads that calls share if they do not ask for a number, and the process that started them. The mutex is locked only while Python's
/// lock is held, so that a fork never finds it locked.
static SHARED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// A pool of `threads` threads, or the shared one. After a fork the child has none of its parent's threads and starts its own.
///
/// # Errors
/// Zero or too many threads; the error of the operating system if it cannot start them.
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
    // Dropping the parent's pool would wait for threads that do not exist in the child.
    std::mem::forget(shared.replace((std::process::id(), Arc::clone(&pool))));
    Ok(pool)
}

/// Runs `work` on a thread of its own while other threads may use Python; its parallel parts run on the shared threads. After Ctrl-C the
/// call returns; the thread ends by itself, and its result is dropped.
///
/// # Errors
/// `KeyboardInterrupt`; a `RuntimeError` if the work panics, which is a defect.
pub fn aside<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    aside_on(py, &pool(py, None)?, work)
}

/// [`aside`] with the threads of a given pool; its errors are the same.
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

/// Leaves the shared threads to the work that still runs on them; later work gets new threads.
pub fn give_up(pool: &Arc<ThreadPool>) {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if shared.as_ref().is_some_and(|(_, current)| Arc::ptr_eq(current, pool)) {
        *shared = None;
    }
}

/// [`aside`] for work without parallel parts; its errors are the same.
pub fn alone<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (sender, mut receiver) = channel();
    std::thread::spawn(move || sender.send(catch_unwind(AssertUnwindSafe(work))));
    next(py, &mut receiver)?.ok_or_else(defect)?.map_err(|_| defect())
}

/// The next message; `None` after the last one.
///
/// # Errors
/// `KeyboardInterrupt`.
pub fn next<T: Send>(py: Python<'_>, receiver: &mut Receiver<T>) -> PyResult<Option<T>> {
    loop {
        // A new reference, because a shared one must not be used without Python's lock.
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

pub fn defect() -> PyErr {
    PyRuntimeError::new_err("tongue-fit has a defect; please report this with your input")
}
