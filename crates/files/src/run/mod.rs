//! Runs as plain structs: a body from options ([`PlaneBody`]), an equilibrium ([`Equilibrium`]), one fit
//! ([`FitRun`]) and the fits of a table ([`BatchRun`]). The program, the Python module and the page fill
//! them in; scenes ([`crate::scene`]) and recordings ([`tongue_infer::track`]) have structs of their own.

#[cfg(feature = "files")]
mod batch;
mod body;
mod equilibrium;
mod fit;

#[cfg(feature = "files")]
pub use batch::BatchRun;
pub use body::{BodySource, Kind, PlaneBody, Tissue};
pub use equilibrium::Equilibrium;
pub use fit::{FitFound, FitRun};
