//! What each kind of data adds to what is known of the muscles, and data that contradict the others.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::track::scores;
use tongue_input::measured::ByMuscle;

use super::PosteriorError;
use super::density::Density;
use super::map::Mode;
use super::run::{Posterior, Settings, Status, sample};

/// Standard deviations of the changes of tensions in a posture without one kind of data and with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// The kind.
    pub kind: String,
    /// Without it, N per metre of thickness; null where the chains without it have not mixed.
    pub sd_without_n: Option<ByMuscle<f64>>,
    /// With it.
    pub sd_with_n: ByMuscle<f64>,
}

/// Of every kind of data beside the stretches what it adds in a posture: the posterior without it is sampled as that with it was.
///
/// # Errors
/// [`PosteriorError`] of the posterior without it.
pub fn gains(
    posterior: &Posterior<'_>,
    posture: usize,
    settings: &Settings,
) -> Result<Vec<Gain>, PosteriorError> {
    let density = &posterior.density;
    let of_kind = |kind: &String| {
        let without = sample(density.ground, density.seen.without_kind(kind), settings)?;
        let told = without.status == Status::Mixed;
        Ok(Gain {
            kind: kind.clone(),
            sd_without_n: told.then(|| sd_of_changes(&without, posture)),
            sd_with_n: sd_of_changes(posterior, posture),
        })
    };
    density.seen.beside.iter().map(|b| of_kind(&b.kind)).collect()
}

fn sd_of_changes(posterior: &Posterior<'_>, posture: usize) -> ByMuscle<f64> {
    let muscles = &posterior.density.ground.muscles;
    let sd = |m: usize| {
        let changes = || posterior.draws.iter().map(|d| d.change(posture, m));
        let count = posterior.draws.len().max(1) as f64;
        let mean = changes().sum::<f64>() / count;
        (changes().map(|c| (c - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    ByMuscle::new(muscles, (0..muscles.len()).map(sd))
}

/// A probability below this contradicts what all other data lead to expect.
const CONTRADICTS: f64 = 1e-3;

/// A measured number that is further from what all others lead to expect than their errors allow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contradiction {
    /// What was measured.
    pub name: String,
    /// How many standard deviations of its prediction from the other data it is away.
    pub standard_deviations: f64,
    /// The probability of being so far away.
    pub p: f64,
}

/// The measured numbers that contradict the others, each predicted from the others in the linear problem at the mode: with
/// `K = J J' + C` and `r` the residuals of the prior's mean, number i is `(K⁻¹ r)_i / sqrt((K⁻¹)_ii)` standard deviations away.
pub fn contradictions(density: &Density<'_>, mode: &Mode) -> Vec<Contradiction> {
    let jacobian = mode.linear.jacobian.select_rows(density.rows());
    let covariance: DMatrix<f64> = &jacobian * jacobian.transpose() + density.covariance();
    let Some(inverse) = covariance.cholesky().map(|factor| factor.inverse()) else { return Vec::new() };
    let place = &mode.place;
    let residuals: DVector<f64> =
        density.residuals(&place.lengths, &place.baseline_lengths, &place.beside) + &jacobian * &mode.scores;
    let pulls = &inverse * residuals;
    let told = density.seen.measured_names().into_iter().enumerate().map(|(i, name)| {
        let away = pulls[i] / inverse[(i, i)].sqrt();
        Contradiction { name, standard_deviations: away, p: two_sided(away) }
    });
    told.filter(|c| c.p < CONTRADICTS).collect()
}

/// Probability that a standard normal number is further from zero.
fn two_sided(away: f64) -> f64 {
    2.0 * scores::upper_tail(away.abs())
}
