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

pub use file::Scene;
pub use plan::ScenePlan;
pub use run::simulate;
pub use shipped::{names, shipped};

/// The temporomandibular joint of the reference tongue, mm: that of `targets/tract.toml`.
pub const JOINT_MM: [f64; 2] = [92.9, 60.8];
