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

use std::fmt::Display;

use tongue_core::body::BodyError;
use tongue_core::dynamics::MotionError;
use tongue_core::limits::BeyondLimit;
use tongue_core::system::SystemError;
use tongue_infer::acoustics::VocalTractError;
use tongue_infer::inverse::FitError;
use tongue_input::measured;

pub use file::Scene;
pub use plan::ScenePlan;
pub use run::simulate;
pub use shipped::{names, shipped};

/// The temporomandibular joint of the reference tongue, mm: that of `targets/tract.toml`.
pub const JOINT_MM: [f64; 2] = [92.9, 60.8];

/// Why a scene cannot be planned or run.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    #[error("[surgery]: {0}")]
    Surgery(#[from] crate::surgery::SurgeryError),
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(transparent)]
    Target(#[from] measured::ReadError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error("[tract]: {0}")]
    VocalTract(#[from] VocalTractError),
}

impl SceneError {
    fn contradiction(first: impl Display, second: impl Display, why: impl Display) -> Self {
        Self::Refused(format!("{first} contradicts {second}: {why}"))
    }

    fn value(key: &str, value: f64, must: &str) -> Self {
        Self::Refused(format!("{key} is {value}; it must be {must}"))
    }

    fn unread(key: &str, path: &str, source: &std::io::Error) -> Self {
        Self::Refused(format!("{key}: cannot read \"{path}\": {source}"))
    }
}
