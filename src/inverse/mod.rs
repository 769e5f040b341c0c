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
mod gauss_newton;
pub mod identifiability;
mod known;
mod objective;
pub mod rounding;
mod search;
pub mod uncertainty;

use rayon::prelude::*;
use serde::Serialize;

use crate::body::Mesh;
use crate::measured::Target;
use crate::muscle::{Muscle, PerMuscle};
use crate::statics::{self, Solution, Workspace};
use crate::system::{Model, System, SystemError};

pub use identifiability::Identifiability;
pub use objective::{Forward, Outcome};
pub use search::Start;

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
    #[error("the mesh has no muscle {0}; it is needed to compare lengths")]
    MissingMuscle(Muscle),
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

/// The answer solved once more from rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Replay {
    /// What the solver did.
    pub solution: Solution,
    /// Largest difference of a muscle's length to the search's, m.
    pub largest_difference: f64,
    /// Smallest ratio of a triangle's area to that at rest.
    pub min_area_ratio: f64,
    /// Largest such ratio.
    pub max_area_ratio: f64,
}

/// A fit and all that is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// What was to be hit.
    pub target: Target,
    /// How it ended.
    pub status: Status,
    /// Tensions, N per metre of thickness; zero for muscles that do not contract.
    pub tensions: PerMuscle<f64>,
    /// Lengths at the answer, m.
    pub lengths: PerMuscle<f64>,
    /// Lengths of the model at rest, m.
    pub rest_lengths: PerMuscle<f64>,
    /// Simulated ratio or stretch of every muscle.
    pub simulated: PerMuscle<f64>,
    /// Simulated less measured ratio or stretch of every muscle.
    pub residuals: PerMuscle<f64>,
    /// Root mean square of the residuals of the fitted muscles.
    pub misfit: f64,
    /// The misfit up to which the target counts as met.
    pub misfit_tolerance: f64,
    /// Equilibria solved during the search.
    pub evaluations: usize,
    /// Where each start ended, in order.
    pub starts: Vec<Start>,
    /// What the data determine.
    pub identifiability: Option<Identifiability>,
    /// The answer solved once more from rest.
    pub replay: Replay,
    /// Positions of all nodes at the answer, m.
    pub positions: Vec<nalgebra::SVector<f64, 2>>,
}

impl Fit {
    /// Root mean square residual of the muscles that the fit does not see: those that do not contract (and, for ratios, are
    /// not GGa, whose ratio is 1 by definition). `None` where there is none.
    pub fn passive_rms(&self) -> Option<f64> {
        let unseen: Vec<f64> = Muscle::ALL
            .into_iter()
            .filter(|m| !self.target.active.contains(m) && self.target.kind.constrains(*m))
            .map(|m| self.residuals[m.index()])
            .collect();
        let squares: f64 = unseen.iter().map(|r| r * r).sum();
        (!unseen.is_empty()).then(|| (squares / unseen.len() as f64).sqrt())
    }
}

/// Answers nearer to the lower bound than this are on it, N.
const AT_BOUND: f64 = 1e-3;
/// A replay from rest must give the same lengths within this, m.
const SAME_LENGTH: f64 = 1e-8;

/// The numbers of the eight muscles among the chains of a mesh.
///
/// # Errors
/// [`FitError::MissingMuscle`] names the first that the mesh lacks.
pub fn muscle_numbers<const D: usize>(mesh: &Mesh<D>) -> Result<PerMuscle<usize>, FitError> {
    let mut numbers = [0; crate::muscle::COUNT];
    for m in Muscle::ALL {
        numbers[m.index()] =
            mesh.muscles.iter().position(|chain| chain.name == m.name()).ok_or(FitError::MissingMuscle(m))?;
    }
    Ok(numbers)
}

/// Fits the tensions of the target's active muscles. The same bits for any number of threads.
///
/// # Errors
/// [`FitError`] when it cannot begin; whatever happens later is a [`Status`].
///
/// # Example
/// ```
/// use tongue_fit::inverse::{self, Method, Settings, Status};
/// use tongue_fit::body::{self, Anatomy};
/// use tongue_fit::system::Model;
/// use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
///
/// let mesh = body::build(&Anatomy::reference()?, body::DEFAULT_SPACING_M)?;
/// let data = Dataset::reference()?;
/// let target = Target::new(&data, "S2", Vowel::A, TargetKind::Ratio, &TargetOptions::default())?;
/// let settings = Settings { method: Method::GaussNewton, ..Settings::default() };
/// let fit = inverse::fit(&mesh, &Model::default(), &target, &settings)?;
/// assert_eq!(fit.status, Status::Converged);
/// // Two ratios do not determine three tensions, and the fit says so.
/// assert_eq!(fit.identifiability.map(|i| i.null_directions.len()), Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit(mesh: &Mesh<2>, model: &Model, target: &Target, settings: &Settings) -> Result<Fit, FitError> {
    let numbers = muscle_numbers(mesh)?;
    let contracting: Vec<usize> = target.active.iter().map(|m| numbers[m.index()]).collect();
    let system = System::new(mesh, model, &contracting)?;
    fit_system(&system, numbers, target, settings)
}

/// As [`fit`], in a system at hand: one in which all of the target's active muscles contract. `numbers` are those of the eight
/// muscles among the chains of its mesh.
///
/// # Errors
/// [`FitError`] when it cannot begin; whatever happens later is a [`Status`].
pub fn fit_system(
    system: &System<2>,
    numbers: PerMuscle<usize>,
    target: &Target,
    settings: &Settings,
) -> Result<Fit, FitError> {
    settings.check()?;
    let starts: Vec<Start> = (0..settings.starts)
        .into_par_iter()
        .map(|number| {
            let forward = Forward::new(system, numbers, target, settings);
            match settings.method {
                Method::NelderMead => search::run(forward, number),
                Method::GaussNewton => Ok(gauss_newton::run(forward, number)),
            }
        })
        .collect::<Result<_, _>>()?;
    // The first of equals, whatever the order in which they finished.
    let best = starts
        .iter()
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .ok_or_else(|| FitError::Search("no start was made".into()))?;

    let mut forward = Forward::new(system, numbers, target, settings);
    let mut active = snap_to_lower_bound(&mut forward, best);
    if target.fitted.len() < target.active.len() && best.lengths.is_some() {
        active = identifiability::into_the_valley(&mut forward, &active);
    }
    let outcome = forward.evaluate(&active);
    // What the search found; where the answer was moved after it, what that came to from its neighbours.
    let found = if active == best.tensions { best.lengths } else { outcome.lengths };
    let rest_lengths = forward.rest_lengths();
    let identifiability = identifiability::analyse(&mut forward, &active);
    let evaluations = starts.iter().map(|s| s.evaluations).sum::<usize>() + forward.evaluations();

    let mut workspace = Workspace::new(system);
    let solution =
        statics::solve(system, &mut workspace, &forward.all_tensions(&active), &settings.equilibrium);
    let lengths = forward.lengths_of(workspace.positions());
    let largest_difference = found.map_or(f64::INFINITY, |found| {
        found.iter().zip(&lengths).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    });
    let (min_area_ratio, max_area_ratio) = system.cell_ratios(workspace.positions());
    let replay = Replay { solution, largest_difference, min_area_ratio, max_area_ratio };

    let simulated = target.simulated(&lengths, &rest_lengths);
    let residuals = Muscle::ALL.map(|m| simulated[m.index()] - target.values[m.index()]);
    let mut tensions = [0.0; crate::muscle::COUNT];
    for (m, t) in target.active.iter().zip(&active) {
        tensions[m.index()] = *t;
    }
    let status = if solution.status != statics::Status::Converged {
        Status::NoEquilibrium
    } else if largest_difference > SAME_LENGTH {
        Status::ReplayDiffers
    } else if active.iter().any(|&t| t > settings.upper_bound - AT_BOUND) {
        Status::AtUpperBound
    } else if outcome.misfit > settings.misfit_tolerance {
        Status::TargetNotMet
    } else if !best.converged {
        Status::IterationLimit
    } else {
        Status::Converged
    };
    Ok(Fit {
        target: target.clone(),
        status,
        tensions,
        lengths,
        rest_lengths,
        simulated,
        residuals,
        misfit: outcome.misfit,
        misfit_tolerance: settings.misfit_tolerance,
        evaluations,
        identifiability,
        replay,
        positions: workspace.positions().to_vec(),
        starts,
    })
}

/// Tensions that the search left within a hair of zero are zero, unless the fit would be worse for it.
fn snap_to_lower_bound(forward: &mut Forward<'_>, best: &Start) -> Vec<f64> {
    let snapped: Vec<f64> = best.tensions.iter().map(|&t| if t < AT_BOUND { 0.0 } else { t }).collect();
    if forward.evaluate(&snapped).cost <= best.cost + f64::EPSILON { snapped } else { best.tensions.clone() }
}
