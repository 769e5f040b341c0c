//! Files that are written under a temporary name and then renamed. No temporary file is left behind, also
//! when the program is interrupted.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile, TempPath};

use super::ReportError;

/// The temporary names in use by this process. A static, because a signal concerns the process.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Guard: while it exists, no file is begun or renamed.
#[derive(Debug)]
pub struct InterruptGuard {
    _lock: MutexGuard<'static, BTreeSet<PathBuf>>,
}

/// Removes all unfinished files in all folders, and prevents that files are begun or renamed while the result
/// exists: for a program that is about to stop. A set of files ([`OutputDir::export`](super::OutputDir::export))
/// is then complete or absent.
///
/// A thread that is writing a file fails, or waits for the end of the program.
#[must_use = "files are begun again once it is dropped"]
pub fn discard_unfinished() -> InterruptGuard {
    let mut unfinished = unfinished();
    for path in std::mem::take(&mut *unfinished) {
        // A file that cannot be removed stays, because the program is about to end.
        let _ = fs::remove_file(path);
    }
    InterruptGuard { _lock: unfinished }
}

/// A file under a temporary name, which is removed unless it is renamed.
#[derive(Debug)]
pub(super) struct Staged {
    file: Option<NamedTempFile>,
    /// The closed file before it is renamed. Closing keeps the number of open files below the limit of a
    /// process.
    closed: Option<TempPath>,
}

impl Staged {
    /// Begins a file in the folder with the permissions of an ordinary file (by the umask), not with a
    /// temporary file's 0600.
    pub(super) fn begin(folder: &Path) -> io::Result<Self> {
        let mut builder = Builder::new();
        builder.prefix(".tongue-fit-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut unfinished = unfinished();
        let file = builder.tempfile_in(folder)?;
        unfinished.insert(file.path().to_owned());
        Ok(Self { file: Some(file), closed: None })
    }

    pub(super) fn close(&mut self) {
        if let Some(file) = self.file.take() {
            self.closed = Some(file.into_temp_path());
        }
    }
}

impl Write for Staged {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().map_or(Ok(0), |f| f.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        self.close();
        if let Some(path) = self.closed.take() {
            unfinished().remove(&*path);
        }
    }
}

pub(super) fn persist(mut ready: Vec<(Staged, PathBuf)>) -> Result<Vec<PathBuf>, ReportError> {
    // Held until the end, so that an interruption cannot separate the files of a set.
    let mut unfinished = unfinished();
    let mut written = Vec::with_capacity(ready.len());
    for (staged, path) in &mut ready {
        staged.close();
        let Some(file) = staged.closed.take() else { continue };
        unfinished.remove(&*file);
        match file.persist(&*path) {
            Ok(()) => written.push(path.clone()),
            Err(refused) => return Err(ReportError::File { path: path.clone(), source: refused.error }),
        }
    }
    Ok(written)
}
