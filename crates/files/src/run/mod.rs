//! Runs as plain structs: a body from options ([`PlaneBody`]), an equilibrium ([`Equilibrium`],
//! [`Solved`]), each muscle alone ([`MuscleEffect`]), a sound ([`SoundRun`]), one fit
//! ([`FitRun`]), the fits of a table ([`BatchRun`]) and recordings of a tongue ([`TrackRun`]). The program, the
//! Python module and the page fill them in; a scene is such a struct itself ([`crate::scene`]).

#[cfg(feature = "files")]
mod batch;
mod body;
pub(crate) mod equilibrium;
mod fit;
mod muscles;
mod sound;
mod track;

#[cfg(feature = "files")]
pub use batch::BatchRun;
pub use body::{BodySource, Kind, PlaneBody, SpaceSource};
pub use equilibrium::{Equilibrium, Solved};
pub use fit::{FitRun, VerdictSource};
pub use muscles::MuscleEffect;
pub use sound::{SoundRun, TongueSound, TongueSoundRecord};
pub use track::{TrackRun, TrackedBody};
