//! Directions in the space of tensions, tones and the hyoid's place, and how well the data resolve each.

use serde::Serialize;

use tongue_input::measured::ByMuscle;

use super::run::Posterior;
use super::unknowns::Parameter;

/// A direction is resolved where its standard deviation, in scores, is below this part of the prior's.
const RESOLVED: f64 = 0.5;

/// A direction in the space of scores of tensions, tones and the hyoid's place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Direction {
    /// Standard deviation along the direction, as a part of the prior's.
    pub sd_left: f64,
    pub resolved: bool,
    pub direction: ByMuscle<f64>,
}

/// Directions in the space of everything that is sampled of a posture and its baseline, ordered by the standard deviation that the data
/// leave along each, as a part of the prior's; linearised at the most probable point. There are as many as measured stretches, which
/// cannot resolve more.
pub(super) fn directions(posterior: &Posterior<'_>, posture: usize) -> Vec<Direction> {
    let density = &posterior.density;
    let muscles = &density.ground.muscles;
    let name = |p: &Parameter| match p {
        Parameter::Tension(v, m) if *v == posture => Some(format!("F {}", muscles[*m])),
        Parameter::Hyoid(v, axis) if *v == posture => Some(format!("hyoid {}", ["x", "y"][*axis])),
        Parameter::Tone(m) => Some(format!("F0 {}", muscles[*m])),
        Parameter::Tilt => Some("hyoid's tilt".to_owned()),
        _ => None,
    };
    let own: Vec<(usize, String)> =
        density.parameters.iter().enumerate().filter_map(|(i, p)| Some((i, name(p)?))).collect();
    let numbers: Vec<usize> = own.iter().map(|(i, _)| *i).collect();
    let Some(factor) = posterior.mode.precision.clone().cholesky() else { return Vec::new() };
    let covariance = factor.inverse().select_rows(&numbers).select_columns(&numbers);
    let eigen = ((&covariance + covariance.transpose()) * 0.5).symmetric_eigen();
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    order.truncate(density.rows().len());
    let direction = |i: usize| {
        let sd_left = eigen.eigenvalues[i].max(0.0).sqrt();
        let vector = eigen.eigenvectors.column(i);
        let largest = vector.iter().fold(0.0, |m: f64, v| if v.abs() > m.abs() { *v } else { m });
        let named = own.iter().zip(vector.iter());
        Direction {
            sd_left,
            resolved: sd_left < RESOLVED,
            direction: ByMuscle(named.map(|((_, name), v)| (name.clone(), v * largest.signum())).collect()),
        }
    };
    order.into_iter().map(direction).collect()
}
