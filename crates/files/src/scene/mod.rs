//! Scenes: loads and wanted results. A plan decides what must be computed, and nothing else is.
//!
//! [`mod@file`] is the scene file, [`body`] its body, [`plan`] what is simulated and what is left out and why, [`prepare`] the system for
//! it, [`loads`] what acts on it beside its muscles and tensions from measured points, [`run`] the result, [`vocal_tract`] the tract and
//! its sound.

pub mod body;
mod check;
pub mod effects;
pub mod file;
pub mod loads;
mod outcome;
pub mod plan;
pub mod prepare;
pub mod run;
pub mod vocal_tract;

pub use file::{Scene, names, shipped};
pub use plan::{ScenePlan, force_unit};
pub use run::simulate;

/// The temporomandibular joint of the reference tongue, mm: that of `targets/tract.toml`.
pub const JOINT_MM: [f64; 2] = [92.9, 60.8];
