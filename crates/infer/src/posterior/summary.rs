//! Report of a posterior for one posture: changes, tensions, directions, sources of variance, stretches. It is `posterior` of `fit.json`.

use nalgebra::DVector;
use serde::Serialize;

use super::half_normal;
use tongue_core::random::{normal, seed_of};
use tongue_input::measured::ByMuscle;

use super::PosteriorError;
use super::directions::{Direction, directions};
use super::draw::Draw;
use super::gain::{Contradiction, Gain, contradictions};
use super::ground::Ground;
use super::leave_out::{fitted, without_each};
use super::priors::Priors;
use super::run::{Posterior, Status};
use super::score::LeftOut;
use super::sensitivity::{Scaled, Sensitivity};
use super::share::{Parts, Shares};
use super::spread::{Quantiles, part_above_zero};
use super::unknowns::Parameter;

/// Factor of another scale of the prior, and the part by which the upper end of an interval may move under it before this is reported.
const OTHER_SCALE: f64 = 1.5;
const MOST_MOVED: f64 = 0.15;

/// Difference of a muscle's tensions in the posture and in the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    #[serde(flatten)]
    pub spread: Quantiles,
    /// Probability that the muscle pulls harder than in the baseline.
    pub probability_rises: f64,
    pub sensitivity: Sensitivity,
    /// Whether the size of the change depends on the prior more than on the data.
    pub depends_on_prior: bool,
    /// Whether the sign, if reported with a probability of 0.9 or more, would have less than 0.85 under half or twice the scale of the
    /// prior.
    pub sign_depends_on_prior: bool,
}

/// A tension in the vowel, N per metre of thickness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tension {
    #[serde(flatten)]
    pub spread: Quantiles,
    /// The same with the uncertainty of Young's modulus in its prior.
    pub with_young_modulus: Quantiles,
    /// The part by which the upper end of the 95 % interval moves if the scale of the prior is half as large again.
    pub moved_by_prior: f64,
    pub sensitivity: Sensitivity,
    /// Whether the upper end of the interval depends on the prior more than on the data.
    pub depends_on_prior: bool,
}

/// Measured, fitted and predicted stretch of a muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StretchSummary {
    pub measured: f64,
    /// Stretch of the model fitted to all measurements.
    pub fitted: Quantiles,
    pub left_out: Option<LeftOut>,
}

/// The results, in the order of the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    pub changes_n: ByMuscle<Change>,
    pub tensions_n: ByMuscle<Tension>,
    pub baseline_tensions_n: ByMuscle<Quantiles>,
    /// Displacement of the hyoid, x and y, mm.
    pub hyoid_mm: [Quantiles; 2],
    /// The speaker's tilt of the hyoid for every metre that it moves back, rad/m.
    pub hyoid_tilt_rad_per_m: Quantiles,
    /// Directions of tensions, tones and the hyoid's place, the most resolved first.
    pub directions: Vec<Direction>,
    pub stretches: ByMuscle<StretchSummary>,
}

/// Shares of the sources in variances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VarianceShare {
    pub tension: Shares,
    /// Budget of errors of the tension of every muscle.
    pub tensions: ByMuscle<Shares>,
    /// Budget of errors of a change: the mean over muscles.
    pub change: Shares,
    /// The part by which the standard deviation of a tension would shrink if a source were known: the mean over muscles.
    pub tension_if_known: Shares,
    /// The same for a change.
    pub change_if_known: Shares,
    /// Budget of errors of a stretch that is left out: the mean over measured muscles.
    pub left_out_stretch: Shares,
}

/// Effective sample sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effective {
    /// Smallest bulk effective sample size of all reported quantities.
    pub bulk: f64,
    pub tail: f64,
}

/// Report of a posterior for one posture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    pub status: Status,
    /// Why not; empty where they have.
    pub why: String,
    pub draws: usize,
    /// Names of the postures that were sampled together; a single one where the posture was sampled alone.
    pub postures: Vec<String>,
    /// The results; null where the chains have not mixed, because such intervals cannot be trusted.
    pub summary: Option<Summary>,
    /// For every muscle, the part of the prior variance of its tension's score that the data removed.
    pub shrinkage: ByMuscle<f64>,
    pub variance_share: Option<VarianceShare>,
    /// Largest rank-normalised split R-hat of all reported quantities, from the kept draws.
    pub r_hat: f64,
    pub ess: Effective,
    /// Trajectories whose energy error was too large.
    pub divergences: usize,
    /// Trajectories that ended where there is no stable equilibrium: there the density is zero.
    pub folds: usize,
    /// How often a chain was sent back from a shape to which its tensions do not lead from rest; the density is zero there too.
    pub off_branch: usize,
    pub equilibria: usize,
    pub poisson_ratio: f64,
    /// Measured numbers and kinds of data that are further from what all others lead to expect than their errors allow.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contradictions: Vec<Contradiction>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gains: Vec<Gain>,
    pub priors: Priors,
}

impl Report {
    /// Reports of a posterior, one for each posture; with predictions of every muscle without its own measurement if `leave_out` is set.
    pub fn of_each(
        posterior: &Posterior<'_>,
        leave_out: bool,
        seed: u64,
    ) -> Result<Vec<Self>, PosteriorError> {
        let mixed = posterior.status == Status::Mixed;
        let left_out = match leave_out && mixed {
            // Where that sampling cannot begin or has no draws, the rest is reported without it.
            true => match without_each(&posterior.density, &posterior.mode) {
                Ok(all) => all.into_iter().map(|l| Some(l).filter(|l| l.spread.mean.is_finite())).collect(),
                Err(_) => vec![None; posterior.density.seen.len()],
            },
            false => vec![None; posterior.density.seen.len()],
        };
        let fitted = if mixed { fitted(posterior, seed_of(seed, 1 << 23)) } else { Vec::new() };
        let scaled = Scaled::new(&posterior.density, &posterior.draws);
        let contradictions = contradictions(&posterior.density, &posterior.mode);
        let all = All { posterior, left_out, fitted, scaled, contradictions, seed };
        Ok((0..posterior.density.postures()).map(|posture| Self::new(&all, posture)).collect())
    }

    fn new(all: &All<'_>, posture: usize) -> Self {
        let posterior = all.posterior;
        let ground = posterior.density.ground;
        let muscles = &ground.muscles;
        let shrinkage = (0..muscles.len()).map(|m| {
            let scores = scores_of(posterior, posture, m);
            let mean = scores.iter().sum::<f64>() / scores.len().max(1) as f64;
            // Without draws no variance was removed.
            if scores.is_empty() {
                return 0.0;
            }
            1.0 - scores.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / scores.len().max(1) as f64
        });
        Self {
            status: posterior.status,
            why: posterior.why.clone(),
            draws: posterior.draws.len(),
            postures: posterior.density.seen.labels.clone(),
            summary: (posterior.status == Status::Mixed).then(|| Summary::new(all, posture)),
            shrinkage: ByMuscle::new(muscles, shrinkage),
            variance_share: VarianceShare::new(posterior, posture),
            r_hat: posterior.mixing.r_hat,
            ess: Effective { bulk: posterior.mixing.bulk, tail: posterior.mixing.tail },
            divergences: posterior.divergences,
            folds: posterior.folds,
            off_branch: posterior.off_branch,
            equilibria: posterior.equilibria,
            poisson_ratio: ground.model.constants.poisson_ratio,
            contradictions: all
                .contradictions
                .iter()
                .filter(|c| c.posture.is_none_or(|p| p == posture))
                .cloned()
                .collect(),
            gains: Vec::new(),
            priors: ground.priors.clone(),
        }
    }
}

/// A posterior and the data that its reports share.
struct All<'a> {
    posterior: &'a Posterior<'a>,
    left_out: Vec<Option<LeftOut>>,
    fitted: Vec<Quantiles>,
    scaled: Scaled,
    contradictions: Vec<Contradiction>,
    seed: u64,
}

/// Scores of the tension of a muscle in all draws.
fn scores_of(posterior: &Posterior<'_>, posture: usize, muscle: usize) -> Vec<f64> {
    let scale = posterior.density.ground.priors.tension.scale_n_per_m;
    posterior.draws.iter().map(|d| half_normal::score(d.tension(posture, muscle) / scale)).collect()
}

/// Probability from which a sign is reported, and the probability that it must keep under another prior.
const TOLD_SIGN: f64 = 0.9;
const LEAST_SIGN: f64 = 0.85;

impl Change {
    /// The summary of a difference of tensions in all draws, N per metre of thickness.
    pub(super) fn new(values: &[f64], scaled: &Scaled) -> Self {
        let sensitivity = scaled.of(values);
        let rises = part_above_zero(values);
        let surer = rises.max(1.0 - rises);
        let [moved, uncertain] = sensitivity.probability_by_scale;
        Self {
            spread: Quantiles::of(values.iter().copied()),
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
        let density = &posterior.density;
        let (ground, draws) = (density.ground, &posterior.draws);
        let muscles = &ground.muscles;
        let values = |of: &dyn Fn(&Draw) -> f64| draws.iter().map(of).collect::<Vec<f64>>();
        let spread = |of: &dyn Fn(&Draw) -> f64| Quantiles::of(draws.iter().map(of));
        let change = |m: usize| Change::new(&values(&|d| d.change(posture, m)), &all.scaled);
        let modulus = &ground.priors.young_modulus;
        let mut random = fastrand::Rng::with_seed(seed_of(all.seed, 1 << 21));
        let factors: Vec<f64> = draws
            .iter()
            .map(|_| if modulus.off { 1.0 } else { (modulus.sd_ln * normal(&mut random)).exp() })
            .collect();
        let tension = |m: usize| {
            let own = values(&|d| d.tension(posture, m));
            let spread = Quantiles::of(own.iter().copied());
            let sensitivity = all.scaled.of(&own);
            let moved_by_prior = moved_by_prior(ground, m, &own, spread.interval_95[1]);
            Tension {
                spread,
                with_young_modulus: Quantiles::of(own.iter().zip(&factors).map(|(t, f)| t * f)),
                moved_by_prior,
                sensitivity,
                depends_on_prior: is_of_prior(moved_by_prior, &sensitivity),
            }
        };
        let own = density.seen.of_posture(posture);
        let names: Vec<String> = own.iter().map(|&i| density.seen.names[i].clone()).collect();
        let stretches = own.iter().map(|&i| StretchSummary {
            measured: density.seen.stretches[i],
            fitted: all.fitted[i],
            left_out: all.left_out[i].clone(),
        });
        let count = muscles.len();
        Self {
            changes_n: ByMuscle::new(muscles, (0..count).map(change)),
            tensions_n: ByMuscle::new(muscles, (0..count).map(tension)),
            baseline_tensions_n: ByMuscle::new(muscles, (0..count).map(|m| spread(&|d| d.meaning.tones[m]))),
            hyoid_mm: [0, 1].map(|axis| spread(&|d| 1e3 * d.meaning.postures[posture].hyoid[axis])),
            hyoid_tilt_rad_per_m: spread(&|d| d.meaning.tilt),
            directions: directions(posterior, posture),
            stretches: ByMuscle::new(&names, stretches),
        }
    }
}

/// The part by which the upper end of a tension's interval moves if the scale of its prior is half as large again, from draws weighted by
/// the ratio of both densities. Zero for a tension that the priors fix.
pub(super) fn moved_by_prior(ground: &Ground, muscle: usize, tensions: &[f64], upper: f64) -> f64 {
    if ground.priors.fixed_tension(&ground.muscles[muscle]).is_some() {
        return 0.0;
    }
    let scale = ground.priors.tension.scale_n_per_m;
    let more = 0.5 * (1.0 - OTHER_SCALE.powi(-2)) / (scale * scale);
    let weighed = tensions.iter().map(|&tension| (tension, (tension * tension * more).min(50.0).exp()));
    Quantiles::weighted(weighed.collect()).interval_95[1] / upper - 1.0
}

/// Whether the upper end of a tension's interval depends on the prior more than on the data.
pub(super) fn is_of_prior(moved_by_prior: f64, sensitivity: &Sensitivity) -> bool {
    moved_by_prior > MOST_MOVED || sensitivity.is_of_prior()
}

impl VarianceShare {
    fn new(posterior: &Posterior<'_>, posture: usize) -> Option<Self> {
        let density = &posterior.density;
        let ground = density.ground;
        let parts = Parts::new(density, &posterior.mode);
        let unit = |weights: &[(Parameter, f64)]| {
            let each = density.parameters.iter();
            let weight = |p: &Parameter| weights.iter().find(|(q, _)| q == p).map_or(0.0, |(_, w)| *w);
            DVector::from_iterator(density.parameters.len(), each.map(weight))
        };
        let scales = (ground.priors.tension.scale_n_per_m, ground.priors.baseline.scale_n_per_m);
        let (mut tensions, mut changes) = (Vec::new(), Vec::new());
        for (m, name) in ground.muscles.iter().enumerate() {
            let (own, over) = (Parameter::Tension(posture, m), Parameter::Tone(m));
            if density.parameters.contains(&own) {
                tensions.push((name.clone(), parts.of_scores(&unit(&[(own, 1.0)]))?));
                changes.push(parts.of_scores(&unit(&[(own, scales.0), (over, -scales.1)]))?);
            }
        }
        let positions = density.seen.of_posture(posture);
        let left_out: Vec<Shares> =
            positions.into_iter().map(|i| parts.of_left_out(i)).collect::<Option<_>>()?;
        let mean = |all: &mut dyn Iterator<Item = Shares>| Shares::mean(&all.collect::<Vec<_>>());
        Some(Self {
            tension: mean(&mut tensions.iter().map(|(_, s)| s.0)),
            change: mean(&mut changes.iter().map(|s| s.0)),
            tension_if_known: mean(&mut tensions.iter().map(|(_, s)| s.1)),
            change_if_known: mean(&mut changes.iter().map(|s| s.1)),
            tensions: ByMuscle(tensions.into_iter().map(|(name, s)| (name, s.0)).collect()),
            left_out_stretch: Shares::mean(&left_out),
        })
    }
}
