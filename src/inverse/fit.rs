//! The fit of measured muscle lengths: who contracts is known, and what their ratios or stretches are to be.

use nalgebra::SVector;

use crate::body::Mesh;
use crate::measured::{Target, TargetKind};
use crate::observe::{Length, Observation, Ratio, Stretch};
use crate::statics::Connection;
use crate::system::{Model, System};

use super::forward::Inverse;
use super::solve::{Replay, solve};
use super::start::Start;
use super::unknown::Unknown;
use super::valley::Valley;
use super::{FitError, Identifiability, Settings, Status};

/// A target and the muscles of a body that it speaks of.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// The target, without measured muscles that the body lacks.
    pub target: Target,
    /// Names of the body's muscles: those of the target in its order, then the others, each once.
    pub muscles: Vec<String>,
    /// The number of each in the body; of several chains of one name the first.
    pub numbers: Vec<usize>,
}

impl Matched {
    /// Finds the muscles of a target in a body.
    ///
    /// # Errors
    /// [`FitError::MissingMuscle`] names a muscle that the fit cannot do without and the body lacks.
    pub fn new<const D: usize>(mesh: &Mesh<D>, target: &Target) -> Result<Self, FitError> {
        let number = |name: &str| mesh.muscles.iter().position(|m| m.name.eq_ignore_ascii_case(name));
        let has = |name: &str| number(name).is_some();
        let target = target.of_body(has).map_err(|muscle| FitError::MissingMuscle { muscle })?;
        let mut muscles = target.muscles.clone();
        for chain in &mesh.muscles {
            if !muscles.iter().any(|m| m.eq_ignore_ascii_case(&chain.name)) {
                muscles.push(chain.name.clone());
            }
        }
        let numbers = muscles.iter().filter_map(|m| number(m)).collect();
        Ok(Self { target, muscles, numbers })
    }

    /// Numbers in the body of the muscles that contract.
    pub fn contracting(&self) -> Vec<usize> {
        self.target.active.iter().map(|&m| self.numbers[m]).collect()
    }

    /// What the target says of the body: an observation for every fitted muscle.
    pub fn observations<const D: usize>(&self, system: &System<D>) -> Vec<Observation<D>> {
        self.observations_of(system, &self.target.fitted)
    }

    /// What it says of other muscles, at these positions in it.
    fn observations_of<const D: usize>(&self, system: &System<D>, muscles: &[usize]) -> Vec<Observation<D>> {
        let target = &self.target;
        let length = |m: usize| Length::new(system.muscle_ends(self.numbers[m]));
        let seen = muscles.iter().map(|&m| {
            let (low, high) = target.rounding_range(m);
            let observation = match target.kind {
                TargetKind::Ratio => {
                    Observation::new(Ratio::new(length(m), length(target.reference)), target.values[m])
                }
                TargetKind::Stretch => {
                    let rest = system.length(system.rest(), self.numbers[m]);
                    Observation::new(Stretch::new(length(m), rest), target.values[m])
                }
            };
            observation.between(low, high)
        });
        seen.collect()
    }

    /// The problem that the target sets for a system in which its active muscles contract.
    pub fn inverse<'a, const D: usize>(&self, system: &'a System<D>, settings: &Settings) -> Inverse<'a, D> {
        let unknowns = self.contracting().into_iter().map(|m| Unknown::tension(m, settings.upper_bound));
        let others: Vec<usize> = self.target.compared().filter(|m| !self.target.fitted.contains(m)).collect();
        let others = self.observations_of(system, &others);
        Inverse { others, ..Inverse::new(system, self.observations(system), unknowns.collect()) }
    }

    /// The values for this target's muscles of values for all muscles of the body.
    pub fn pick(&self, of_body: &[f64]) -> Vec<f64> {
        self.numbers.iter().map(|&n| of_body[n]).collect()
    }
}

/// A fit and all that is known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const D: usize = 2> {
    /// What was to be hit.
    pub target: Target,
    /// Names of the body's muscles: those of the target in its order, then the others. The lists of tensions and lengths run
    /// parallel to it.
    pub muscles: Vec<String>,
    /// The number of each in the body.
    pub numbers: Vec<usize>,
    /// How it ended.
    pub status: Status,
    /// Tensions, N per metre of thickness; zero for muscles that do not contract.
    pub tensions: Vec<f64>,
    /// The same for all chains of the body, in its order.
    pub body_tensions: Vec<f64>,
    /// Lengths at the answer, m.
    pub lengths: Vec<f64>,
    /// Lengths of the model at rest, m.
    pub rest_lengths: Vec<f64>,
    /// Simulated ratio or stretch of every muscle of the target.
    pub simulated: Vec<f64>,
    /// Simulated less measured ratio or stretch of every muscle of the target.
    pub residuals: Vec<f64>,
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
    /// Root mean square residual of the measured muscles that the fit does not see: those that do not contract (and, for ratios, are
    /// not the reference, whose ratio is 1 by definition). `None` where there is none.
    pub fn passive_rms(&self) -> Option<f64> {
        let unseen: Vec<f64> = self
            .target
            .compared()
            .filter(|m| !self.target.active.contains(m))
            .map(|m| self.residuals[m])
            .collect();
        let squares: f64 = unseen.iter().map(|r| r * r).sum();
        (!unseen.is_empty()).then(|| (squares / unseen.len() as f64).sqrt())
    }

    /// Whether the answer meets its target and is the shape to which its tensions lead from rest, under the published law.
    pub fn is_trustworthy(&self) -> bool {
        let solution = &self.replay.solution;
        self.status == Status::Converged && solution.guarded == 0 && solution.connection == Connection::Traced
    }

    /// The curve of all tensions that fit as well, where just one direction is undetermined.
    pub fn valley(&self) -> Option<&Valley> {
        match self.identifiability.as_ref()?.null_directions.as_slice() {
            [one] => Some(&one.valley),
            _ => None,
        }
    }

    /// The values for [`Fit::muscles`] of values for all chains of the body.
    pub fn of_body(&self, values: &[f64]) -> Vec<f64> {
        self.numbers.iter().map(|&n| values[n]).collect()
    }

    /// Tensions of the active muscles, in their order, N per metre of thickness.
    pub fn active_tensions(&self) -> Vec<f64> {
        self.target.active.iter().map(|&m| self.tensions[m]).collect()
    }
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
/// let target = Target::new(&data, "S2", &Vowel::new("a")?, TargetKind::Ratio, &TargetOptions::default())?;
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
    let matched = Matched::new(mesh, target)?;
    let system = System::new(mesh, model, &matched.contracting())?;
    fit_system(&system, &matched, settings)
}

/// As [`fit`], in a system at hand: one in which all of the target's active muscles contract.
///
/// # Errors
/// [`FitError`] when it cannot begin; whatever happens later is a [`Status`].
pub fn fit_system<const D: usize>(
    system: &System<D>,
    matched: &Matched,
    settings: &Settings,
) -> Result<Fit<D>, FitError> {
    let target = &matched.target;
    let answer = solve(&matched.inverse(system, settings), settings)?;
    let lengths = matched.pick(&answer.lengths);
    let rest_lengths = matched.pick(&system.lengths(system.rest()));
    let measured = target.muscles.len();
    let simulated = target.simulated(&lengths[..measured], &rest_lengths[..measured]);
    Ok(Fit {
        target: target.clone(),
        muscles: matched.muscles.clone(),
        numbers: matched.numbers.clone(),
        status: answer.status,
        tensions: matched.pick(&answer.tensions),
        body_tensions: answer.tensions,
        lengths,
        rest_lengths,
        residuals: simulated.iter().zip(&target.values).map(|(s, m)| s - m).collect(),
        simulated,
        misfit: answer.misfit,
        misfit_tolerance: settings.misfit_tolerance,
        evaluations: answer.evaluations,
        starts: answer.starts,
        identifiability: answer.identifiability,
        replay: answer.replay,
        positions: answer.positions,
    })
}
