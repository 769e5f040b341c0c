//! What a run leaves behind: pictures as SVG text, and files that are either whole or not there.
//!
//! The pictures are functions from numbers to SVG text and touch no file; [`OutputDir`] writes bytes and knows
//! nothing of their meaning.

mod animation;
#[cfg(feature = "files")]
pub mod batch;
mod chart;
mod fields;
mod figure;
#[cfg(feature = "files")]
mod file;
mod msh;
mod picture;
mod record;
mod solid;
#[cfg(feature = "files")]
mod staged;
mod sto;
mod trajectory;
mod vtu;
mod work_precision;

use std::io;
use std::path::PathBuf;

use plotters::drawing::DrawingAreaErrorKind;

pub use animation::{Frame, animation};
pub use chart::{Series, changes};
#[cfg(feature = "files")]
pub use file::{OutputDir, Writes};
pub use msh::msh;
pub use picture::{tongue, tongue_at_wall};
pub use record::{
    BranchRecord, ByMuscle, FitRecord, IdentifiabilityRecord, Segment, SimulationRecord, SomeMuscles,
};
pub use solid::solid;
#[cfg(feature = "files")]
pub use staged::{Standstill, discard_unfinished};
pub use sto::sto;
pub use trajectory::{TrajectoryRecord, lengths_over_time};
pub use vtu::{pvd, vtu};
pub use work_precision::{Curve, work_precision};

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
        "cannot write the file \"{}\": {source}; free some space or choose another folder \
         (an earlier file of that name is unchanged)",
        path.display()
    )]
    File {
        /// The file that was to be written.
        path: PathBuf,
        /// The refusal of the operating system.
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
    /// The drawing library failed.
    #[error("cannot draw the figure \"{title}\": {source}; please report this as a defect")]
    Drawing {
        /// Title of the figure.
        title: String,
        /// The failure.
        source: DrawingAreaErrorKind<io::Error>,
    },
}
