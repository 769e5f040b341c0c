//! Output files that are complete or absent, even after an interruption: each is written under a temporary name and then renamed.

use std::borrow::Borrow;
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::ReportError;
use super::escape_control::EscapeControl;
use super::export::{Export, Provenance};

/// Endings of text files, in which control characters are escaped.
const TEXT: [&str; 8] = ["csv", "html", "json", "md", "pvd", "sto", "svg", "vtu"];

/// A folder that can be written to. If it was created here and is empty at the end, it is removed.
#[derive(Debug)]
pub struct OutputDir {
    path: PathBuf,
    /// The outermost folder that was created here.
    created: Option<PathBuf>,
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        let Some(created) = &self.created else { return };
        let folders = self.path.ancestors().take_while(|folder| folder.starts_with(created));
        folders.take_while(|folder| fs::remove_dir(folder).is_ok()).for_each(drop);
    }
}

impl OutputDir {
    /// Creates the folder and its parents if they are missing, and writes a trial file, so that a long run does not fail at its end. The
    /// empty path is the current folder.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self, ReportError> {
        let path = match path.as_ref() {
            empty if empty.as_os_str().is_empty() => Path::new("."),
            given => given,
        };
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let created = path.ancestors().take_while(is_missing).last().map(Path::to_owned);
        let out = Self { path: path.to_owned(), created };
        let tried = fs::create_dir_all(path).and_then(|()| begin(path));
        tried.map(|trial| _ = unfinished().remove(trial.path())).map_err(|source| ReportError::Folder {
            path: path.to_owned(),
            reason: match path.ancestors().find(|p| p.is_file()) {
                Some(file) => format!("\"{}\" is a file, not a folder", file.display()),
                None => source.to_string(),
            },
            source,
        })?;
        Ok(out)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a set of files with the provenance `by`, and returns their paths in the same order. All are written in full under temporary
    /// names before the first is renamed, so that a full disk or a bad name leaves all earlier files as they were. The data is not forced to
    /// the disk, so that a power cut may lose it.
    pub fn export<'a>(
        &self,
        files: &[(impl AsRef<str>, impl Borrow<dyn Export + 'a>)],
        by: &Provenance,
    ) -> Result<Vec<PathBuf>, ReportError> {
        let mut ready = Vec::new();
        for (name, content) in files {
            let (name, content) = (name.as_ref(), content.borrow());
            if Path::new(name).file_name().is_none_or(|plain| plain != name) {
                return Err(ReportError::Name { name: name.to_owned() });
            }
            let path = self.path.join(name);
            let fail = |source| ReportError::File { path: path.clone(), source };
            // Renaming onto a folder would fail after other files of the set were renamed.
            if path.is_dir() {
                return Err(fail(io::ErrorKind::IsADirectory.into()));
            }
            let mut file = BufWriter::new(begin(&self.path).map_err(fail)?);
            let ending = path.extension().and_then(|e| e.to_str());
            if ending.is_some_and(|e| TEXT.contains(&e)) {
                content.write(&mut EscapeControl::new(&mut file), by)
            } else {
                content.write(&mut file, by)
            }
            .map_err(fail)?;
            // Closed, to keep the number of open files below the limit of a process.
            ready.push((file.into_inner().map_err(|e| fail(e.into_error()))?.into_temp_path(), path));
        }
        // Locked until the end, so that an interruption cannot separate the files of a set.
        let mut unfinished = unfinished();
        let renamed = ready.into_iter().map(|(file, path)| {
            unfinished.remove(&*file);
            match file.persist(&path) {
                Ok(()) => Ok(path),
                Err(refused) => Err(ReportError::File { path, source: refused.error }),
            }
        });
        renamed.collect()
    }
}

/// Writes a set of files, all or none, into a folder, which is created if it is missing. `command` is their origin: a command line, or a
/// description by a program that uses the library.
pub fn write(
    folder: impl AsRef<Path>,
    command: &str,
    files: &[(&str, &dyn Export)],
) -> Result<Vec<PathBuf>, ReportError> {
    OutputDir::prepare(folder)?.export(files, &Provenance::new(command))
}

/// Temporary names that this process has begun and not renamed, whether or not the file still exists; static, because a signal concerns
/// the whole process.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all unfinished files in all folders; no file is begun or renamed while the result exists. For a program that is about to stop: a
/// set of files ([`OutputDir::export`](super::OutputDir::export)) is then complete or absent.
///
/// A thread that is writing a file fails, or waits for the end of the program.
#[must_use = "files are begun again once it is dropped"]
pub fn discard_unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    let mut unfinished = unfinished();
    for path in std::mem::take(&mut *unfinished) {
        // A file that cannot be removed stays, because the program is about to end.
        let _ = fs::remove_file(path);
    }
    unfinished
}

/// Begins a file under a temporary name, which is removed unless it is renamed. It has the permissions of an ordinary file (by the umask),
/// not a temporary file's 0600.
fn begin(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".tongue-fit-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut unfinished = unfinished();
    let file = builder.tempfile_in(folder)?;
    unfinished.insert(file.path().to_owned());
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write_all(out: &OutputDir, names: &[&str], text: &str) -> Result<Vec<PathBuf>, ReportError> {
        let text = text.to_owned();
        let files: Vec<_> = names.iter().map(|name| (*name, &text as &dyn Export)).collect();
        out.export(&files, &Provenance::new("a test"))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names = Vec::from_iter(
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()),
        );
        names.sort();
        names
    }

    #[test]
    fn one_bad_file_of_a_set_changes_nothing() {
        let root = tempfile::tempdir().unwrap();
        let out = OutputDir::prepare(root.path()).unwrap();
        write_all(&out, &["fit.csv"], "old").unwrap();
        fs::create_dir(root.path().join("taken")).unwrap();
        for bad in ["taken", "../fit.csv", "a/b.csv", "", "..", "/etc/x"] {
            let error = write_all(&out, &["fit.csv", "fresh.csv", bad], "new").unwrap_err();
            assert!(error.to_string().contains(bad), "{error}");
            assert_eq!(fs::read_to_string(root.path().join("fit.csv")).unwrap(), "old");
            assert_eq!(names(root.path()), ["fit.csv", "taken"]);
        }
    }

    #[cfg(unix)]
    #[test]
    fn files_have_the_permissions_of_an_ordinary_file() {
        use std::os::unix::fs::PermissionsExt;
        let root = tempfile::tempdir().unwrap();
        let out = OutputDir::prepare(root.path()).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let ordinary = root.path().join("ordinary");
        fs::write(&ordinary, "").unwrap();
        assert_eq!(mode(&write_all(&out, &["fit.csv"], "").unwrap()[0]), mode(&ordinary));
    }
}
