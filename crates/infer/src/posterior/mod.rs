//! The posterior of tensions, with the uncertainties of body and measurements.
//!
//! ```text
//! y ~ N(s, C_geo + sd² I + R)           y: all measured stretches of a speaker's postures, s = L(F, d, c) / L(F0, d0, c)
//! F ~ half-normal, F0 ~ half-normal     tensions of every muscle in each posture and in the baseline that they share
//! d ~ N(0, sd_d²), c ~ N(0, sd_c²)      displacement of the hyoid in each posture, and its tilt for each metre that it moves back
//! d0 = 0, or d0 ~ N(0, sd_d²)           displacement in the baseline /ɯ/, or in another one, in which muscles pull
//! ```
//! Any muscle may contract. Postures of a speaker are sampled one by one or together; then they share the tones F0, the tilt c, and the
//! errors due to geometry and to rounding of the baseline's lengths. `C_geo` is the covariance of the stretches due to the ends of the
//! muscles, the outline and kappa (in a continuum also due to the width of muscles and the patches of bones), averaged over the posterior
//! (`map`). Muscle ends and outline are linearised with exact derivatives (`rest_shape`; `finite_differences` in bodies that are not made
//! of springs); the effect of kappa is computed from equilibria one standard deviation to either side. `R` is the covariance due to
//! rounding. Young's modulus scales all tensions and is reported separately. Each prior ([`Priors`]) can be fixed or left out.
//!
//! The sampler is Hamiltonian Monte Carlo ([`hmc`]) in the scores, whitened by the Gauss-Newton matrix at the most probable point, with
//! eight chains. Trajectories follow a quadratic model of the lengths ([`Surrogate`]); their ends are accepted by the density itself, four
//! side by side in SIMD lanes (one after the other in bodies that are not made of springs). Only equilibria count to which the tensions
//! lead from rest as they grow, jumps included ([`LaneGroup::solve_from_rest`](tongue_core::statics::lanes::LaneGroup::solve_from_rest)).
//! [`Status`] tells whether the chains have mixed, `leave_out` predicts every
//! stretch without its own measurement, [`Contrast`] compares postures, and [`Verdict`] states the main result in three sentences.

mod auxiliary;
mod contrast;
pub mod diagnostics;
mod evaluator;
mod finite_differences;
pub mod hmc;
mod leave_out;
mod linearisation;
mod map;
mod measurements;
mod model;
mod over_speakers;
pub mod parameters;
pub mod point_data;
mod priors;
mod problem;
mod quadratic_shape;
pub mod quantiles;
mod rest_shape;
mod run;
mod score;
pub mod sensitivity;
mod summary;
mod surrogate;
mod verdict;
mod warm_up;

pub use auxiliary::{Active, AuxiliaryData, DataSource, Electrode, PostureView};
pub use contrast::Contrast;
pub use evaluator::Evaluator;
pub use leave_out::{fitted_stretches, predict_each_from_others};
pub use linearisation::{GeometrySensitivities, LinearisationPoint};
pub use map::MapEstimate;
pub use measurements::{MeasuredStretch, Measurements};
pub use model::{Field, PosteriorModel};
pub use over_speakers::{OverSpeakers, population_mean};
pub use parameters::{Draw, Parameter, ParameterValues, Posture, SolvedPoint};
pub use priors::*;
pub use problem::PosteriorProblem;
pub use quantiles::Quantiles;
pub use run::{Effective, Posterior, SamplerDiagnostics, Sampling, Status, short_run};
pub use score::{LeftOut, MixtureComponent, PredictionMethod, conditional, left_out};
pub use sensitivity::{SENSITIVE, Sensitivity};
pub use summary::{Change, Report, StretchSummary, Summary, Tension, contradiction};
pub use surrogate::{ResidualLikelihood, Surrogate, SurrogateDensity};
pub use verdict::{Certainty, MuscleVerdict, PROBABLE, ShortRun, Verdict, VerdictFrom, short_run_interval};

use tongue_core::system::SystemError;

/// Why a posterior cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PosteriorError {
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(
        "the covariance of the stretches is not positive definite; take a larger discrepancy or rounding in the priors"
    )]
    Covariance,
    #[error(
        "no equilibrium was found at which sampling could begin; take smaller scales of the tensions in the priors"
    )]
    NoMode,
    /// `squares` are the squared deviations of the measured numbers and the parameters at the mode, in standard deviations.
    #[error(
        "these lengths and the model contradict each other: at the most probable tensions the chi-square of {numbers} lengths is {squares:.0}, \
         which it exceeds in fewer than one of a hundred speakers; check the lengths and those of the baseline"
    )]
    Contradicted { squares: f64, numbers: usize },
    #[error(transparent)]
    Draws(#[from] tongue_core::limits::BeyondLimit),
}
