//! Scenes: what happens and what is wanted. The plan decides what must be computed for it; nothing else is computed.
//!
//! [`mod@file`] is the scene as it is written, [`body`] the body that it names, [`plan`] what is simulated and what is left
//! out and why, [`prepare`] the system made after it, [`points`] tensions from what was seen, [`run`] the result, [`compare`] what
//! pruning saves, [`sound`] what is heard.

pub mod body;
mod check;
pub mod compare;
pub mod file;
pub mod plan;
pub mod points;
pub mod prepare;
pub mod run;
mod shipped;
pub mod sound;

use tongue_core::body::BodyError;
use tongue_core::dynamics::{MethodError, MotionError};
use tongue_core::material::MaterialError;
use tongue_core::statics;
use tongue_core::suggest;
use tongue_core::system::SystemError;
use tongue_infer::heard::AirwayError;
use tongue_infer::inverse::FitError;
use tongue_input::measured;

pub use file::Scene;
pub use plan::Plan;
pub use run::simulate;
pub use shipped::{names, shipped};

/// The temporomandibular joint of the reference tongue, mm: drawn, not traced, 110 mm from the mental spine.
pub const JOINT_MM: [f64; 2] = [70.0, 85.0];

/// Why a scene cannot be planned or run.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The text is no scene.
    #[error("{origin}:{line}:{column}: {problem}")]
    Syntax {
        /// The file, or what stands for it.
        origin: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong.
        problem: String,
    },
    /// No scene of that name is shipped.
    #[error("unknown scene \"{name}\"; {}", suggest::hint(name, shipped::names()))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// Two things that exclude each other.
    #[error("{first} contradicts {second}: {why}")]
    Contradiction {
        /// One.
        first: String,
        /// The other.
        second: String,
        /// Why, and what to do.
        why: String,
    },
    /// A number out of its range.
    #[error("{key} is {value}; it must be {must}")]
    Value {
        /// The key in the scene file.
        key: &'static str,
        /// Its value.
        value: f64,
        /// The accepted range.
        must: &'static str,
    },
    /// The body cannot be made or read.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The file of the body gives none.
    #[error(transparent)]
    BodyFile(#[from] tongue_input::bodies::BodyFileError),
    /// Constants out of their range.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The system cannot be made.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The target cannot be read.
    #[error(transparent)]
    Target(#[from] measured::TargetError),
    /// A name that is no vowel.
    #[error(transparent)]
    Vowel(#[from] measured::lengths::BadLabel),
    /// A name that is no kind of target.
    #[error(transparent)]
    Kind(#[from] measured::UnknownTargetKind),
    /// The fit cannot begin.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The body cannot be set in motion.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The bones cannot be brought to where a trajectory starts.
    #[error(
        "effects.jaw and effects.hyoid: the bones could not be brought to their places before the motion began \
         ({status:?}); move them less far, or the wall out of their way"
    )]
    NotCarried {
        /// How the equilibrium on the way there ended.
        status: statics::Status,
    },
    /// The tract cannot be read, or its walls meet.
    #[error("[tract]: {0}")]
    Airway(#[from] AirwayError),
    /// The file of a tract cannot be read.
    #[error("tract.file: cannot read \"{path}\": {source}")]
    TractFile {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The motion cannot be followed with this tolerance.
    #[error(transparent)]
    Method(#[from] MethodError),
}

impl SceneError {
    fn contradiction(first: impl Into<String>, second: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Contradiction { first: first.into(), second: second.into(), why: why.into() }
    }
}
