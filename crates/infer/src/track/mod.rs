//! Tensions over time from observations of a tongue: contour points, sensors, bones.
//!
//! The equilibrium of a frame meets its observations up to errors that are correlated along the contour and in time ([`ErrorModel`]). Before
//! a transform ([`Softplus`]) a tension is the level of its muscle, which is the same in all frames of a speaker, plus a deviation from it;
//! the shape at rest is uncertain ([`ShapePrior`]). First the most probable tensions of all frames on the placed body are found, from a
//! start at which four rounds with larger errors end; of long recordings, levels and shape are found from frames spread over all of them.
//! Then draws of the shape, and of the tensions given the shape, give the intervals of tensions and courses. A course is a tension less its
//! mean over the recording in the same draw, so errors that are equal in all frames cancel. Masses and dampers are not used, because the
//! time constants of the thesis (1 s) are too long for speech.

mod compare;
mod display_shape;
mod draws;
mod eliminate;
mod formants;
mod frame;
mod gauss_newton;
mod hold_out;
mod interval;
mod jacobian;
mod ornstein_uhlenbeck;
pub mod prediction;
mod reachability;
pub mod repeatability;
mod rest_shape;
mod results;
mod run;
mod segments;
mod settings;
mod smoother;

pub use crate::error_model::{Along, ErrorModel};
pub use compare::{Compared, Comparison, LabelTension, compare, labels_to_compare, mark};
pub use formants::{TrackedFormant, add_formants, opened_deg};
pub use frame::{Frame, FrameObservation, FramePosture, FrameSolver, frames};
pub use hold_out::{BaselinePredictor, HeldOut, held_out};
pub use interval::Interval;
pub use ornstein_uhlenbeck::{OrnsteinUhlenbeck, Softplus};
pub use reachability::Reachability;
pub use repeatability::{Repeatability, Repeated, repeatability};
pub use rest_shape::{RestShape, ShapePrior};
pub use results::{
    Displacement, FrameStatus, HeldOutPrediction, LabelCourse, LabelDraws, LabelMean, LabelPoint, Tracked,
    TrackedRecording,
};
pub use run::{NotFinite, Watch, rest_shape};
pub use segments::{CourseSummary, MOST_UNTRUSTED, NARROW, course_summaries, is_untrusted};
pub use settings::{Followed, TrackSettings, TrackingContext};
pub use smoother::FEWEST;
