//! What a posterior says, first to last: changes, tensions, directions, sources of variance, stretches. `posterior` of `fit.json`.

use nalgebra::DVector;
use serde::Serialize;

use crate::track::scores;
use tongue_core::random::{normal, seed_of};
use tongue_input::measured::ByMuscle;

use super::PosteriorError;
use super::density::Parameter;
use super::predict::{fitted, without_each};
use super::priors::Priors;
use super::run::{Draw, Posterior, Status};
use super::score::LeftOut;
use super::share::{Parts, Shares};
use super::spread::Spread;

/// A direction is resolved where its standard deviation, in scores, is below this part of the prior's.
const RESOLVED: f64 = 0.5;
/// Another scale of the prior, as a factor, and the part by which the upper end of an interval may move with it before that is told.
const OTHER_SCALE: f64 = 1.5;
const MOST_MOVED: f64 = 0.15;

/// By how much more a muscle pulls than in the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// N per metre of thickness.
    #[serde(flatten)]
    pub spread: Spread,
    /// Probability that it pulls harder than in the baseline.
    pub probability_rises: f64,
}

/// A tension in the vowel, N per metre of thickness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tension {
    /// N per metre of thickness.
    #[serde(flatten)]
    pub spread: Spread,
    /// The same where Young's modulus is as uncertain as its prior.
    pub with_young_modulus: Spread,
    /// By which part the upper end of its 95 % interval moves where the scale of its prior is half as large again.
    pub moved_by_prior: f64,
    /// Whether that is so much that the interval is the prior's rather than the data's.
    pub depends_on_prior: bool,
}

/// What is said of the stretch of a measured muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Measured.
    pub measured: f64,
    /// What the model gives, having seen it.
    pub fitted: Spread,
    /// What is predicted without its own measurement; null where that was not asked for or has not mixed.
    pub left_out: Option<LeftOut>,
}

/// A direction of tensions, tones and the hyoid's place, in scores.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Direction {
    /// Standard deviation along it, as part of the prior's.
    pub sd_left: f64,
    /// Whether the data have resolved it.
    pub resolved: bool,
    /// Unit vector.
    pub direction: ByMuscle<f64>,
}

/// What was found, in the order in which it is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// By how much more every muscle pulls than in the baseline.
    pub changes_n: ByMuscle<Change>,
    /// Tensions.
    pub tensions_n: ByMuscle<Tension>,
    /// Tensions in the baseline.
    pub baseline_tensions_n: ByMuscle<Spread>,
    /// Displacement of the hyoid, x and y, mm.
    pub hyoid_mm: [Spread; 2],
    /// Directions of tensions, tones and the hyoid's place, the most resolved first.
    pub directions: Vec<Direction>,
    /// Stretches.
    pub stretches: ByMuscle<Stretch>,
}

/// Parts of variances by source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VarianceShare {
    /// Of a tension: the mean over muscles.
    pub tension: Shares,
    /// Of the tension of every muscle.
    pub tensions: ByMuscle<Shares>,
    /// Of a change: the mean over muscles.
    pub change: Shares,
    /// Of a stretch that is left out: the mean over measured muscles.
    pub left_out_stretch: Shares,
}

/// Effective draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Effective {
    /// Smallest bulk effective sample size of all that is told.
    pub bulk: f64,
    /// Smallest tail one.
    pub tail: f64,
}

/// A posterior as it is reported.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Whether the chains have mixed.
    pub status: Status,
    /// Why not; empty where they have.
    pub why: String,
    /// Draws that were kept.
    pub draws: usize,
    /// What was found; null where the chains have not mixed: an interval that cannot be trusted is not printed.
    pub summary: Option<Summary>,
    /// Of every muscle which part of the prior variance of the score of its tension the data took away.
    pub shrinkage: ByMuscle<f64>,
    /// Where the variance comes from.
    pub variance_share: Option<VarianceShare>,
    /// Largest rank-normalised split R-hat of all that is told.
    pub r_hat: f64,
    /// Effective draws.
    pub ess: Effective,
    /// Trajectories whose energy went wrong.
    pub divergences: usize,
    /// Trajectories that ended where there is no stable equilibrium: there the density is zero.
    pub folds: usize,
    /// Trajectories that ended in a shape to which tensions do not lead from rest: there the density is zero too.
    pub off_branch: usize,
    /// Equilibria that were solved.
    pub equilibria: usize,
    /// Poisson's ratio of the body.
    pub poisson_ratio: f64,
    /// What was believed beforehand.
    pub priors: Priors,
}

impl Report {
    /// Tells a posterior; with what is predicted of every muscle without its own measurement, if that is wanted.
    ///
    /// # Errors
    /// [`PosteriorError`] of what is sampled anew.
    pub fn new(posterior: &Posterior<'_>, leave_out: bool, seed: u64) -> Result<Self, PosteriorError> {
        let ground = posterior.density.ground;
        let muscles = &ground.muscles;
        let mixed = posterior.status == Status::Mixed;
        let shrinkage = (0..muscles.len()).map(|m| {
            let scores = scores_of(posterior, m);
            let mean = scores.iter().sum::<f64>() / scores.len().max(1) as f64;
            // Without draws nothing was taken away.
            if scores.is_empty() {
                return 0.0;
            }
            1.0 - scores.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / scores.len().max(1) as f64
        });
        let summary = match mixed {
            true => Some(Summary::new(posterior, leave_out, seed)?),
            false => None,
        };
        Ok(Self {
            status: posterior.status,
            why: posterior.why.clone(),
            draws: posterior.draws.len(),
            summary,
            shrinkage: ByMuscle::new(muscles, shrinkage),
            variance_share: VarianceShare::new(posterior),
            r_hat: posterior.mixing.r_hat,
            ess: Effective { bulk: posterior.mixing.bulk, tail: posterior.mixing.tail },
            divergences: posterior.divergences,
            folds: posterior.folds,
            off_branch: posterior.off_branch,
            equilibria: posterior.equilibria,
            poisson_ratio: ground.model.constants.poisson_ratio,
            priors: ground.priors.clone(),
        })
    }
}

/// Scores of the tension of a muscle in all draws.
fn scores_of(posterior: &Posterior<'_>, muscle: usize) -> Vec<f64> {
    let scale = posterior.density.ground.priors.tension.scale_n_per_m;
    posterior.draws.iter().map(|d| scores::score(d.meaning.tensions[muscle] / scale)).collect()
}

impl Summary {
    fn new(posterior: &Posterior<'_>, leave_out: bool, seed: u64) -> Result<Self, PosteriorError> {
        let density = &posterior.density;
        let (ground, draws) = (density.ground, &posterior.draws);
        let muscles = &ground.muscles;
        let spread = |of: &dyn Fn(&Draw) -> f64| Spread::of(draws.iter().map(of));
        let change = |m: usize| Change {
            spread: spread(&|d| d.change(m)),
            probability_rises: draws.iter().filter(|d| d.change(m) > 0.0).count() as f64 / draws.len() as f64,
        };
        let modulus = &ground.priors.young_modulus;
        let mut random = fastrand::Rng::with_seed(seed_of(seed, 1 << 21));
        let factors: Vec<f64> = draws
            .iter()
            .map(|_| if modulus.off { 1.0 } else { (modulus.sd_ln * normal(&mut random)).exp() })
            .collect();
        let tension = |m: usize| {
            let own = spread(&|d| d.meaning.tensions[m]);
            let scaled = draws.iter().zip(&factors).map(|(d, f)| d.meaning.tensions[m] * f);
            let moved_by_prior = match ground.priors.fixed_tension(&muscles[m]) {
                Some(_) => 0.0,
                None => moved_by_prior(posterior, m, own.interval_95[1]),
            };
            Tension {
                spread: own,
                with_young_modulus: Spread::of(scaled),
                moved_by_prior,
                depends_on_prior: moved_by_prior > MOST_MOVED,
            }
        };
        let left_out = match leave_out {
            true => without_each(posterior, seed_of(seed, 1 << 22))?,
            false => vec![None; density.seen.muscles.len()],
        };
        let stretches =
            fitted(posterior, seed_of(seed, 1 << 23)).into_iter().zip(left_out).zip(&density.seen.stretches);
        let stretches =
            stretches.map(|((fitted, left_out), &measured)| Stretch { measured, fitted, left_out });
        let count = muscles.len();
        Ok(Self {
            changes_n: ByMuscle::new(muscles, (0..count).map(change)),
            tensions_n: ByMuscle::new(muscles, (0..count).map(tension)),
            baseline_tensions_n: ByMuscle::new(muscles, (0..count).map(|m| spread(&|d| d.meaning.tones[m]))),
            hyoid_mm: [0, 1].map(|axis| spread(&|d| 1e3 * d.meaning.hyoid[axis])),
            directions: directions(posterior),
            stretches: ByMuscle::new(&density.seen.names, stretches),
        })
    }
}

/// By which part the upper end of a tension's interval moves where the scale of its prior is half as large again: the draws weighed by
/// the ratio of both densities.
fn moved_by_prior(posterior: &Posterior<'_>, muscle: usize, upper: f64) -> f64 {
    let scale = posterior.density.ground.priors.tension.scale_n_per_m;
    let more = 0.5 * (1.0 - OTHER_SCALE.powi(-2)) / (scale * scale);
    let weighed = posterior.draws.iter().map(|d| {
        let tension = d.meaning.tensions[muscle];
        (tension, (tension * tension * more).min(50.0).exp())
    });
    Spread::weighted(weighed.collect()).interval_95[1] / upper - 1.0
}

/// Directions of everything that is sampled, by how much of the prior's standard deviation the data left along each, linearised at the most
/// probable point; as many as there are measured stretches, since along the others they say nothing.
fn directions(posterior: &Posterior<'_>) -> Vec<Direction> {
    let density = &posterior.density;
    let muscles = &density.ground.muscles;
    let name = |p: &Parameter| match p {
        Parameter::Tension(m) => format!("F {}", muscles[*m]),
        Parameter::Tone(m) => format!("F0 {}", muscles[*m]),
        Parameter::Hyoid(axis) => format!("hyoid {}", ["x", "y"][*axis]),
    };
    let eigen = posterior.mode.precision.clone().symmetric_eigen();
    let mut order: Vec<usize> = (0..density.parameters.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order.truncate(density.seen.muscles.len());
    let direction = |i: usize| {
        let sd_left = eigen.eigenvalues[i].sqrt().recip();
        let vector = eigen.eigenvectors.column(i);
        let largest = vector.iter().fold(0.0, |m: f64, v| if v.abs() > m.abs() { *v } else { m });
        let named = density.parameters.iter().zip(vector.iter());
        Direction {
            sd_left,
            resolved: sd_left < RESOLVED,
            direction: ByMuscle(named.map(|(p, v)| (name(p), v * largest.signum())).collect()),
        }
    };
    order.into_iter().map(direction).collect()
}

impl VarianceShare {
    fn new(posterior: &Posterior<'_>) -> Option<Self> {
        let density = &posterior.density;
        let ground = density.ground;
        let parts = Parts::new(density, &posterior.mode);
        let unit = |weights: &[(Parameter, f64)]| {
            DVector::from_iterator(
                density.parameters.len(),
                density
                    .parameters
                    .iter()
                    .map(|p| weights.iter().find(|(q, _)| q == p).map_or(0.0, |(_, w)| *w)),
            )
        };
        let scales = (ground.priors.tension.scale_n_per_m, ground.priors.baseline.scale_n_per_m);
        let (mut tensions, mut changes) = (Vec::new(), Vec::new());
        for (m, name) in ground.muscles.iter().enumerate() {
            let (own, over) = (Parameter::Tension(m), Parameter::Tone(m));
            if density.parameters.contains(&own) {
                tensions.push((name.clone(), parts.of_scores(&unit(&[(own, 1.0)]))?));
                changes.push(parts.of_scores(&unit(&[(own, scales.0), (over, -scales.1)]))?);
            }
        }
        let left_out: Option<Vec<Shares>> =
            (0..density.seen.muscles.len()).map(|i| parts.of_left_out(i)).collect();
        let each: Vec<Shares> = tensions.iter().map(|(_, s)| *s).collect();
        Some(Self {
            tension: Shares::mean(&each),
            tensions: ByMuscle(tensions),
            change: Shares::mean(&changes),
            left_out_stretch: Shares::mean(&left_out?),
        })
    }
}
