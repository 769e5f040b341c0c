//! The density: how probable tensions, tones and a place of the hyoid are, given the measured stretches.
//!
//! ```text
//! y ~ N(s, C),  s = L(F, d) / L(F0, 0),  C = C_geo + sd² I + R
//! F = scale Z((1 + Phi(g))/2) with g ~ N(0, 1) (half-normal), F0 likewise, d = sd g
//! ```
//! All that is sampled is in the scores `g`, so that there are no bounds. The derivatives (`evaluator`) need one back-substitution for the
//! vowel and one for the baseline, however many unknowns there are.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector};

use crate::inverse::Matched;
use crate::track::scores;
use tongue_core::statics::lanes::{Equilibrium, Lanes, Load};
use tongue_core::statics::{SolveSettings, SolveStatus};

use super::PosteriorError;
use super::ground::Ground;

/// The stretches that were measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Names of their muscles.
    pub names: Vec<String>,
    /// Numbers of the muscles in the body.
    pub muscles: Vec<usize>,
    /// Measured stretches.
    pub stretches: Vec<f64>,
    /// Variances by the rounding of both lengths.
    pub rounding: Vec<f64>,
}

impl Seen {
    /// All that was measured in both vowels: `m/b` of lengths of half widths `h`, whose variance by rounding is
    /// `(h_m²/b² + h_b² m²/b⁴)/3`.
    pub fn of(matched: &Matched) -> Self {
        let target = &matched.target;
        let each = |m: usize| {
            let (length, over) = (target.measured_mm[m], target.baseline_mm[m]);
            let (half, half_over) = (target.half_width_mm[m], target.baseline_half_width_mm[m]);
            let variance = ((half / over).powi(2) + (half_over * length / (over * over)).powi(2)) / 3.0;
            (length / over, variance)
        };
        let (stretches, rounding) = (0..target.muscles.len()).map(each).unzip();
        let muscles = matched.numbers[..target.muscles.len()].to_vec();
        Self { names: target.muscles.clone(), muscles, stretches, rounding }
    }

    /// Without the muscle at a position.
    pub fn without(&self, position: usize) -> Self {
        let mut seen = self.clone();
        seen.names.remove(position);
        seen.muscles.remove(position);
        seen.stretches.remove(position);
        seen.rounding.remove(position);
        seen
    }
}

/// A number that is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in the vowel.
    Tension(usize),
    /// Tension of a muscle in the baseline.
    Tone(usize),
    /// Displacement of the hyoid along an axis.
    Hyoid(usize),
}

/// What a point of the scores means.
#[derive(Debug, Clone, PartialEq)]
pub struct Meaning {
    /// Tensions in the vowel, N per metre of thickness.
    pub tensions: Vec<f64>,
    /// In the baseline.
    pub tones: Vec<f64>,
    /// Displacement of the hyoid, m.
    pub hyoid: SVector<f64, 2>,
}

/// Where a point was solved: what its neighbours begin at.
#[derive(Debug, Clone)]
pub struct Place {
    /// Positions of all nodes in the vowel, m.
    pub posture: Arc<Vec<SVector<f64, 2>>>,
    /// In the baseline.
    pub baseline: Arc<Vec<SVector<f64, 2>>>,
    /// Lengths of all muscles of the body in the vowel, m.
    pub lengths: Vec<f64>,
    /// In the baseline.
    pub baseline_lengths: Vec<f64>,
}

/// The density of a set of measured stretches.
#[derive(Debug)]
pub struct Density<'a> {
    /// The body.
    pub ground: &'a Ground,
    /// What was measured.
    pub seen: Seen,
    /// What is sampled.
    pub parameters: Vec<Parameter>,
    lanes: Lanes<'a, 2>,
    fixed: Meaning,
    /// Covariance of the stretches of all muscles of the body by geometry and constants; zero at first.
    pub geometry: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
}

/// How exactly is solved: to forces that cancel as for any fit. No load steps: what a direct solve does not reach has no density.
const SOLVE: SolveSettings =
    SolveSettings { tolerance: 1e-9, max_iterations: 60, load_steps: 0, certify: false, most_solves: 1 };

impl<'a> Density<'a> {
    /// With no covariance of geometry yet.
    ///
    /// # Errors
    /// [`PosteriorError::Body`] where the body has no hyoid to displace, [`PosteriorError::Priors`] where nothing is left to sample.
    pub fn new(ground: &'a Ground, seen: Seen) -> Result<Self, PosteriorError> {
        let (priors, count) = (&ground.priors, ground.muscles.len());
        let mut parameters = Vec::new();
        let mut fixed =
            Meaning { tensions: vec![0.0; count], tones: vec![0.0; count], hyoid: SVector::zeros() };
        for (m, name) in ground.muscles.iter().enumerate() {
            match priors.fixed_tension(name) {
                Some(value) => fixed.tensions[m] = value,
                None => parameters.push(Parameter::Tension(m)),
            }
        }
        for (m, name) in ground.muscles.iter().enumerate() {
            match priors.fixed_tone(name) {
                Some(value) => fixed.tones[m] = value,
                None => parameters.push(Parameter::Tone(m)),
            }
        }
        match (priors.hyoid.off, priors.hyoid.fixed_mm) {
            (true, _) => {}
            (false, Some(mm)) => fixed.hyoid = SVector::from(mm) * 1e-3,
            (false, None) => parameters.extend([Parameter::Hyoid(0), Parameter::Hyoid(1)]),
        }
        if parameters.is_empty() {
            let why =
                "these priors fix every tension, every tone and the hyoid: leave at least one of them free";
            return Err(PosteriorError::Priors(why.to_owned()));
        }
        let moves = !priors.hyoid.off;
        if moves && ground.hyoid.is_empty() {
            return Err(PosteriorError::Body(
                "this body names no bone \"hyoid\"; name it, or switch it off in the priors ([hyoid] off = true)"
                    .to_owned(),
            ));
        }
        let factor = Cholesky::new(DMatrix::identity(1, 1)).ok_or(PosteriorError::Covariance)?;
        let lanes = Lanes::new(&ground.system);
        let geometry = DMatrix::zeros(count, count);
        let mut density = Self { ground, seen, parameters, lanes, fixed, geometry, factor };
        density.set_geometry(DMatrix::zeros(count, count))?;
        Ok(density)
    }

    /// The same of other stretches.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`].
    pub fn of(&self, seen: Seen) -> Result<Self, PosteriorError> {
        let lanes = Lanes::new(&self.ground.system);
        let (parameters, fixed) = (self.parameters.clone(), self.fixed.clone());
        let (geometry, factor) = (self.geometry.clone(), self.factor.clone());
        let mut other = Self { ground: self.ground, seen, parameters, lanes, fixed, geometry, factor };
        other.set_geometry(self.geometry.clone())?;
        Ok(other)
    }

    /// Takes a covariance by geometry and constants, of all muscles of the body.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`] where what comes out is not positive definite.
    pub fn set_geometry(&mut self, geometry: DMatrix<f64>) -> Result<(), PosteriorError> {
        self.geometry = geometry;
        self.factor = Cholesky::new(self.covariance()).ok_or(PosteriorError::Covariance)?;
        Ok(())
    }

    /// Covariance of the measured stretches about the computed ones.
    pub fn covariance(&self) -> DMatrix<f64> {
        let own = self.own_variances();
        let mut all = self.geometry.select_rows(&self.seen.muscles).select_columns(&self.seen.muscles);
        own.iter().enumerate().for_each(|(i, v)| all[(i, i)] += v);
        all
    }

    /// Variances of the measured stretches by discrepancy and rounding.
    fn own_variances(&self) -> Vec<f64> {
        self.seen.rounding.iter().map(|r| self.discrepancy() + self.rounding(*r)).collect()
    }

    /// Variance of a stretch by the model's error.
    pub fn discrepancy(&self) -> f64 {
        let prior = &self.ground.priors.discrepancy;
        if prior.off { 0.0 } else { prior.sd * prior.sd }
    }

    /// Variance of a stretch by rounding, given what it would be if it counted.
    pub fn rounding(&self, variance: f64) -> f64 {
        if self.ground.priors.rounding.off { 0.0 } else { variance }
    }

    /// The factor of [`Density::covariance`].
    pub fn factor(&self) -> &Cholesky<f64, Dyn> {
        &self.factor
    }

    /// Whether the hyoid may be elsewhere.
    pub fn moves_hyoid(&self) -> bool {
        !self.ground.hyoid.is_empty() && !self.ground.priors.hyoid.off
    }

    /// What scores mean, and the derivative of each number by its score.
    pub fn meaning(&self, scores: &DVector<f64>) -> (Meaning, Vec<f64>) {
        let priors = &self.ground.priors;
        let mut meaning = self.fixed.clone();
        let each = self.parameters.iter().zip(scores.iter()).map(|(p, &g)| {
            let half_normal = |scale: f64| {
                let (value, slope) = scores::tension(g);
                (scale * value, scale * slope)
            };
            match *p {
                Parameter::Tension(m) => {
                    let (value, slope) = half_normal(priors.tension.scale_n_per_m);
                    meaning.tensions[m] = value;
                    slope
                }
                Parameter::Tone(m) => {
                    let (value, slope) = half_normal(priors.baseline.scale_n_per_m);
                    meaning.tones[m] = value;
                    slope
                }
                Parameter::Hyoid(axis) => {
                    let sd = 1e-3 * priors.hyoid.sd_mm;
                    meaning.hyoid[axis] = sd * g;
                    sd
                }
            }
        });
        let slopes = each.collect();
        (meaning, slopes)
    }

    /// The place from which the first point begins: rest.
    pub fn rest(&self) -> Place {
        let rest = Arc::new(self.ground.system.rest().to_vec());
        let lengths = self.ground.system.lengths(self.ground.system.rest());
        Place { posture: Arc::clone(&rest), baseline: rest, baseline_lengths: lengths.clone(), lengths }
    }

    /// The load of a vowel, begun from given positions.
    pub fn posture<'l>(&'l self, meaning: &Meaning, start: Option<&'l [SVector<f64, 2>]>) -> Load<'l, 2> {
        let mut load = Load { start, ..Load::new(meaning.tensions.clone()) };
        if self.moves_hyoid() {
            load = load.with_bone(&self.ground.hyoid, meaning.hyoid);
        }
        load
    }

    /// The load of the baseline.
    pub fn baseline<'l>(&'l self, meaning: &Meaning, start: Option<&'l [SVector<f64, 2>]>) -> Load<'l, 2> {
        Load { start, ..Load::new(meaning.tones.clone()) }
    }

    /// The lanes in which it is solved.
    pub fn lanes(&self) -> &Lanes<'a, 2> {
        &self.lanes
    }

    /// How each equilibrium is solved.
    pub fn settings(&self) -> &'static SolveSettings {
        &SOLVE
    }

    /// Residuals of the measured stretches at given lengths of all muscles of the body.
    pub fn residuals(&self, lengths: &[f64], baseline: &[f64]) -> DVector<f64> {
        let seen = &self.seen;
        DVector::from_fn(seen.muscles.len(), |i, _| {
            let m = seen.muscles[i];
            seen.stretches[i] - lengths[m] / baseline[m]
        })
    }
}

/// Whether an equilibrium is one that the density knows.
pub fn is_found(shape: &Equilibrium<2>) -> bool {
    shape.solution.status == SolveStatus::Converged && shape.solution.guarded == 0
}
