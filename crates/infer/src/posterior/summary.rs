//! Report of a posterior for one posture, which is `posterior` of `fit.json`.

use serde::Serialize;

use tongue_core::random::{normal, seed_of};
use tongue_input::measured::ByMuscle;

use crate::inverse::alarms::Alarm;

use super::leave_out::{fitted_stretches, predict_each_from_others};
use super::model::PosteriorModel;
use super::parameters::{Draw, ParameterValues};
use super::priors::Priors;
use super::quantiles::{Quantiles, part_above_zero};
use super::run::{Posterior, SamplerDiagnostics};
use super::score::LeftOut;
use super::sensitivity::{Scaled, Sensitivity};

/// Factor of another scale of the prior, and the relative change of an interval's upper end under it that is reported.
const OTHER_SCALE: f64 = 1.5;
const MOST_MOVED: f64 = 0.15;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    #[serde(flatten)]
    pub spread: Quantiles,
    /// `None` (null) where the priors fix both tensions.
    pub probability_rises: Option<f64>,
    pub sensitivity: Sensitivity,
    /// Whether the size of the change depends on the prior more than on the data.
    pub depends_on_prior: bool,
    /// Whether the sign has a probability of at least 0.9, but less than 0.85 under half or twice the scale of the prior.
    pub sign_depends_on_prior: bool,
}

/// Tension in the vowel, N per metre of thickness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tension {
    #[serde(flatten)]
    pub spread: Quantiles,
    /// At the most probable point of the posterior; `None` (null) where its loads lead from rest to other shapes.
    pub most_probable: Option<f64>,
    /// Includes the uncertainty of Young's modulus by its prior.
    pub with_young_modulus: Quantiles,
    /// Relative change of the upper end of the 95 % interval if the scale of the prior is half as large again.
    pub moved_by_prior: f64,
    pub sensitivity: Sensitivity,
    /// Whether the upper end of the interval depends on the prior more than on the data.
    pub depends_on_prior: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StretchSummary {
    pub measured: f64,
    /// Stretch of the model fitted to all measurements.
    pub fitted: Quantiles,
    pub left_out: Option<LeftOut>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub changes_n: ByMuscle<Change>,
    pub tensions_n: ByMuscle<Tension>,
    pub baseline_tensions_n: ByMuscle<Quantiles>,
    /// Displacement of the hyoid, x and y, mm.
    pub hyoid_mm: [Quantiles; 2],
    /// The speaker's tilt of the hyoid for every metre that it moves back, rad/m.
    pub hyoid_tilt_rad_per_m: Quantiles,
    pub stretches: ByMuscle<StretchSummary>,
}

/// Priors, diagnostics and, if the chains have mixed, the summary of one posture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    #[serde(flatten)]
    pub diagnostics: SamplerDiagnostics,
    /// Names of the postures that were sampled together.
    pub postures: Vec<String>,
    /// `None` (null) where the chains have not mixed, because such intervals cannot be trusted.
    pub summary: Option<Summary>,
    pub poisson_ratio: f64,
    pub priors: Priors,
    /// Why a short run refuses the lengths ([`MapEstimate::check_data`](super::MapEstimate::check_data)); only of one posture without
    /// auxiliary data.
    #[serde(skip)]
    pub improbable: Option<String>,
}

impl Report {
    /// A report for each posture; `leave_out` adds predictions of every muscle without its own measurement.
    pub fn of_each(posterior: &Posterior<'_>, leave_out: bool, seed: u64) -> Vec<Self> {
        let Posterior { problem, map_estimate, draws, .. } = posterior;
        let mixed = posterior.is_mixed();
        let left_out = (leave_out && mixed).then(|| predict_each_from_others(problem, map_estimate));
        // Where that sampling fails, the rest is reported without it.
        let left_out = left_out.and_then(Result::ok).unwrap_or_default();
        let fitted = if mixed { fitted_stretches(posterior, seed_of(seed, 1 << 23)) } else { Vec::new() };
        let most_probable = problem.parameter_values(&map_estimate.scores).0;
        let most_probable = map_estimate.is_reached_from_rest(problem).then_some(most_probable);
        let scaled = Scaled::new(problem, draws);
        let all = All { posterior, most_probable, left_out, fitted, scaled, seed };
        let is_row = problem.postures() == 1 && problem.measurements.auxiliary.is_empty();
        let improbable = if is_row { map_estimate.check_data(problem).err() } else { None };
        let improbable = improbable.map(|why| why.to_string());
        Vec::from_iter((0..problem.postures()).map(|posture| Self {
            improbable: improbable.clone(),
            diagnostics: posterior.diagnostics.clone(),
            postures: problem.measurements.labels.clone(),
            summary: mixed.then(|| Summary::new(&all, posture)),
            poisson_ratio: problem.posterior_model.model.poisson_ratio,
            priors: problem.posterior_model.priors.clone(),
        }))
    }
}

struct All<'a> {
    posterior: &'a Posterior<'a>,
    most_probable: Option<ParameterValues>,
    left_out: Vec<LeftOut>,
    fitted: Vec<Quantiles>,
    scaled: Scaled,
    seed: u64,
}

/// Probability from which a sign is reported, and the one that it must keep under another prior.
const TOLD_SIGN: f64 = 0.9;
const LEAST_SIGN: f64 = 0.85;

impl Change {
    /// From the difference of tensions in all draws, N per metre of thickness.
    pub(super) fn new(values: &[f64], scaled: &Scaled) -> Self {
        let sensitivity = scaled.evaluate(values);
        let spread = Quantiles::of(values.iter().copied());
        let rises = (!spread.is_fixed()).then(|| part_above_zero(values));
        let surer = rises.map_or(0.0, |rises| rises.max(1.0 - rises));
        let [moved, uncertain] = sensitivity.probability_by_scale;
        Self {
            spread,
            probability_rises: rises,
            sensitivity,
            depends_on_prior: sensitivity.is_of_prior(),
            sign_depends_on_prior: surer >= TOLD_SIGN && surer - moved.abs() - uncertain < LEAST_SIGN,
        }
    }
}

impl Summary {
    fn new(all: &All<'_>, posture: usize) -> Self {
        let posterior = all.posterior;
        let problem = &posterior.problem;
        let (posterior_model, draws) = (problem.posterior_model, &posterior.draws);
        let muscles = &posterior_model.muscles;
        let values = |of: &dyn Fn(&Draw) -> f64| draws.iter().map(of).collect::<Vec<f64>>();
        let spread = |of: &dyn Fn(&Draw) -> f64| Quantiles::of(draws.iter().map(of));
        let count = muscles.len();
        let changes = (0..count).map(|m| Change::new(&values(&|d| d.change(posture, m)), &all.scaled));
        let modulus = &posterior_model.priors.young_modulus;
        let mut random = fastrand::Rng::with_seed(seed_of(all.seed, 1 << 21));
        let factors: Vec<f64> = draws
            .iter()
            .map(|_| if modulus.off { 1.0 } else { (modulus.sd_ln * normal(&mut random)).exp() })
            .collect();
        let tensions = (0..count).map(|m| {
            let own = values(&|d| d.tension(posture, m));
            let spread = Quantiles::of(own.iter().copied());
            let sensitivity = all.scaled.evaluate(&own);
            let moved_by_prior = moved_by_prior(posterior_model, m, &own, spread.interval_95[1]);
            Tension {
                spread,
                most_probable: all.most_probable.as_ref().map(|values| values.postures[posture].tensions[m]),
                with_young_modulus: Quantiles::of(own.iter().zip(&factors).map(|(t, f)| t * f)),
                moved_by_prior,
                sensitivity,
                depends_on_prior: is_of_prior(moved_by_prior, &sensitivity),
            }
        });
        let own = problem.measurements.of_posture(posture);
        let names: Vec<String> =
            own.iter().map(|&i| problem.measurements.stretches[i].name.clone()).collect();
        let stretches = own.iter().map(|&i| StretchSummary {
            measured: problem.measurements.stretches[i].value,
            fitted: all.fitted[i],
            left_out: all.left_out.get(i).filter(|l| l.spread.mean.is_finite()).cloned(),
        });
        Self {
            changes_n: ByMuscle::new(muscles, changes),
            tensions_n: ByMuscle::new(muscles, tensions),
            baseline_tensions_n: ByMuscle::new(muscles, (0..count).map(|m| spread(&|d| d.values.tones()[m]))),
            hyoid_mm: [0, 1].map(|axis| spread(&|d| 1e3 * d.values.postures[posture].hyoid[axis])),
            hyoid_tilt_rad_per_m: spread(&|d| d.values.tilt),
            stretches: ByMuscle::new(&names, stretches),
        }
    }

    /// [`contradiction`] of the stretches and their predictions by the others.
    pub fn contradiction(&self) -> Option<Alarm> {
        let all = self.stretches.0.iter().filter_map(|(_, s)| Some((s.measured, s.left_out.as_ref()?)));
        contradiction(all.map(|(measured, left_out)| left_out.spread.holds(measured)))
    }
}

/// The alarm that measurements and model contradict each other, if at least three and at least half of the measurements are outside of
/// their 95 % predictions by the others. `inside`: for each measurement, whether its 95 % prediction holds it.
pub fn contradiction(inside: impl IntoIterator<Item = bool>) -> Option<Alarm> {
    const FEWEST: usize = 3;
    let (inside, outside): (Vec<bool>, Vec<bool>) = inside.into_iter().partition(|inside| *inside);
    let (outside, predicted) = (outside.len(), outside.len() + inside.len());
    (outside >= FEWEST && 2 * outside >= predicted).then_some(Alarm::Contradicted { outside, predicted })
}

/// Relative change of the upper end of a tension's interval if the scale of its prior is half as large again, from draws weighted by the
/// ratio of the prior densities. Zero for a fixed tension.
pub(super) fn moved_by_prior(
    posterior_model: &PosteriorModel,
    muscle: usize,
    tensions: &[f64],
    upper: f64,
) -> f64 {
    if posterior_model.priors.fixed_tension(&posterior_model.muscles[muscle]).is_some() {
        return 0.0;
    }
    let scale = posterior_model.priors.tension.scale_n_per_m;
    let more = 0.5 * (1.0 - OTHER_SCALE.powi(-2)) / (scale * scale);
    let weighed = tensions.iter().map(|&tension| (tension, (tension * tension * more).min(50.0).exp()));
    Quantiles::weighted(weighed.collect(), f64::INFINITY).interval_95[1] / upper - 1.0
}

pub(super) fn is_of_prior(moved_by_prior: f64, sensitivity: &Sensitivity) -> bool {
    moved_by_prior > MOST_MOVED || sensitivity.is_of_prior()
}
