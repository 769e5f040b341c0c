//! What data and model leave open: the posterior of tensions, with everything in it that is not known.
//!
//! ```text
//! y ~ N(s, C_geo + sd² I + R)           y: all measured stretches, s = L(F, d) / L(F0, 0)
//! F ~ half-normal, F0 ~ half-normal     tensions of every muscle in the vowel and in the baseline
//! d ~ N(0, sd_d²)                       displacement of the hyoid
//! ```
//! No rule says who contracts: every muscle has a tension that is not negative. `C_geo` is the covariance of the stretches by the ends of
//! the muscles, the outline and kappa, linearised with exact derivatives (`shape`; of bodies that are not of springs `differences`, and of a
//! continuum by the width of muscles and the patches of bones too) and averaged over the posterior (`map`; of other bodies than those of springs at
//! the most probable point); `R` is that of the rounding. Young's modulus scales all tensions and is told apart. All priors are in
//! [`Priors`], each can be fixed or left out.
//!
//! Sampled is with Hamiltonian Monte Carlo in the scores ([`hmc`]), whitened by Gauss and Newton's matrix at the most probable point, four
//! chains side by side in the lanes of the processor (of other bodies one after the other). Every draw is where its tensions lead from rest as they grow
//! (`branch`). What has not mixed says so ([`Status`]).

mod branch;
mod density;
pub mod diagnostics;
mod differences;
mod evaluator;
mod ground;
pub mod hmc;
mod map;
mod pairs;
mod predict;
mod priors;
mod run;
mod score;
mod shape;
mod share;
mod spread;
mod summary;

pub use density::{Density, Meaning, Parameter, Place, Seen};
pub use differences::Answers;
pub use evaluator::{Evaluator, Linear};
pub use ground::{Field, Ground};
pub use map::{Geometry, Mode};
pub use pairs::Pairs;
pub use predict::unseen;
pub use priors::*;
pub use run::{Draw, Posterior, Settings, Status, sample};
pub use score::{How, LeftOut, Part, left_out};
pub use share::Shares;
pub use spread::Spread;
pub use summary::{Change, Direction, Effective, Report, Stretch, Summary, Tension, VarianceShare};

use tongue_core::system::SystemError;

/// Why there is no posterior.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PosteriorError {
    /// Priors that cannot be read or make no sense.
    #[error("{0}")]
    Priors(String),
    /// A body that cannot have one.
    #[error("{0}")]
    Body(String),
    /// A system that cannot be made.
    #[error(transparent)]
    System(#[from] SystemError),
    /// Errors of nothing.
    #[error(
        "the covariance of the stretches is not positive definite; are discrepancy or rounding too small beside the others?"
    )]
    Covariance,
    /// No equilibrium where the search begins.
    #[error(
        "no equilibrium was found from which to begin; take smaller scales of the tensions in the priors"
    )]
    NoMode,
    /// Too few or too many draws.
    #[error("{0} draws were asked for; give {1} to {2}")]
    Draws(usize, usize, usize),
}
