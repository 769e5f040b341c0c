//! Errors of making and writing outputs.

use std::io;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    #[error(
        "cannot write into the output folder \"{}\": {reason}; choose another folder, or make this one writable",
        path.display()
    )]
    Folder { path: PathBuf, reason: String, source: io::Error },
    #[error(
        "cannot write the file \"{}\": {source}; {} (an earlier file of that name is unchanged)",
        path.display(),
        remedy(source)
    )]
    File { path: PathBuf, source: io::Error },
    #[error("cannot use the journal \"{}\": {source}{}", path.display(), remedy_of_journal(source))]
    Journal { path: PathBuf, source: io::Error },
    #[error("\"{name}\" is not a plain file name; give a name without a folder")]
    Name { name: String },
    #[error("the mesh has {nodes} nodes, but the deformed shape {deformed}; pass the positions of this mesh")]
    NodeCount { nodes: usize, deformed: usize },
    #[error("the {shape} position of node {node} is ({x}, {y}) m; it must be finite and within 1000 m")]
    Position { shape: &'static str, node: usize, x: f64, y: f64 },
    #[error("cannot write the record of a fit: {reason}; please report this as a defect")]
    Record { reason: String },
    #[error("{what} names {kind} {number}, but the mesh has {count} (counted from 0); correct the number")]
    Number { what: String, kind: &'static str, number: usize, count: usize },
    #[error("a motion needs at least one frame; got none")]
    NoFrame,
    #[error(
        "a chart needs at least one label and 1 to {most} series; got {labels} labels and {series} series"
    )]
    ChartShape { labels: usize, series: usize, most: usize },
    #[error("the series \"{series}\" has {values} values for {labels} labels; give one value for each label")]
    SeriesLength { series: String, values: usize, labels: usize },
    #[error(
        "the value of \"{label}\" in the series \"{series}\" is {value}; \
         a ratio of lengths must be positive, finite and at most 100"
    )]
    Ratio { series: String, label: String, value: f64 },
    #[error("a diagram needs 1 to {most} curves with a positive, finite point each; got {curves}")]
    Curves { curves: usize, most: usize },
}

/// Advice for a journal that cannot grow; other errors contain theirs.
fn remedy_of_journal(refusal: &io::Error) -> String {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match refusal.kind() {
        StorageFull | QuotaExceeded | FileTooLarge => {
            format!(
                "; {}. The fits that it has are kept: the same command resumes after them",
                remedy(refusal)
            )
        }
        _ => String::new(),
    }
}

fn remedy(refusal: &io::Error) -> &'static str {
    use io::ErrorKind::{FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    match refusal.kind() {
        StorageFull | QuotaExceeded => "free some space or choose another folder",
        FileTooLarge => "raise the limit of file sizes (ulimit -f) or choose another folder",
        PermissionDenied | ReadOnlyFilesystem => "choose another folder, or make this one writable",
        // EMFILE and ENFILE have no `ErrorKind`.
        _ if matches!(refusal.raw_os_error(), Some(23 | 24)) => {
            "allow the program more open files (ulimit -n) or close others"
        }
        _ => "choose another folder",
    }
}
