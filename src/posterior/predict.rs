//! What is predicted of stretches: of those that were measured, and of each as if it had not been.
//!
//! Given the tensions, a stretch is normal about `y_m - (Q r)_m / Q_mm` with the variance `1/Q_mm`, `Q = C⁻¹` and `r` the residuals, if all
//! other stretches are known. So draws of the whole posterior, each weighed by one over the density of what was measured there, are draws
//! of the posterior that has not seen it (Gelfand, Dey and Chang 1992). Where too few of them count, it is sampled anew.

use nalgebra::DVector;
use serde::Serialize;

use super::PosteriorError;
use super::density::Density;
use super::hmc::{normal, normals, seed_of};
use super::map::Mode;
use super::run::{Draw, Posterior, Settings, Status, sample_at};
use super::spread::{Spread, effective};

/// Fewest effective draws with which weights will do.
pub const FEWEST_EFFECTIVE: f64 = 400.0;
/// Draws where the weights will not do.
const OWN_DRAWS: usize = 800;

/// With fewer effective draws of its own a prediction is not told.
const LEAST_TRUSTED: f64 = 200.0;

/// How a prediction without the muscle's own measurement was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum How {
    /// From weighted draws.
    Weighed,
    /// From draws of its own.
    Sampled,
}

/// What is predicted of a stretch by what it was not measured for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// Of the measured stretch, with all errors.
    pub spread: Spread,
    /// Logarithm of the density of what was measured.
    pub log_score: f64,
    /// Continuous ranked probability score (Gneiting and Raftery 2007).
    pub crps: f64,
    /// How it was made.
    pub how: How,
    /// Effective draws.
    pub effective: f64,
}

/// A normal distribution of a stretch, given a draw, and the weight of the draw.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// Mean.
    pub mean: f64,
    /// Weight.
    pub weight: f64,
}

/// What weighted normal parts of one standard deviation say of a measured stretch.
pub fn left_out(parts: &[Part], sd: f64, measured: f64, how: How, seed: u64) -> LeftOut {
    let mut random = fastrand::Rng::with_seed(seed);
    let draws: Vec<(f64, f64)> =
        parts.iter().map(|p| (p.mean + sd * normal(&mut random), p.weight)).collect();
    let total: f64 = parts.iter().map(|p| p.weight).sum();
    let density = |p: &Part| {
        let z = (measured - p.mean) / sd;
        p.weight * (-0.5 * z * z).exp() / (sd * std::f64::consts::TAU.sqrt())
    };
    let density = parts.iter().map(density).sum::<f64>() / total;
    let weights: Vec<f64> = parts.iter().map(|p| p.weight).collect();
    LeftOut {
        crps: crps(&draws, measured),
        spread: Spread::weighted(draws),
        log_score: density.max(f64::MIN_POSITIVE).ln(),
        how,
        effective: effective(&weights),
    }
}

/// `E|x - y| - E|x - x'|/2` of weighted draws.
fn crps(draws: &[(f64, f64)], measured: f64) -> f64 {
    let mut sorted = draws.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|d| d.1).sum();
    let near = sorted.iter().map(|d| d.1 * (d.0 - measured).abs()).sum::<f64>() / total;
    // Of all pairs: the distance between neighbours times the weights on both sides.
    let (mut below, mut apart) = (0.0, 0.0);
    for pair in sorted.windows(2) {
        below += pair[0].1 / total;
        apart += (pair[1].0 - pair[0].0) * below * (1.0 - below);
    }
    near - apart
}

/// Of every draw the conditional mean of the measured stretch at a position, with the logarithm of the density of what was measured
/// there; and the standard deviation about that mean.
fn conditional(density: &Density<'_>, draws: &[Draw], position: usize) -> (Vec<(f64, f64)>, f64) {
    let inverse = density.factor().inverse();
    let own = inverse[(position, position)];
    let row = inverse.row(position);
    let measured = density.seen.stretches[position];
    let each = |d: &Draw| {
        let pull = row.transpose().dot(&density.residuals(&d.lengths, &d.baseline_lengths));
        (measured - pull / own, 0.5 * own.ln() - 0.5 * pull * pull / own)
    };
    (draws.iter().map(each).collect(), own.recip().sqrt())
}

/// What is predicted of every measured stretch without its own measurement; a posterior whose chains have not mixed is none to predict
/// from.
///
/// # Errors
/// As [`sample_at`].
pub fn without_each(posterior: &Posterior<'_>, seed: u64) -> Result<Vec<Option<LeftOut>>, PosteriorError> {
    (0..posterior.density.seen.muscles.len()).map(|i| without(posterior, i, seed_of(seed, i))).collect()
}

fn without(posterior: &Posterior<'_>, position: usize, seed: u64) -> Result<Option<LeftOut>, PosteriorError> {
    let density = &posterior.density;
    let measured = density.seen.stretches[position];
    let (draws, sd) = conditional(density, &posterior.draws, position);
    let least = draws.iter().map(|(_, log)| *log).fold(f64::INFINITY, f64::min);
    let parts: Vec<Part> =
        draws.iter().map(|&(mean, log)| Part { mean, weight: (least - log).exp() }).collect();
    let found = left_out(&parts, sd, measured, How::Weighed, seed);
    if found.effective >= FEWEST_EFFECTIVE && posterior.status == Status::Mixed {
        return Ok(Some(found));
    }
    let mut other = density.of(density.seen.without(position))?;
    let mode = Mode::find_from(&mut other, &posterior.mode.scores, &posterior.mode.place)?;
    let (muscle, rounding) = (density.seen.muscles[position], density.seen.rounding[position]);
    let own = by_own_draws(other, mode, (muscle, measured, rounding), &Settings { draws: OWN_DRAWS, seed })?;
    Ok(Some(own).filter(|own| own.effective >= LEAST_TRUSTED))
}

/// What draws of its own say of the stretch of a muscle that `density` has not seen, given with what was measured of it and the variance of
/// its rounding.
///
/// # Errors
/// As [`sample_at`].
pub fn by_own_draws(
    density: Density<'_>,
    mode: Mode,
    (muscle, measured, rounding): (usize, f64, f64),
    settings: &Settings,
) -> Result<LeftOut, PosteriorError> {
    let (gain, sd) = about(&density, muscle, rounding);
    let own = sample_at(density, mode, settings)?;
    let part = |d: &Draw| {
        let error = gain.dot(&own.density.residuals(&d.lengths, &d.baseline_lengths));
        Part { mean: d.stretch(muscle) + error, weight: 1.0 }
    };
    let parts: Vec<Part> = own.draws.iter().map(part).collect();
    let found = left_out(&parts, sd, measured, How::Sampled, settings.seed);
    Ok(LeftOut { effective: own.mixing.bulk.min(own.mixing.tail), ..found })
}

/// How the stretch of a muscle that `density` has not seen goes with the residuals of those that it has, given the tensions; and its
/// standard deviation about that.
pub fn about(density: &Density<'_>, muscle: usize, rounding: f64) -> (DVector<f64>, f64) {
    let across = DVector::from_iterator(
        density.seen.muscles.len(),
        density.seen.muscles.iter().map(|&m| density.geometry[(m, muscle)]),
    );
    let gain = density.factor().solve(&across);
    let own = density.geometry[(muscle, muscle)] + density.discrepancy() + density.rounding(rounding);
    let variance = own - gain.dot(&across);
    (gain, variance.max(f64::MIN_POSITIVE).sqrt())
}

/// The stretches that the model gives, with the error of its geometry as far as the measurements tell it; one spread for every measured
/// muscle.
pub fn fitted(posterior: &Posterior<'_>, seed: u64) -> Vec<Spread> {
    let density = &posterior.density;
    let seen = &density.seen.muscles;
    let geometry = density.geometry.select_rows(seen).select_columns(seen);
    let gain = &geometry * density.factor().inverse();
    let left = &geometry - &gain * &geometry;
    // Rounding may leave an eigenvalue a little below zero where there is no geometry.
    let eigen = ((&left + left.transpose()) * 0.5).symmetric_eigen();
    let roots = nalgebra::DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
    let root = &eigen.eigenvectors * roots;
    let mut random = fastrand::Rng::with_seed(seed);
    let mut all = vec![Vec::with_capacity(posterior.draws.len()); seen.len()];
    for d in &posterior.draws {
        let residuals = density.residuals(&d.lengths, &d.baseline_lengths);
        let error = &gain * residuals + &root * normals(seen.len(), &mut random);
        for (i, &m) in seen.iter().enumerate() {
            all[i].push(d.stretch(m) + error[i]);
        }
    }
    all.into_iter().map(Spread::of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_of_a_normal_distribution_are_the_exact_ones() {
        let parts = vec![Part { mean: 1.0, weight: 1.0 }; 40_000];
        let found = left_out(&parts, 0.2, 1.1, How::Weighed, 1);
        let z: f64 = 0.5;
        let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        assert!((found.log_score - (density / 0.2).ln()).abs() < 1e-12);
        // sd (z (2 Phi(z) - 1) + 2 phi(z) - 1/sqrt(pi)), Gneiting and Raftery 2007; Phi(0.5) = 0.69146.
        let exact =
            0.2 * (z * (2.0 * 0.691_462_5 - 1.0) + 2.0 * density - std::f64::consts::PI.sqrt().recip());
        assert!((found.crps / exact - 1.0).abs() < 0.02, "{} {exact}", found.crps);
        assert!((found.spread.interval_95[1] - (1.0 + 0.2 * 1.96)).abs() < 0.01);
    }
}
