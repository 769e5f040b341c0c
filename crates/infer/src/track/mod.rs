//! Tensions over time from observations of a tongue: contour points, sensors, bones.
//!
//! The equilibrium of a frame meets its observations up to errors that neighbours along the contour and in time share ([`Errors`]).
//! Tensions have a level in each speaker and a course about it ([`Link`]). The shape at rest is uncertain ([`ShapePrior`]). First the
//! most probable tensions on the placed body are found, for all frames at once; of long recordings, levels and shape are found from frames
//! spread over all of them. Then draws of the shape, and of the tensions given the
//! shape, give the intervals of levels and courses. A course is a tension less its mean over the recording in the same draw, so an error
//! of the shape that changes all frames equally cancels. Masses and dampers are not used, because the time constants of the thesis (1 s)
//! are too long for speech.

mod branch;
mod by_shape;
mod chain;
mod compare;
mod consider;
mod descend;
mod draws;
mod eliminate;
mod ends;
mod errors;
mod foretell;
mod found;
mod frame;
mod hold_out;
mod link;
mod listen;
mod mode;
mod ranged;
mod rates;
mod repeats;
mod run;
mod segments;
mod settings;
mod shape;
mod shown;
mod stage;
mod summary;
mod tiers;

pub use compare::{Compared, Comparison, LabelDraws, LabelTension, compare, compared, mark};
pub use errors::{Along, Errors};
pub use found::{Displacement, Foretold, FrameStatus, Tracked, TrackedRecording};
pub use frame::{BONE_WINDOW, Followed, Frame, Hidden, TongueSurface, frames};
pub use hold_out::{HeldOut, Opponent, held_out};
pub use link::Link;
pub use listen::{TrackedFormant, listen};
pub use mode::FEWEST;
pub use ranged::Ranged;
pub use repeats::{Repeated, Repeats, repeats};
pub use run::{NotFinite, RestFound, Watch, rest_shape, track};
pub use segments::LabelMean;
pub use settings::TrackSettings;
pub use shape::{RestShape, ShapePrior};
pub(crate) use shape::{SCALE_SD, SHIFT_SD_M, TURN_SD};
pub use stage::Stage;
pub use summary::{CourseSummary, MOST_UNTRUSTED, NARROW, TWO_SIDED_95, course_summaries, is_untrusted};
