//! What the program finds out about itself: what accuracy costs in time, and what becomes of hard cases.

pub mod accuracy;
pub mod continuum;
pub mod hard_cases;
mod pulled;
mod table;
pub mod validate;

use tongue_core::body::BodyError;
use tongue_core::dynamics::{MethodError, MotionError};
use tongue_core::system::SystemError;
use tongue_files::report::ReportError;
use tongue_infer::inverse::FitError;
use tongue_input::measured::{TargetError, lengths};

pub use pulled::{PUBLISHED_A, Pulled, pulling};

/// Why a study cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A body that should be there.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A system of a good body.
    #[error(transparent)]
    System(#[from] SystemError),
    /// A fit that cannot begin.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The equations of motion.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A step or a tolerance.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The table of lengths.
    #[error(transparent)]
    Lengths(#[from] lengths::Error),
    /// A vowel.
    #[error(transparent)]
    Vowel(#[from] lengths::BadLabel),
    /// What is to be met.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The equilibrium that errors are measured against is not good enough: its residual force, N.
    #[error("the reference equilibrium leaves a force of {0:e} N, too much to measure errors against")]
    Reference(f64),
    /// Nor is the trajectory; why.
    #[error("the reference trajectory was not found: {0}")]
    Trajectory(String),
    /// The cells of a table.
    #[error("a table cannot be made: {0}")]
    Csv(#[from] csv::Error),
    /// A diagram.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// Threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
}
