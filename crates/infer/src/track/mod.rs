//! Tensions over time from what was seen of a tongue: contour points, sensors, bones.
//!
//! ```text
//! minimise over the scores x_t of all frames:  sum |r_t(F(x_t))|² + (x - mean)ᵀ Q (x - mean)
//! ```
//! with `r_t` the residuals of frame `t` at its equilibrium over their standard deviations, `F(x)` half-normal tensions
//! ([`scores`]) and `Q` the precision of a prior on each frame and on how one goes over into the next ([`Prior`]). Every frame is solved
//! from the one before by a damped Gauss-Newton method with the exact derivatives of the equilibrium; then a smoother moves all at
//! once. At the answer the inverse of the normal matrix gives the covariance of every frame's scores; intervals follow from it by weighing each
//! frame's posterior anew. Masses
//! and dampers have no part in it: the thesis's time constants (1 s) are those of no speech.

mod chain;
mod found;
mod frame;
mod hold_out;
mod marginal;
pub mod scores;
mod settings;
mod smooth;

pub use chain::Prior;
pub use found::{Displacement, FrameStatus, Tracked};
pub use frame::{BONE_WINDOW, Followed, Frame, Surface, frames};
pub(crate) use frame::{Solver, residuals, slopes};
pub use hold_out::{HeldOut, Opponent, opponents};
pub use settings::Settings;
pub(crate) use smooth::ARRIVED;
pub use smooth::{FEWEST, track};
