//! The sampled parameters, their physical values, and draws.
//!
//! Parameters are normal scores `g`. A tension is `F = s Z((1 + Phi(g)) / 2)` with `Z` the quantile of the normal distribution, which is
//! half-normal of scale `s`: never negative, with its median, 0.67 s, at `g = 0`.

use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// Range of scores, for tensions from 1e-5 s to 5.7 s.
pub(crate) const LOWEST: f64 = -4.6;
pub const HIGHEST: f64 = 5.3;

fn density(x: f64) -> f64 {
    (-0.5 * x * x).exp() / (SQRT_2 * PI.sqrt())
}

/// `1 - Phi(x)`.
pub fn upper_tail(x: f64) -> f64 {
    0.5 * libm::erfc(x / SQRT_2)
}

/// The `x >= 0` with `upper_tail(x) = p`, `p <= 1/2`: a rational approximation with an error of 4.5e-4 (Abramowitz and Stegun 1964, eq.
/// 26.2.23) and two steps of Halley's method.
fn of_upper_tail(p: f64) -> f64 {
    let t = (-2.0 * p.ln()).sqrt();
    let over = (0.010328 * t + 0.802853) * t + 2.515517;
    let under = ((0.001308 * t + 0.189269) * t + 1.432788) * t + 1.0;
    let halley = |x: f64| {
        let newton = (upper_tail(x) - p) / density(x);
        x + newton / (1.0 - 0.5 * x * newton)
    };
    halley(halley(t - over / under)).max(0.0)
}

/// Quantile of the normal distribution, `0 < p < 1`.
pub(crate) fn normal_quantile(p: f64) -> f64 {
    if p > 0.5 { of_upper_tail(1.0 - p) } else { -of_upper_tail(p) }
}

/// Tension over its scale, and its derivative by the score.
pub fn tension(score: f64) -> (f64, f64) {
    let g = score.clamp(LOWEST, HIGHEST);
    let z = of_upper_tail(0.5 * upper_tail(g));
    (z, density(g) / (2.0 * density(z)))
}

/// A sampled parameter; the number of the baseline is that after the last posture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in a posture, by the numbers of posture and muscle.
    Tension(usize, usize),
    /// Displacement of the hyoid along an axis, by the numbers of posture and axis.
    Hyoid(usize, usize),
    /// Tilt of the hyoid for every metre that it moves back, rad/m.
    Tilt,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Posture {
    pub tensions: Vec<f64>,
    pub hyoid: SVector<f64, 2>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterValues {
    /// The postures, then the baseline.
    pub postures: Vec<Posture>,
    /// Angle by which the hyoid tilts, its greater horn downwards, for every metre that it moves back, rad/m.
    pub tilt: f64,
}

impl ParameterValues {
    pub(super) fn get_mut(&mut self, parameter: Parameter) -> &mut f64 {
        match parameter {
            Parameter::Tension(posture, m) => &mut self.postures[posture].tensions[m],
            Parameter::Hyoid(posture, axis) => &mut self.postures[posture].hyoid[axis],
            Parameter::Tilt => &mut self.tilt,
        }
    }

    /// Tensions and displacements multiplied by `part`; the tilt, an angle for each metre of displacement, is kept.
    pub fn scaled(&self, part: f64) -> Self {
        let postures = self.postures.iter().map(|p| Posture {
            tensions: p.tensions.iter().map(|t| t * part).collect(),
            hyoid: p.hyoid * part,
        });
        Self { postures: postures.collect(), ..*self }
    }

    /// Tensions in the baseline, N per metre of thickness.
    pub fn tones(&self) -> &[f64] {
        self.postures.last().map_or(&[], |baseline| &baseline.tensions)
    }
}

/// A solved point, from whose shapes its neighbours are solved.
#[derive(Debug, Clone)]
pub struct SolvedPoint {
    /// Positions of all nodes in each posture and, last, in the baseline, m.
    pub shapes: Vec<Arc<Vec<SVector<f64, 2>>>>,
    /// Lengths of all muscles of the body in each of these shapes, shape by shape, m.
    pub lengths: Vec<f64>,
    /// Computed numbers of the auxiliary data.
    pub auxiliary: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Draw {
    pub chain: usize,
    pub number: usize,
    pub values: ParameterValues,
    /// Lengths of all muscles of the body in each posture and, last, in the baseline, m.
    pub lengths: Vec<f64>,
    /// Computed numbers of the auxiliary data.
    pub auxiliary: Vec<f64>,
    /// Logarithm of the density in the scores, up to a constant.
    pub log: f64,
    /// The contribution of the measurements to `log`.
    pub log_likelihood: f64,
}

impl Draw {
    /// The stretch in a row of the list of all muscles in all postures.
    pub fn stretch(&self, row: usize) -> f64 {
        let muscles = self.values.tones().len();
        self.lengths[row] / self.lengths[self.lengths.len() - muscles + row % muscles]
    }

    pub fn tension(&self, posture: usize, muscle: usize) -> f64 {
        self.values.postures[posture].tensions[muscle]
    }

    pub fn change(&self, posture: usize, muscle: usize) -> f64 {
        self.tension(posture, muscle) - self.values.tones()[muscle]
    }
}
