//! Output files that are complete or absent: each is written under a temporary name and renamed.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::ReportError;
use super::atomic_write::{Staged, persist};
use super::clean::Clean;
use super::export::{Export, Provenance};

/// Endings of files of text, in which control characters are escaped.
const TEXT: [&str; 8] = ["csv", "html", "json", "md", "pvd", "sto", "svg", "vtu"];

/// A folder that can be written to. One that was created for it and is empty at its end is removed.
#[derive(Debug)]
pub struct OutputDir {
    path: PathBuf,
    /// The outermost folder that was created.
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
    /// Creates the folder (and its parents) if it is missing, and writes a trial file, so that a long run
    /// does not fail at its end. The empty path is the current folder.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self, ReportError> {
        let path = match path.as_ref() {
            empty if empty.as_os_str().is_empty() => Path::new("."),
            given => given,
        };
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let created = path.ancestors().take_while(is_missing).last().map(Path::to_owned);
        let out = Self { path: path.to_owned(), created };
        fs::create_dir_all(path).and_then(|()| Staged::begin(path)).map(drop).map_err(|source| {
            ReportError::Folder {
                path: path.to_owned(),
                reason: match path.ancestors().find(|p| p.is_file()) {
                    Some(file) => format!("\"{}\" is a file, not a folder", file.display()),
                    None => source.to_string(),
                },
                source,
            }
        })?;
        Ok(out)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a set of files, each given by its name and a function that writes it, and returns their paths in the same order.
    ///
    /// All are written in full under temporary names before the first takes its place, so that a full disk
    /// or a bad name leaves every earlier file as it was. The data is not forced to the disk: a power cut is
    /// not guarded against.
    pub(crate) fn write_streams<'a, W: Fn(&mut dyn Write) -> io::Result<()>>(
        &self,
        files: impl Iterator<Item = (&'a str, W)>,
    ) -> Result<Vec<PathBuf>, ReportError> {
        let mut ready = Vec::new();
        for (name, write) in files {
            let path = self.place(name)?;
            let fail = |source| ReportError::File { path: path.clone(), source };
            // A rename onto a folder fails, and other files of the set would be renamed already.
            if path.is_dir() {
                return Err(fail(io::ErrorKind::IsADirectory.into()));
            }
            let mut file = BufWriter::new(Staged::begin(&self.path).map_err(fail)?);
            let ending = path.extension().and_then(|e| e.to_str());
            match ending.is_some_and(|e| TEXT.contains(&e)) {
                true => write(&mut Clean::new(&mut file)),
                false => write(&mut file),
            }
            .map_err(fail)?;
            let mut staged = file.into_inner().map_err(|e| fail(e.into_error()))?;
            staged.close();
            ready.push((staged, path));
        }
        persist(ready)
    }

    /// Writes a set of files, all of them or none, with the provenance `by`, and returns their paths in the same order.
    pub fn export<'f>(
        &self,
        files: &[(&'f str, &'f dyn Export)],
        by: &Provenance,
    ) -> Result<Vec<PathBuf>, ReportError> {
        self.write_streams(
            files.iter().map(|&(name, content)| (name, move |w: &mut dyn Write| content.write(w, by))),
        )
    }

    fn place(&self, name: &str) -> Result<PathBuf, ReportError> {
        if Path::new(name).file_name().is_some_and(|plain| plain == name) {
            Ok(self.path.join(name))
        } else {
            Err(ReportError::Name { name: name.to_owned() })
        }
    }
}

/// Writes a set of files into a folder, which is created if it is missing: all of them or none. They name
/// `command` as their origin: a command line, or a description by a program that uses the library.
pub fn write(
    folder: impl AsRef<Path>,
    command: &str,
    files: &[(&str, &dyn Export)],
) -> Result<Vec<PathBuf>, ReportError> {
    OutputDir::prepare(folder)?.export(files, &Provenance::new(command))
}

pub type Writes<'a> = dyn Fn(&mut dyn Write) -> io::Result<()> + 'a;

#[cfg(test)]
mod tests {
    use super::*;

    fn write_all(out: &OutputDir, files: &[(&str, &str)]) -> Result<Vec<PathBuf>, ReportError> {
        out.write_streams(
            files.iter().map(|(name, text)| (*name, |w: &mut dyn Write| w.write_all(text.as_bytes()))),
        )
    }

    fn write(out: &OutputDir, name: &str, text: &str) -> Result<PathBuf, ReportError> {
        write_all(out, &[(name, text)]).map(|mut written| written.remove(0))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn one_bad_file_of_a_set_changes_nothing() {
        let root = tempfile::tempdir().unwrap();
        let out = OutputDir::prepare(root.path()).unwrap();
        write(&out, "fit.csv", "old").unwrap();
        fs::create_dir(root.path().join("taken")).unwrap();
        for bad in ["taken", "../fit.csv", "a/b.csv", "", "..", "/etc/x"] {
            let error =
                write_all(&out, &[("fit.csv", "new"), ("fresh.csv", "new"), (bad, "new")]).unwrap_err();
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
        assert_eq!(mode(&write(&out, "fit.csv", "").unwrap()), mode(&ordinary));
    }
}
