//! The inverse problem: which tensions make the simulated lengths meet the measured ones?
//!
//! ```text
//! minimise over 0 <= F <= F_max:  sum over fitted muscles (simulated - measured)²  +  effort * sum F
//! ```
//!
//! by Nelder-Mead from several starts, or with the derivatives of the equilibrium ([`Method::GaussNewton`]). The effort is zero unless
//! there are fewer equations than tensions (n ratios are n - 1 equations); then it selects, of all tensions that fit equally well, those
//! with the smallest sum. Because it also keeps the answer slightly off the target, the answer is moved onto the target afterwards.
//! [`identifiability`] gives the other tensions that fit as well.
//!
//! Candidates start from solved neighbours. The answer of every start is solved again by Newton's method from rest; if that gives another
//! cost, the search begins again with every candidate from rest. The best answer is followed from rest as its tensions grow
//! ([`Replay`]); if they lead to another shape than the direct solve, the search goes on among the shapes to which tensions lead.

pub mod alarms;
pub mod batch;
mod constants;
mod fit;
mod forward;
mod gauss_newton;
pub mod identifiability;
pub mod in_space;
mod movable_bone;
mod nelder_mead;
mod problem;
mod projection;
pub mod solution_curve;
mod solve;
mod start;
mod target_on_body;

use serde::{Deserialize, Serialize};

use tongue_core::limits::{self, BeyondLimit};
use tongue_core::statics;
use tongue_core::system::SystemError;

pub use fit::{Fit, Optimum, fit, fit_in, optima};
pub use forward::{Forward, Linearised};
pub use identifiability::Identifiability;
pub use movable_bone::{BONE_SD_M, MovableBone};
pub use problem::{Constant, LeastSquaresProblem, Prior, Quantity, TissueUnknown, Unknown};
pub use solve::{Answer, Replay};
pub use start::{SearchCounts, Start};
pub use target_on_body::TargetOnBody;

/// Search method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The simplex of Nelder and Mead (1965), as in the thesis; it uses costs only.
    #[default]
    NelderMead,
    /// Damped Gauss-Newton with exact sensitivities.
    GaussNewton,
}

/// Settings of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    pub method: Method,
    /// Number of starting points. Default 4.
    pub starts: usize,
    /// Upper bound of every tension, N (per metre of thickness). Default 100.
    pub upper_bound: f64,
    /// Maximum number of iterations of Nelder-Mead from one simplex, or of Gauss-Newton. Default 1000.
    pub max_iterations: u64,
    /// Convergence: largest distance of a simplex's corner from the best one, or length of an undamped Gauss-Newton step, N. Default 1e-4.
    pub tension_tolerance: f64,
    /// Convergence: standard deviation of a simplex's costs, or predicted decrease of a Gauss-Newton step, dimensionless. Default 1e-17.
    pub cost_tolerance: f64,
    /// Largest root mean square misfit of the fitted ratios or stretches with which the target counts as met. Default 1e-3.
    pub misfit_tolerance: f64,
    /// Whether a candidate is solved from the nearest solved one instead of from rest. Default: yes.
    pub warm_start: bool,
    /// Whether each Gauss-Newton step minimises its model within the bounds instead of being cut at them, which takes fewer steps where
    /// many unknowns are on a bound. Default: no.
    pub best_steps: bool,
    pub equilibrium: statics::SolveSettings,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            starts: 4,
            upper_bound: 100.0,
            max_iterations: 1000,
            tension_tolerance: 1e-4,
            cost_tolerance: 1e-17,
            misfit_tolerance: 1e-3,
            warm_start: true,
            best_steps: false,
            equilibrium: statics::SolveSettings::default(),
        }
    }
}

impl FitSettings {
    /// Checks that every setting is in its range.
    pub fn check(&self) -> Result<(), BeyondLimit> {
        limits::STARTS.check(self.starts as f64)?;
        limits::UPPER_BOUND.check(self.upper_bound)?;
        limits::TENSION_TOLERANCE.check(self.tension_tolerance)?;
        limits::MISFIT_TOLERANCE.check(self.misfit_tolerance)?;
        limits::COST_TOLERANCE.check(self.cost_tolerance)
    }
}

/// Why a fit cannot begin.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(
        "the mesh has no muscle {muscle}, which the table has; add it to the body's anatomy or mesh, or leave its column out of the table"
    )]
    MissingMuscle { muscle: String },
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    #[error("the search failed: {0}")]
    Search(String),
}

fn refused<T>(why: impl Into<String>) -> Result<T, FitError> {
    Err(FitError::Refused(why.into()))
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FitStatus {
    /// The search converged, the target is met and no unknown is at its upper bound. Alarms may still forbid trust
    /// ([`Answer::is_trustworthy`]).
    Converged,
    /// The best answer misses the target by more than the tolerance, whether or not the search converged.
    TargetNotMet,
    AtUpperBound,
    IterationLimit,
    /// The load path of the answer's tensions ends at another shape than the search's.
    ReplayDiffers,
    NoEquilibrium,
}

/// Answers nearer to a bound than this count as on it, in units of the unknowns (N).
pub const AT_BOUND: f64 = 1e-3;
