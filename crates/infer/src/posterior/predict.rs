//! What is predicted of stretches: of those that were measured, and of each as if it had not been.
//!
//! Given the tensions, a stretch is normal about `y_m - (Q r)_m / Q_mm` with the variance `1/Q_mm`, `Q = C⁻¹` and `r` the residuals, if all
//! other stretches are known. So draws of the whole posterior, each weighed by one over the density of what was measured there, are draws
//! of the posterior that has not seen it (Gelfand, Dey and Chang 1992). Where too few of them count,
//! [pairs](super::pairs) are solved and weighed, and where too few of these do, it is sampled anew.

use tongue_core::random::{normals, seed_of};

use super::PosteriorError;
use super::density::Density;
use super::map::Mode;
use super::pairs::Pairs;
use super::run::{Draw, Posterior, Settings, sample_at};
use super::score::{How, LeftOut, Part, about, left_out};
use super::spread::Spread;

/// Fewest effective draws or pairs with which they will do: each end of a 95 % interval is then sure to a third of a standard deviation.
pub const FEWEST_EFFECTIVE: f64 = 100.0;
/// Draws where weights will not do.
const OWN_DRAWS: usize = 800;

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
    let mut found: Vec<LeftOut> = (0..posterior.density.seen.muscles.len())
        .map(|position| weighed(posterior, position, seed_of(seed, position)))
        .collect();
    let few: Vec<usize> = (0..found.len()).filter(|i| found[*i].effective < FEWEST_EFFECTIVE).collect();
    // In such a body neither pairs nor a posterior for every muscle are worth what they would cost.
    if posterior.density.ground.is_of_springs() {
        let others = unseen(&posterior.density, &posterior.mode, &few, seed)?;
        few.into_iter().zip(others).for_each(|(position, other)| found[position] = other);
    }
    Ok(found.into_iter().map(|f| Some(f).filter(|f| f.effective >= FEWEST_EFFECTIVE)).collect())
}

/// By the draws of the whole posterior, each weighed.
fn weighed(posterior: &Posterior<'_>, position: usize, seed: u64) -> LeftOut {
    let density = &posterior.density;
    let (draws, sd) = conditional(density, &posterior.draws, position);
    let least = draws.iter().map(|(_, log)| *log).fold(f64::INFINITY, f64::min);
    let parts: Vec<Part> =
        draws.iter().map(|&(mean, log)| Part { mean, weight: (least - log).exp() }).collect();
    left_out(&parts, sd, density.seen.stretches[position], How::Weighed, seed)
}

/// What is predicted of measured stretches, given by their positions, each without its own measurement, where the mode of all is known: by pairs
/// that they share, or by draws of its own where too few of these count.
///
/// # Errors
/// [`PosteriorError`] where it cannot begin.
pub fn unseen(
    density: &Density<'_>,
    mode: &Mode,
    positions: &[usize],
    seed: u64,
) -> Result<Vec<LeftOut>, PosteriorError> {
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    let mut others = Vec::with_capacity(positions.len());
    let mut modes = Vec::with_capacity(positions.len());
    for &position in positions {
        let mut other = density.of(density.seen.without(position))?;
        modes.push(Mode::find_near(&mut other, mode)?);
        others.push(other);
    }
    let pairs = Pairs::about(density, &modes, seed)?;
    let each = positions.iter().zip(others.into_iter().zip(modes));
    each.map(|(&position, (other, mode))| {
        one_unseen(density, position, other, mode, &pairs, seed_of(seed, position))
    })
    .collect()
}

/// What `other`, which has not seen a stretch that `density` has seen, predicts of it.
fn one_unseen(
    density: &Density<'_>,
    position: usize,
    other: Density<'_>,
    mode: Mode,
    pairs: &Pairs,
    seed: u64,
) -> Result<LeftOut, PosteriorError> {
    let seen = &density.seen;
    let (muscle, measured) = (seen.muscles[position], seen.stretches[position]);
    let (gain, sd) = about(&other, muscle, seen.rounding[position]);
    let (parts, effective) = pairs.predict(&other, muscle, &gain);
    if effective >= FEWEST_EFFECTIVE {
        return Ok(LeftOut { effective, ..left_out(&parts, sd, measured, How::Pairs, seed) });
    }
    let own = sample_at(other, mode, &Settings { draws: OWN_DRAWS, seed })?;
    let part = |d: &Draw| {
        let error = gain.dot(&own.density.residuals(&d.lengths, &d.baseline_lengths));
        Part { mean: d.stretch(muscle) + error, weight: 1.0 }
    };
    let parts: Vec<Part> = own.draws.iter().map(part).collect();
    let found = left_out(&parts, sd, measured, How::Sampled, seed);
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
