//! Runs as plain structs: a body from options ([`PlaneBody`], [`SpaceSource`]), an equilibrium ([`Equilibrium`], [`Solved`]), a motion
//! ([`MotionRun`]), each muscle alone ([`MuscleEffect`]), a sound ([`SoundRun`]), one fit ([`FitRun`]), a posterior ([`PosteriorRun`]), the
//! fits of a table ([`BatchRun`]) and recordings of a tongue ([`TrackRun`]). The program, the Python module and the page fill them in. A
//! scene is such a struct itself ([`crate::scene`]).

#[cfg(feature = "files")]
mod batch;
mod body;
pub(crate) mod equilibrium;
mod fit;
mod muscles;
mod posterior;
mod recordings;
mod sound;
mod track;

#[cfg(feature = "files")]
pub use batch::{BatchRun, RowPosteriors};
pub use body::{BodySource, Kind, PlaneBody, SpaceSource};
pub use equilibrium::{Equilibrium, MotionRun, STEP_ERROR_MM, SampledMotion, Solved};
pub use fit::{FitRun, Published, VerdictSource};
pub use muscles::{EffectRow, MuscleEffect};
pub use posterior::{PosteriorRun, SampledPosterior};
pub use recordings::{ScreenedRecording, bones_apart_m, check_scale};
pub use sound::{SoundRun, TongueSound, TongueSoundRecord};
pub use track::{SpaceTrack, SpaceTrackRun, TrackRun, TrackedBody};
