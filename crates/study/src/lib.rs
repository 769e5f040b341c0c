//! Studies of the program: accuracy against time, hard cases, and validation on measurements.

pub mod accuracy;
pub mod continuum;
pub mod hard_cases;
pub mod plane;
mod pulled;
mod table;
pub mod validate;

use tongue_core::body::BodyError;
use tongue_core::dynamics::MotionError;
use tongue_core::system::SystemError;
use tongue_files::report::ReportError;
use tongue_infer::inverse::FitError;
use tongue_infer::posterior::PosteriorError;
use tongue_input::measured::{Vowel, lengths};

pub use pulled::{PUBLISHED_A, Pulled, pulling};

/// Why a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A body cannot be made.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A system cannot be made.
    #[error(transparent)]
    System(#[from] SystemError),
    /// A fit cannot begin.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The equations of motion cannot be set up.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The table of lengths cannot be read, or makes no target.
    #[error(transparent)]
    Lengths(#[from] lengths::LengthsError),
    /// A vowel is unknown.
    #[error(transparent)]
    Vowel(#[from] lengths::BadLabel),
    /// The residual force of the reference equilibrium is too large; N.
    #[error("the reference equilibrium leaves a force of {0:e} N, too much to measure errors against")]
    Reference(f64),
    /// The reference trajectory was not found, with the reason.
    #[error("the reference trajectory was not found: {0}")]
    Trajectory(String),
    /// A built-in table cannot be read.
    #[error("a built-in table cannot be read: {0}")]
    Csv(#[from] csv::Error),
    /// A table cannot be written.
    #[error("a table cannot be made: {0}")]
    Table(#[from] serde_json::Error),
    /// A diagram cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// Too few subjects.
    #[error(
        "{subjects} subject{} of {origin} {} a row for /{baseline}/ and another vowel with passive muscles; two or more are needed to \
         predict one from the others (--baseline names another vowel)",
        if *subjects == 1 { "" } else { "s" },
        if *subjects == 1 { "has" } else { "have" }
    )]
    Subjects {
        /// How many can be used.
        subjects: usize,
        /// The table.
        origin: String,
        /// The baseline.
        baseline: Vowel,
    },
    /// The posterior.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
    /// Threads cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(String),
}
