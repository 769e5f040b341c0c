//! What is predicted of stretches: of those that were measured, and of each as if it had not been.
//!
//! Given the tensions, a stretch is normal about `y_m - (Q r)_m / Q_mm` with the variance `1/Q_mm`, `Q = C⁻¹` and `r` the residuals, if all
//! other stretches are known. So draws of the whole posterior, each weighed by one over the density of what was measured there, are draws
//! of the posterior that has not seen it (Gelfand, Dey and Chang 1992). Where too few of them count, pairs of the
//! [library](super::library) are weighed, and where too few of these do, it is sampled anew.

use crate::random::{normals, seed_of};

use super::PosteriorError;
use super::density::Density;
use super::map::Mode;
use super::run::{Draw, Posterior, Settings, sample_at};
use super::score::{How, LeftOut, Part, about, left_out};
use super::spread::Spread;

/// Fewest effective draws or pairs with which weights will do: each end of a 95 % interval is then sure to a third of a standard deviation.
pub const FEWEST_EFFECTIVE: f64 = 100.0;
/// Draws where the weights will not do.
const OWN_DRAWS: usize = 800;

/// With fewer effective draws of its own a prediction is not told.
const LEAST_TRUSTED: f64 = 100.0;

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
/// [`PosteriorError`] where it cannot begin.
pub fn without_each(posterior: &Posterior<'_>, seed: u64) -> Result<Vec<Option<LeftOut>>, PosteriorError> {
    (0..posterior.density.seen.muscles.len()).map(|i| without(posterior, i, seed_of(seed, i))).collect()
}

fn without(posterior: &Posterior<'_>, position: usize, seed: u64) -> Result<Option<LeftOut>, PosteriorError> {
    let density = &posterior.density;
    let (muscle, rounding) = (density.seen.muscles[position], density.seen.rounding[position]);
    let measured = density.seen.stretches[position];
    let (draws, sd) = conditional(density, &posterior.draws, position);
    let least = draws.iter().map(|(_, log)| *log).fold(f64::INFINITY, f64::min);
    let parts: Vec<Part> =
        draws.iter().map(|&(mean, log)| Part { mean, weight: (least - log).exp() }).collect();
    let found = left_out(&parts, sd, measured, How::Weighed, seed);
    if found.effective >= FEWEST_EFFECTIVE {
        return Ok(Some(found));
    }
    if !density.ground.is_of_springs() {
        // Neither a library of its own nor a posterior for every muscle is worth what they would cost in such a body.
        return Ok(None);
    }
    let mut other = density.of(density.seen.without(position))?;
    let mode = Mode::find_from(&mut other, &posterior.mode.scores, &posterior.mode.place)?;
    let (parts, sd, effective) = density.ground.library()?.predict(&other, muscle, rounding);
    if effective >= FEWEST_EFFECTIVE {
        return Ok(Some(left_out(&parts, sd, measured, How::Library, seed)));
    }
    let own = by_own_draws(other, mode, (muscle, measured, rounding), &Settings { draws: OWN_DRAWS, seed })?;
    Ok(Some(own).filter(|own| own.effective >= LEAST_TRUSTED))
}

/// What draws of its own say of the stretch of a muscle that `density` has not seen, given with what was measured of it and the variance of
/// its rounding.
///
/// # Errors
/// [`PosteriorError`] where it cannot begin.
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
