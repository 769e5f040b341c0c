//! The inverse problem: which tensions make the simulated lengths meet the measured ones?
//!
//! ```text
//! minimise over 0 <= F <= F_max:  sum over fitted muscles (simulated - measured)²  +  effort * sum F
//! ```
//!
//! by Nelder-Mead from several starts (or, [`Method::GaussNewton`], with the derivatives that the equilibrium gives for little).
//! The effort term is there only where the equations are fewer than the tensions (ratios of n muscles are n - 1 equations): of
//! all tensions that fit equally well it takes those with the smallest sum. The answer is then moved by the little that the
//! effort held it beside the target. [`identifiability`] says how far the others reach.
//!
//! Candidates start from solved neighbours; what a search ends with is solved from rest, and where that gives another
//! equilibrium the search begins again with every candidate from rest.

pub mod alarms;
pub mod alternatives;
pub mod batch;
mod constants;
mod directions;
mod fit;
mod forward;
mod freed;
mod gauss_newton;
pub mod identifiability;
mod known;
mod nelder_mead;
mod on_target;
mod premises;
mod problem;
pub mod rounding;
mod solve;
mod start;
pub mod uncertainty;
mod unknown;
pub mod valley;

use serde::Serialize;

use tongue_core::statics;
use tongue_core::system::SystemError;

pub use constants::Tissue;
pub use fit::{Fit, Matched, fit, fit_in, fit_under};
pub use forward::{Forward, Inverse};
pub use freed::FreedBone;
pub use gauss_newton::refit;
pub use identifiability::Identifiability;
pub use premises::{
    BONE_SD_M, HyoidMotion, LooseBone, MovedBone, Premises, STRETCH_SD, Said, Setup, TONE, Tone,
};
pub use problem::{Counts, Linear, Problem};
pub use solve::{Answer, Replay, solve};
pub use start::Start;
pub use unknown::{Constant, Prior, Quantity, Unknown};

/// What searches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The simplex of Nelder and Mead (1965), as the thesis takes; needs costs only.
    #[default]
    NelderMead,
    /// Damped Gauss-Newton with exact sensitivities.
    GaussNewton,
}

/// Which answer is reported of those that meet an undetermined target equally well.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Among {
    /// That which comes nearest to what else was measured.
    #[default]
    Others,
    /// That of the smallest total tension.
    LeastTotal,
}

/// How the search is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// What searches from each start.
    pub method: Method,
    /// Number of starting points. Default 4.
    pub starts: usize,
    /// Upper bound of every tension, N (per metre of thickness). Default 100.
    pub upper_bound: f64,
    /// Price of a newton of tension in the objective where the tensions are not determined, 1/N. Default 2e-6: it moves the
    /// fitted ratios by less than 1e-3.
    pub effort: f64,
    /// Most iterations of Nelder-Mead from one simplex, or of Gauss-Newton. Default 1000.
    pub max_iterations: u64,
    /// A simplex whose corners are nearer than this to the best one has converged, and so has an undamped Gauss-Newton step
    /// that is shorter, N. Default 1e-4.
    pub tension_tolerance: f64,
    /// A simplex whose costs have a smaller standard deviation has converged, and so has a Gauss-Newton step that promises
    /// less, dimensionless. Default 1e-17.
    pub cost_tolerance: f64,
    /// Root mean square misfit of the fitted ratios or stretches up to which the target counts as met. Default 1e-3.
    pub misfit_tolerance: f64,
    /// Which of several answers is reported. Default: the nearest to what else was measured.
    pub among: Among,
    /// Whether a candidate is solved from the nearest one solved before, or from rest. Default: the nearest.
    pub warm_start: bool,
    /// Settings of each equilibrium.
    pub equilibrium: statics::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            starts: 4,
            upper_bound: 100.0,
            effort: 2e-6,
            max_iterations: 1000,
            tension_tolerance: 1e-4,
            cost_tolerance: 1e-17,
            misfit_tolerance: 1e-3,
            among: Among::default(),
            warm_start: true,
            equilibrium: statics::Settings::default(),
        }
    }
}

impl Settings {
    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// [`FitError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), FitError> {
        let positive = [
            ("the number of starts", self.starts as f64),
            ("the upper bound of the tensions", self.upper_bound),
            ("the tension tolerance", self.tension_tolerance),
            ("the misfit tolerance", self.misfit_tolerance),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(FitError::Setting { name, value, must: "positive and finite" });
            }
        }
        if self.starts > MOST_STARTS {
            let (name, value) = ("the number of starts", self.starts as f64);
            return Err(FitError::Setting { name, value, must: "at most 10000: more gain nothing" });
        }
        if self.upper_bound > LARGEST_BOUND {
            let name = "the upper bound of the tensions";
            return Err(FitError::Setting { name, value: self.upper_bound, must: "at most 1e9 N" });
        }
        for (name, value) in [("the effort", self.effort), ("the cost tolerance", self.cost_tolerance)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(FitError::Setting { name, value, must: "finite and not negative" });
            }
        }
        Ok(())
    }
}

/// Why a fit cannot even begin.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The system cannot be made.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The mesh has no chain for a muscle.
    #[error(
        "the mesh has no muscle {muscle}, which the table has; name a curve of the mesh after it, or leave its column out of the table"
    )]
    MissingMuscle {
        /// Its name.
        muscle: String,
    },
    /// What is searched for and what was seen do not go together.
    #[error("{what}")]
    Unknown {
        /// What is wrong.
        what: String,
    },
    /// A setting is out of range.
    #[error("{name} is {value}; it must be {must}")]
    Setting {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The accepted range.
        must: &'static str,
    },
    /// Nelder-Mead itself failed.
    #[error("the search failed: {0}")]
    Search(String),
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The target is met and nothing speaks against the answer.
    Converged,
    /// The search converged, but the best it found misses the target by more than the tolerance.
    TargetNotMet,
    /// A tension ended at its upper bound.
    AtUpperBound,
    /// The search stopped at its iteration limit.
    IterationLimit,
    /// Solved again from rest, the answer has other lengths: it lies on another branch of equilibria.
    ReplayDiffers,
    /// No equilibrium was found at the answer.
    NoEquilibrium,
}

/// More starting points than this are surely a slip.
const MOST_STARTS: usize = 10_000;
/// No muscle pulls harder, N: with larger numbers forces and lengths lose all digits.
const LARGEST_BOUND: f64 = 1e9;

/// Answers nearer to the lower bound than this are on it, in units of the unknowns (N).
pub const AT_BOUND: f64 = 1e-3;
