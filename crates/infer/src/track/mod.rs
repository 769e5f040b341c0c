//! Tensions over time from what was seen of a tongue: contour points, sensors, bones.
//!
//! What was seen of a frame is met by its equilibrium up to errors that neighbours along the contour and in time share ([`Errors`]);
//! tensions have a level in each speaker and a course about it ([`Link`]); the shape at rest is known only about
//! ([`ShapePrior`]). The most probable tensions on the placed body are found for all frames at once, then draws of
//! the shape and of the tensions given the shape tell the intervals: of levels, and of courses, which are tensions less their mean
//! in the same draw, so that what the shape does to all frames alike drops out. Masses and dampers have no part in it: the thesis's
//! time constants (1 s) are those of no speech.

mod branch;
mod chain;
mod consider;
mod descend;
mod errors;
mod found;
mod frame;
mod gesture;
mod hold_out;
mod link;
mod mode;
mod repeats;
mod run;
pub mod scores;
mod settings;
mod settle;
mod shape;

pub use errors::{Along, Errors};
pub use found::{Displacement, Foretold, FrameStatus, Ranged, Tracked, TrackedRecording};
pub use frame::{BONE_WINDOW, Followed, Frame, Hidden, Surface, frames};
pub(crate) use frame::{Solver, Tension, residuals, slopes};
pub use gesture::{GESTURE_S, Gesture, Segment};
pub use hold_out::{HeldOut, Opponent, opponents};
pub use link::Link;
pub use mode::FEWEST;
pub use repeats::{Repeatable, Repeated, Repeats, repeats};
pub use run::{Stage, track};
pub use settings::Settings;
pub(crate) use settle::ARRIVED;
pub use settle::Prior;
pub(crate) use shape::{SCALE_SD, SHIFT_SD_M, TURN_SD};
pub use shape::{Shape, ShapePrior};
