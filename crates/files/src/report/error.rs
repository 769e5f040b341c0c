//! Errors of making and writing outputs.

use std::io;
use std::path::PathBuf;

/// Why an output could not be made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The output folder cannot be created or written to.
    #[error(
        "cannot write into the output folder \"{}\": {reason}; choose another folder, or make this one writable",
        path.display()
    )]
    Folder {
        /// The folder asked for.
        path: PathBuf,
        /// What stands in the way.
        reason: String,
        /// The refusal of the operating system.
        source: io::Error,
    },
    /// A file could not be written; what was there before is untouched.
    #[error(
        "cannot write the file \"{}\": {source}; {} (an earlier file of that name is unchanged)",
        path.display(),
        remedy(source)
    )]
    File {
        /// The file that was to be written.
        path: PathBuf,
        /// The refusal of the operating system.
        source: io::Error,
    },
    /// A journal that cannot be gone on with or read.
    #[error("cannot use the journal \"{}\": {source}{}", path.display(), remedy_of_journal(source))]
    Journal {
        /// Its file.
        path: PathBuf,
        /// What stands in the way.
        source: io::Error,
    },
    /// An output name that would leave the output folder.
    #[error("\"{name}\" is not a plain file name; give a name without a folder")]
    Name {
        /// The name given.
        name: String,
    },
    /// The deformed shape belongs to another mesh.
    #[error("the mesh has {nodes} nodes, but the deformed shape {deformed}; pass the positions of this mesh")]
    NodeCount {
        /// Nodes of the mesh.
        nodes: usize,
        /// Positions given.
        deformed: usize,
    },
    /// A position that cannot be drawn.
    #[error("the {shape} position of node {node} is ({x}, {y}) m; it must be finite and within 1000 m")]
    Position {
        /// `rest` or `deformed`.
        shape: &'static str,
        /// Node number, 0-based.
        node: usize,
        /// Coordinate, m.
        x: f64,
        /// Coordinate, m.
        y: f64,
    },
    /// A record that has no text form.
    #[error("cannot write the record of a fit: {reason}; please report this as a defect")]
    Record {
        /// The refusal of the format.
        reason: String,
    },
    /// Something names a node or a muscle that the mesh does not have.
    #[error("{what} names {kind} {number}, but the mesh has {count} (counted from 0); correct the number")]
    Number {
        /// Who names it, e.g. `muscle GGa`.
        what: String,
        /// `node` or `muscle`.
        kind: &'static str,
        /// The number named.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// A motion without any frame.
    #[error("a motion needs at least one frame; got none")]
    NoFrame,
    /// A chart without bars, or with more series than can be told apart.
    #[error(
        "a chart needs at least one label and 1 to {most} series; got {labels} labels and {series} series"
    )]
    ChartShape {
        /// Labels given.
        labels: usize,
        /// Series given.
        series: usize,
        /// How many series can be told apart.
        most: usize,
    },
    /// A series with more or fewer values than there are labels.
    #[error("the series \"{series}\" has {values} values for {labels} labels; give one value for each label")]
    SeriesLength {
        /// Name of the series.
        series: String,
        /// Its number of values.
        values: usize,
        /// Number of labels.
        labels: usize,
    },
    /// A value that is no ratio of lengths.
    #[error(
        "the value of \"{label}\" in the series \"{series}\" is {value}; \
         a ratio of lengths must be positive, finite and at most 100"
    )]
    Ratio {
        /// Name of the series.
        series: String,
        /// Label of the bar.
        label: String,
        /// The value, dimensionless.
        value: f64,
    },
    /// A diagram without a point, or with more curves than can be told apart.
    #[error("a diagram needs 1 to {most} curves with a positive, finite point each; got {curves}")]
    Curves {
        /// Curves with something to draw.
        curves: usize,
        /// How many can be told apart.
        most: usize,
    },
}

/// What helps where a journal cannot grow; its other refusals say it themselves.
fn remedy_of_journal(refusal: &io::Error) -> String {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match refusal.kind() {
        StorageFull | QuotaExceeded | FileTooLarge => {
            format!(
                "; {}. The fits that it has are kept: the same command goes on after them",
                remedy(refusal)
            )
        }
        _ => String::new(),
    }
}

/// What helps against a refusal of the operating system.
fn remedy(refusal: &io::Error) -> &'static str {
    use io::ErrorKind::{FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    match refusal.kind() {
        StorageFull | QuotaExceeded => "free some space or choose another folder",
        FileTooLarge => "raise the limit of file sizes (ulimit -f) or choose another folder",
        PermissionDenied | ReadOnlyFilesystem => "choose another folder, or make this one writable",
        // EMFILE and ENFILE, which have no kind of their own.
        _ if matches!(refusal.raw_os_error(), Some(23 | 24)) => {
            "allow the program more open files (ulimit -n) or close others"
        }
        _ => "choose another folder",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn advice_fits_the_refusal() {
        for (number, word) in
            [(28, "free some space"), (24, "ulimit"), (13, "writable"), (21, "choose another")]
        {
            let source = io::Error::from_raw_os_error(number);
            let said = ReportError::File { path: "fit.csv".into(), source }.to_string();
            assert!(said.contains(word), "{number}: {said}");
        }
    }
}
