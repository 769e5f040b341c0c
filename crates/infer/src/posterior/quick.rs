//! The posterior in a hurry: its normal approximation at the most probable point, in the scores, of which draws cost nothing.
//!
//! It has all that the posterior has but the curvature that a normal distribution has not; for a verdict, not for an interval of a table.

use nalgebra::DVector;

use tongue_core::random::{normals, seed_of};

use super::PosteriorError;
use super::density::Density;
use super::ground::Ground;
use super::map::Mode;
use super::seen::Seen;
use super::spread::Spread;

/// Draws of the normal approximation, each with the one on the other side of the mode.
const DRAWS: usize = 4000;
const SEED: u64 = 7;

/// What is known of a muscle in a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct QuickMuscle {
    /// Its name.
    pub muscle: String,
    /// Probability that it pulls harder than in the baseline.
    pub probability_rises: f64,
    /// Tension, N per metre of thickness.
    pub tension: Spread,
    /// Tension in the baseline, N per metre of thickness.
    pub baseline_tension: Spread,
    /// Difference of both, N per metre of thickness.
    pub change: Spread,
    /// Part of the prior standard deviation of the tension's score that the data left: near one the interval is the prior's.
    pub prior_left: f64,
}

/// What is known of all muscles of the body in every posture of what was seen.
///
/// # Errors
/// As [`Mode::find`].
pub fn quick(ground: &Ground, seen: Seen) -> Result<Vec<Vec<QuickMuscle>>, PosteriorError> {
    let mut density = Density::new(ground, seen)?;
    let mode = Mode::find(&mut density)?;
    let whitened = mode.whitened().ok_or(PosteriorError::Covariance)?;
    let scores: Vec<DVector<f64>> = (0..DRAWS / 2)
        .flat_map(|i| {
            let z = normals(mode.scores.len(), &mut fastrand::Rng::with_seed(seed_of(SEED, i)));
            [whitened.at(&z), whitened.at(&-z)]
        })
        .collect();
    let drawn: Vec<_> = scores.iter().map(|g| density.meaning(g).0).collect();
    let covariance = &whitened.spread * whitened.spread.transpose();
    let one = |posture: usize, m: usize| {
        let own = || drawn.iter().map(|d| d.postures[posture].tensions[m]);
        let tones = || drawn.iter().map(|d| d.tones[m]);
        let changes: Vec<f64> = own().zip(tones()).map(|(f, f0)| f - f0).collect();
        let parameter = super::Parameter::Tension(posture, m);
        let place = density.parameters.iter().position(|p| *p == parameter);
        QuickMuscle {
            muscle: ground.muscles[m].clone(),
            probability_rises: changes.iter().filter(|c| **c > 0.0).count() as f64 / DRAWS as f64,
            tension: Spread::of(own()),
            baseline_tension: Spread::of(tones()),
            change: Spread::of(changes),
            prior_left: place.map_or(0.0, |p| covariance[(p, p)].sqrt()),
        }
    };
    let of_posture = |posture: usize| (0..ground.muscles.len()).map(|m| one(posture, m)).collect();
    Ok((0..density.postures()).map(of_posture).collect())
}
