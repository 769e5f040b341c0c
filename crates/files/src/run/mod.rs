//! Runs as plain structs: a body from options ([`PlaneBody`], [`SpaceSource`]), an equilibrium ([`Equilibrium`], [`Solved`]), a motion
//! ([`SampledMotion`]), each muscle alone ([`MuscleEffect`]), a sound ([`TongueSound`]), one fit ([`FitRun`]), a posterior
//! ([`PosteriorRun`]), the fits of a table ([`BatchRun`]) and recordings of a tongue ([`TrackRun`]). The program, the Python module and the
//! page fill them in. A scene is such a struct itself ([`crate::scene`]).
//!
//! What holds which result: [`Equilibrium`] is a solution with its alarms; [`Solved`] adds positions, tensions and the system;
//! [`Shape`](crate::simulation::Shape) reads it by names of muscles.
//! [`Answer`](tongue_infer::inverse::Answer) has the values that a search found, with their assessment;
//! [`Fit`](tongue_infer::inverse::Fit) adds the target, [`Estimate`](crate::simulation::Estimate) the problem.
//! [`FitRecord`](crate::report::FitRecord) is a fit as it is written.

#[cfg(feature = "files")]
mod batch;
mod body;
pub(crate) mod equilibrium;
mod fit;
mod muscles;
mod recordings;
mod sound;
mod track;

#[cfg(feature = "files")]
pub use batch::{BatchRun, RowPosteriors};
pub use body::{BodySource, Kind, PlaneBody, SpaceSource};
pub use equilibrium::{Equilibrium, STEP_ERROR_MM, SampledMotion, Solved};
pub use fit::{FitRun, PosteriorRun, Published, SampledPosterior, VerdictSource, sampled_together};
pub use muscles::{EffectRow, MuscleEffect};
pub use recordings::{ScreenedRecording, bones_apart_m, check_scale};
pub use sound::TongueSound;
pub use track::{SpaceTrack, SpaceTrackFrame, TrackRun, TrackedBody};
