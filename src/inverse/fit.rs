//! The fit of measured muscle lengths: who contracts is known, and what their ratios or stretches are to be.

use nalgebra::SVector;

use crate::body::Mesh;
use crate::measured::{Target, TargetKind};
use crate::muscle::{Muscle, PerMuscle};
use crate::observe::{Length, Observation, Ratio, Stretch};
use crate::system::{Model, System};

use super::forward::Inverse;
use super::solve::{Replay, solve};
use super::start::Start;
use super::uncertainty::rounding_range;
use super::unknown::Unknown;
use super::{FitError, Identifiability, Settings, Status};

/// A fit and all that is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const D: usize = 2> {
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
    pub positions: Vec<SVector<f64, D>>,
}

impl<const D: usize> Fit<D> {
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
pub fn fit<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    target: &Target,
    settings: &Settings,
) -> Result<Fit<D>, FitError> {
    let numbers = muscle_numbers(mesh)?;
    let contracting: Vec<usize> = target.active.iter().map(|m| numbers[m.index()]).collect();
    let system = System::new(mesh, model, &contracting)?;
    fit_system(&system, numbers, target, settings)
}

/// What a target says of a body: an observation for every fitted muscle. `numbers` are those of the eight muscles in the body.
pub fn observations<const D: usize>(
    system: &System<D>,
    numbers: PerMuscle<usize>,
    target: &Target,
) -> Vec<Observation<D>> {
    let length = |m: Muscle| Length::new(system.muscle_ends(numbers[m.index()]));
    let fitted = target.fitted.iter().map(|&m| {
        let measured = target.values[m.index()];
        let (low, high) = rounding_range(target, m);
        match target.kind {
            TargetKind::Ratio => Observation::new(Ratio::new(length(m), length(Muscle::GGa)), measured),
            TargetKind::Stretch => {
                let rest = system.length(system.rest(), numbers[m.index()]);
                Observation::new(Stretch::new(length(m), rest), measured)
            }
        }
        .between(low, high)
    });
    fitted.collect()
}

/// The problem that a target sets for a system.
pub(super) fn inverse<'a, const D: usize>(
    system: &'a System<D>,
    numbers: PerMuscle<usize>,
    target: &Target,
    settings: &Settings,
) -> Inverse<'a, D> {
    let unknowns =
        target.active.iter().map(|m| Unknown::tension(numbers[m.index()], settings.upper_bound)).collect();
    Inverse::new(system, observations(system, numbers, target), unknowns)
}

/// As [`fit`], in a system at hand: one in which all of the target's active muscles contract. `numbers` are those of the eight
/// muscles among the chains of its mesh.
///
/// # Errors
/// [`FitError`] when it cannot begin; whatever happens later is a [`Status`].
pub fn fit_system<const D: usize>(
    system: &System<D>,
    numbers: PerMuscle<usize>,
    target: &Target,
    settings: &Settings,
) -> Result<Fit<D>, FitError> {
    let answer = solve(&inverse(system, numbers, target, settings), settings)?;
    let lengths = numbers.map(|n| answer.lengths[n]);
    let rest_lengths = numbers.map(|n| system.length(system.rest(), n));
    let simulated = target.simulated(&lengths, &rest_lengths);
    Ok(Fit {
        target: target.clone(),
        status: answer.status,
        tensions: numbers.map(|n| answer.tensions[n]),
        lengths,
        rest_lengths,
        simulated,
        residuals: Muscle::ALL.map(|m| simulated[m.index()] - target.values[m.index()]),
        misfit: answer.misfit,
        misfit_tolerance: settings.misfit_tolerance,
        evaluations: answer.evaluations,
        starts: answer.starts,
        identifiability: answer.identifiability,
        replay: answer.replay,
        positions: answer.positions,
    })
}
