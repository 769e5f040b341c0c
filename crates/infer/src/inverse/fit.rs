//! The fit of tensions of contracting muscles to measured ratios or stretches.

use serde::Serialize;

use tongue_core::body::Mesh;
use tongue_core::statistics::least_by;
use tongue_core::system::{Model, System};
use tongue_input::measured::{ByMuscle, Target, TargetKind};

use super::solve::Answer;
use super::target_on_body::TargetOnBody;
use super::{AT_BOUND, FitError, FitSettings};

/// A fit of a target. Lists over muscles are parallel to [`TargetOnBody::muscles`], those of the answer to the muscles of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const D: usize = 2> {
    pub matched: TargetOnBody,
    pub answer: Answer<D>,
    /// Lengths of the model at rest, m, from which changes are counted.
    pub rest_lengths: Vec<f64>,
    pub settings: FitSettings,
}

impl<const D: usize> Fit<D> {
    /// Tensions, N per metre of thickness; zero for muscles that do not contract.
    pub fn tensions(&self) -> Vec<f64> {
        self.matched.pick(&self.answer.tensions)
    }

    /// Lengths at the answer, m.
    pub fn lengths(&self) -> Vec<f64> {
        self.matched.pick(&self.answer.lengths)
    }

    /// Simulated less measured ratio or stretch of every muscle of the target.
    pub fn residuals(&self) -> Vec<f64> {
        let target = &self.matched.target;
        self.simulated(target.kind).iter().zip(&target.values).map(|(s, m)| s - m).collect()
    }

    /// Root mean square residual of the measured muscles that do not contract, without the reference of ratios, whose ratio is 1 by
    /// definition. `None` if there are none.
    pub fn passive_rms(&self) -> Option<f64> {
        let target = &self.matched.target;
        target.passive_rms(target.kind, &self.simulated(target.kind), &target.values)
    }

    /// The tension of a muscle, N per metre of thickness.
    pub fn tension(&self, muscle: &str) -> Option<f64> {
        let place = self.matched.muscles.iter().position(|name| name == muscle)?;
        Some(self.answer.tensions[self.matched.numbers[place]])
    }

    /// Whether the tension of a muscle is above rounding (0.001 N); whether it may contract is its role in the target.
    pub fn has_tension(&self, muscle: &str) -> bool {
        self.tension(muscle).is_some_and(|tension| tension >= AT_BOUND)
    }

    /// Muscles of the table or of the body that were not measured in both rows.
    pub fn not_measured(&self) -> Vec<String> {
        let TargetOnBody { target, muscles, .. } = &self.matched;
        let is_new = |name: &&String| !target.not_measured.iter().any(|n| n.eq_ignore_ascii_case(name));
        let others = muscles[target.muscles.len()..].iter().filter(is_new);
        target.not_measured.iter().chain(others).cloned().collect()
    }

    /// The simulated ratios or stretches of all muscles.
    pub fn simulated(&self, kind: TargetKind) -> Vec<f64> {
        kind.values(&self.lengths(), &self.rest_lengths, self.matched.target.reference)
    }

    pub fn active_names(&self) -> Vec<String> {
        self.matched.target.active_names().into_iter().map(str::to_owned).collect()
    }

    /// Tensions of the active muscles, in their order, N per metre of thickness.
    pub fn active_tensions(&self) -> Vec<f64> {
        self.matched.contracting().into_iter().map(|number| self.answer.tensions[number]).collect()
    }
}

/// Fits the tensions of the target's active muscles. The result is bitwise the same for any number of threads.
///
/// # Errors
/// [`FitError`] if the fit cannot begin; later failures are a [`FitStatus`](super::FitStatus).
///
/// # Example
/// ```
/// use tongue_infer::inverse::{self, Method, FitSettings, FitStatus};
/// use tongue_core::body::{self, Anatomy};
/// use tongue_core::system::Model;
/// use tongue_input::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
///
/// let mesh = body::build(&Anatomy::reference()?, body::DEFAULT_SPACING_M)?;
/// let data = Dataset::reference()?;
/// let target = Target::new(&data, "S2", &Vowel::new("a")?, TargetKind::Ratio, &TargetOptions::default())?;
/// let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
/// let fit = inverse::fit(&mesh, &Model::default(), &target, &settings)?;
/// assert_eq!(fit.answer.status, FitStatus::Converged);
/// // Two ratios do not determine three tensions, and the fit says so.
/// assert_eq!(fit.answer.undetermined(), Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit<const D: usize>(
    mesh: &Mesh<D>,
    model: &Model,
    target: &Target,
    settings: &FitSettings,
) -> Result<Fit<D>, FitError> {
    let matched = TargetOnBody::new(mesh, target)?;
    let system = System::new(mesh, model, &matched.contracting())?;
    fit_in(&system, matched, settings)
}

/// [`fit`] in a prepared system, in which all active muscles of the target can contract.
pub fn fit_in<const D: usize>(
    system: &System<D>,
    matched: TargetOnBody,
    settings: &FitSettings,
) -> Result<Fit<D>, FitError> {
    Ok(Fit {
        answer: matched.problem(system, settings).solve(settings)?,
        rest_lengths: matched.pick(&system.lengths(system.rest())),
        settings: *settings,
        matched,
    })
}

/// Answers none of whose tensions differ by more than this are the same, N.
const SAME_ANSWER: f64 = 0.5;

/// A local optimum other than the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Optimum {
    /// Tensions of the active muscles, N.
    pub tensions_n: ByMuscle<f64>,
    /// Value of the objective.
    pub cost: f64,
    /// Number of starts that ended there.
    pub starts: usize,
}

/// Optima at which converged starts ended, other than the answer and the best start, best first. The answer to an undetermined target is
/// chosen on the curve through the best start.
pub fn optima<const D: usize>(fit: &Fit<D>) -> Vec<Optimum> {
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_ANSWER);
    let (answer, starts) = (fit.active_tensions(), &fit.answer.starts);
    let best = least_by(starts, |start| start.cost).map_or(&answer, |start| &start.x);
    let mut found: Vec<(&[f64], Optimum)> = Vec::new();
    for start in starts.iter().filter(|s| s.converged && !same(&s.x, &answer) && !same(&s.x, best)) {
        match found.iter_mut().find(|(x, _)| same(x, &start.x)) {
            Some((_, o)) => o.starts += 1,
            None => {
                let tensions_n = ByMuscle::new(&fit.active_names(), start.x.iter().copied());
                found.push((&start.x, Optimum { tensions_n, cost: start.cost, starts: 1 }));
            }
        }
    }
    found.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
    found.into_iter().map(|(_, optimum)| optimum).collect()
}
