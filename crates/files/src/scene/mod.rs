//! Scenes: loads and wanted results. The plan decides what must be computed; nothing else is computed.
//!
//! [`mod@file`] is the scene file, [`body`] its body, [`plan`] what is simulated and what is left out and
//! why, [`prepare`] the system for it, [`points`] tensions from measured points, [`run`] the result,
//! [`sound`] the sound.

mod airway;
pub mod body;
mod check;
pub mod effects;
pub mod file;
mod loads;
mod outcome;
pub mod plan;
pub mod points;
pub mod prepare;
pub mod run;
mod shipped;
pub mod sound;
mod tongue_in_space;
pub mod tract;

use tongue_core::body::BodyError;
use tongue_core::dynamics::MotionError;
use tongue_core::limits::BeyondLimit;
use tongue_core::statics;
use tongue_core::suggest;
use tongue_core::system::SystemError;
use tongue_infer::heard::AirwayError;
use tongue_infer::inverse::FitError;
use tongue_input::measured;

pub use file::Scene;
pub use plan::ScenePlan;
pub use run::simulate;
pub use shipped::{names, shipped};

/// The temporomandibular joint of the reference tongue, mm: estimated, 110 mm from the mental spine.
pub const JOINT_MM: [f64; 2] = [70.0, 85.0];

/// Why a scene cannot be planned or run.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    #[error("{origin}:{line}:{column}: {problem}")]
    Syntax {
        origin: String,
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        problem: String,
    },
    #[error("unknown scene \"{name}\"; {}", suggest::hint(name, shipped::names()))]
    Unknown { name: String },
    #[error("{first} contradicts {second}: {why}")]
    Contradiction { first: String, second: String, why: String },
    #[error("{key} is {value}; it must be {must}")]
    Value { key: &'static str, value: f64, must: &'static str },
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    #[error("{key}: {beyond}")]
    Beyond { key: &'static str, beyond: BeyondLimit },
    #[error("activations: {0}")]
    Activation(#[from] tongue_core::body::space::BadActivation),
    #[error("[surgery]: {0}")]
    Surgery(#[from] crate::surgery::SurgeryError),
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error(transparent)]
    BodyFile(#[from] tongue_input::bodies::BodyFileError),
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(transparent)]
    Target(#[from] measured::ReadError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(
        "effects.jaw and effects.hyoid: the bones could not be brought to their places before the motion began \
         ({status:?}); move them less far, or the wall out of their way"
    )]
    NotCarried { status: statics::SolveStatus },
    #[error("[tract]: {0}")]
    Airway(#[from] AirwayError),
    #[error("body.tongue-in-space.file: cannot read \"{path}\": {source}")]
    MeshFile { path: String, source: std::io::Error },
    #[error("tract.file: cannot read \"{path}\": {source}")]
    TractFile { path: String, source: std::io::Error },
}

impl SceneError {
    fn contradiction(first: impl Into<String>, second: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Contradiction { first: first.into(), second: second.into(), why: why.into() }
    }
}
