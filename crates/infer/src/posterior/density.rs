//! The density: how probable tensions, tones and places of the hyoid are, given the measured stretches of a speaker's postures and what else
//! was seen of them (`beside`).
//!
//! ```text
//! y ~ N(s, C),  s = L(F, d, c) / L(F0),  C = C_geo + sd² I + R
//! F = scale Z((1 + Phi(g))/2) with g ~ N(0, 1) (half-normal), F0 likewise, d = sd g, c = sd g
//! ```
//! Every posture has tensions F and a place d of the hyoid of its own; tones F0 and the hyoid's tilt c are the speaker's. All that is
//! sampled is in the scores `g`, so that there are no bounds. The derivatives (`evaluator`) need one back-substitution for each
//! posture and one for the baseline, however many unknowns there are.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector};

use crate::track::scores;
use tongue_core::statics::lanes::{Equilibrium, Lanes};
use tongue_core::statics::{SolveSettings, SolveStatus};

use super::PosteriorError;
use super::ground::Ground;
use super::seen::Seen;

/// A number that is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in a posture: the posture, then the muscle.
    Tension(usize, usize),
    /// Tension of a muscle in the baseline.
    Tone(usize),
    /// Displacement of the hyoid in a posture along an axis.
    Hyoid(usize, usize),
    /// By how much the hyoid tilts as it moves back.
    Tilt,
}

/// A posture as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Posture {
    /// Tensions of all muscles of the body, N per metre of thickness.
    pub tensions: Vec<f64>,
    /// Displacement of the hyoid, m.
    pub hyoid: SVector<f64, 2>,
}

/// What a point of the scores means.
#[derive(Debug, Clone, PartialEq)]
pub struct Meaning {
    /// The postures.
    pub postures: Vec<Posture>,
    /// Tensions in the baseline, N per metre of thickness.
    pub tones: Vec<f64>,
    /// Angle by which the hyoid tilts, its greater horn downwards, for every metre that it moves back, rad/m.
    pub tilt: f64,
}

impl Meaning {
    /// The meaning with tensions and displacements multiplied by `part`.
    pub fn scaled(&self, part: f64) -> Self {
        let times = |all: &[f64]| all.iter().map(|t| t * part).collect();
        let posture = |p: &Posture| Posture { tensions: times(&p.tensions), hyoid: p.hyoid * part };
        let postures = self.postures.iter().map(posture).collect();
        Self { postures, tones: times(&self.tones), ..*self }
    }
}

/// Positions at a solved point, from which nearby points start.
#[derive(Debug, Clone)]
pub struct Place {
    /// Positions of all nodes in each posture, m.
    pub postures: Vec<Arc<Vec<SVector<f64, 2>>>>,
    /// In the baseline.
    pub baseline: Arc<Vec<SVector<f64, 2>>>,
    /// Lengths of all muscles of the body in each posture, one after the other, m.
    pub lengths: Vec<f64>,
    /// In the baseline.
    pub baseline_lengths: Vec<f64>,
    /// What was seen beside the stretches, as the model has it.
    pub beside: Vec<f64>,
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
    /// Covariance by geometry and constants of the stretches of all muscles of the body in all postures, and of what was seen beside them;
    /// zero at first.
    pub geometry: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// [`Seen::rows`] of what was measured.
    rows: Vec<usize>,
}

/// How exactly is solved: to forces that cancel as for any fit. No load steps: what a direct solve does not reach has no density.
const SOLVE: SolveSettings =
    SolveSettings { tolerance: 1e-9, max_iterations: 60, load_steps: 0, certify: false, most_solves: 1 };

/// Values that the priors fix, and the parameters to sample.
fn parameters(ground: &Ground, postures: usize) -> (Meaning, Vec<Parameter>) {
    let (priors, count) = (&ground.priors, ground.muscles.len());
    let mut parameters = Vec::new();
    let mut own = Posture { tensions: vec![0.0; count], hyoid: SVector::zeros() };
    let mut tones = vec![0.0; count];
    let fixed_place = priors.hyoid.fixed_mm.filter(|_| !priors.hyoid.off);
    own.hyoid = fixed_place.map_or(SVector::zeros(), |mm| SVector::from(mm) * 1e-3);
    let moves = !priors.hyoid.off && fixed_place.is_none();
    for posture in 0..postures {
        for (m, name) in ground.muscles.iter().enumerate() {
            match priors.fixed_tension(name) {
                Some(value) => own.tensions[m] = value,
                None => parameters.push(Parameter::Tension(posture, m)),
            }
        }
        if moves {
            parameters.extend([Parameter::Hyoid(posture, 0), Parameter::Hyoid(posture, 1)]);
        }
    }
    for (m, name) in ground.muscles.iter().enumerate() {
        match priors.fixed_tone(name) {
            Some(value) => tones[m] = value,
            None => parameters.push(Parameter::Tone(m)),
        }
    }
    let tilt = &priors.hyoid_tilt;
    let tilts = !priors.hyoid.off && !tilt.off && ground.hyoid.len() > 1;
    match tilt.fixed_rad_per_m {
        None if tilts => parameters.push(Parameter::Tilt),
        _ => {}
    }
    let tilt = tilt.fixed_rad_per_m.filter(|_| tilts).unwrap_or(0.0);
    (Meaning { postures: vec![own; postures], tones, tilt }, parameters)
}

impl<'a> Density<'a> {
    /// With no covariance of geometry yet.
    ///
    /// # Errors
    /// [`PosteriorError::Body`] where the body has no hyoid to displace, [`PosteriorError::Priors`] where nothing is left to sample.
    pub fn new(ground: &'a Ground, seen: Seen) -> Result<Self, PosteriorError> {
        let (fixed, parameters) = parameters(ground, seen.labels.len());
        let is_of_muscles =
            |p: &Parameter| matches!(p, Parameter::Tension(..) | Parameter::Tone(_) | Parameter::Hyoid(..));
        if !parameters.iter().any(is_of_muscles) {
            let why =
                "these priors fix every tension, every tone and the hyoid: leave at least one of them free";
            return Err(PosteriorError::Priors(why.to_owned()));
        }
        if !ground.priors.hyoid.off && ground.hyoid.is_empty() {
            return Err(PosteriorError::Body(
                "this body names no bone \"hyoid\"; name it, or switch it off in the priors ([hyoid] off = true)"
                    .to_owned(),
            ));
        }
        let size = seen.labels.len() * ground.muscles.len() + seen.beside_len();
        Self::made(ground, seen, (fixed, parameters), DMatrix::zeros(size, size))
    }

    fn made(
        ground: &'a Ground,
        seen: Seen,
        (fixed, parameters): (Meaning, Vec<Parameter>),
        geometry: DMatrix<f64>,
    ) -> Result<Self, PosteriorError> {
        let factor = Cholesky::new(DMatrix::identity(1, 1)).ok_or(PosteriorError::Covariance)?;
        let lanes = Lanes::new(&ground.system);
        let rows = seen.rows(ground.muscles.len());
        let mut density =
            Self { ground, seen, parameters, lanes, fixed, geometry: DMatrix::zeros(0, 0), factor, rows };
        density.set_geometry(geometry)?;
        Ok(density)
    }

    /// The density of other measured stretches of the same postures.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`].
    pub fn of(&self, seen: Seen) -> Result<Self, PosteriorError> {
        let sampled = (self.fixed.clone(), self.parameters.clone());
        Self::made(self.ground, seen, sampled, self.geometry.clone())
    }

    /// Takes a covariance by geometry and constants, of all muscles of the body in all postures.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`] where what comes out is not positive definite.
    pub fn set_geometry(&mut self, geometry: DMatrix<f64>) -> Result<(), PosteriorError> {
        self.geometry = geometry;
        self.factor = Cholesky::new(self.covariance()).ok_or(PosteriorError::Covariance)?;
        Ok(())
    }

    /// How many postures there are.
    pub fn postures(&self) -> usize {
        self.seen.labels.len()
    }

    /// [`Seen::rows`] of what was measured.
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// Rows and columns of what was measured, of a matrix of all muscles in all postures and of what was seen beside them.
    pub fn measured(&self, all: &DMatrix<f64>) -> DMatrix<f64> {
        all.select_rows(&self.rows).select_columns(&self.rows)
    }

    /// Covariance of what was measured about what is computed.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.measured(&self.geometry) + self.discrepancies() + self.rounding() + self.errors_beside()
    }

    /// Variance of a stretch by the model's error.
    pub fn discrepancy(&self) -> f64 {
        let prior = &self.ground.priors.discrepancy;
        if prior.off { 0.0 } else { prior.sd * prior.sd }
    }

    /// Covariance of what was measured by the model's error of stretches.
    pub fn discrepancies(&self) -> DMatrix<f64> {
        let n = self.seen.len();
        self.placed(0, &(DMatrix::identity(n, n) * self.discrepancy()))
    }

    /// Covariance of what was measured by rounding of the lengths; zero where it does not count.
    pub fn rounding(&self) -> DMatrix<f64> {
        self.placed(0, &(&self.seen.rounding * if self.ground.priors.rounding.off { 0.0 } else { 1.0 }))
    }

    /// Covariance of what was measured by the errors of what was seen beside the stretches.
    pub fn errors_beside(&self) -> DMatrix<f64> {
        self.placed(self.seen.len(), &self.seen.beside_errors())
    }

    /// A covariance of some of what was measured, from a number on, among that of all of it.
    fn placed(&self, from: usize, part: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.rows.len();
        let mut all = DMatrix::zeros(n, n);
        all.view_mut((from, from), part.shape()).copy_from(part);
        all
    }

    /// The factor of [`Density::covariance`].
    pub fn factor(&self) -> &Cholesky<f64, Dyn> {
        &self.factor
    }

    /// What scores mean, and the derivative of each number by its score.
    pub fn meaning(&self, scores: &DVector<f64>) -> (Meaning, Vec<f64>) {
        let priors = &self.ground.priors;
        let mut meaning = self.fixed.clone();
        let half_normal = |scale: f64, g: f64| {
            let (value, slope) = scores::tension(g);
            (scale * value, scale * slope)
        };
        let each = self.parameters.iter().zip(scores.iter()).map(|(p, &g)| match *p {
            Parameter::Tension(posture, m) => {
                let (value, slope) = half_normal(priors.tension.scale_n_per_m, g);
                meaning.postures[posture].tensions[m] = value;
                slope
            }
            Parameter::Tone(m) => {
                let (value, slope) = half_normal(priors.baseline.scale_n_per_m, g);
                meaning.tones[m] = value;
                slope
            }
            Parameter::Hyoid(posture, axis) => {
                let sd = 1e-3 * priors.hyoid.sd_mm;
                meaning.postures[posture].hyoid[axis] = sd * g;
                sd
            }
            Parameter::Tilt => {
                meaning.tilt = priors.hyoid_tilt.sd_rad_per_m * g;
                priors.hyoid_tilt.sd_rad_per_m
            }
        });
        let slopes = each.collect();
        (meaning, slopes)
    }

    /// The place from which the first point begins: rest.
    pub fn rest(&self) -> Place {
        let rest = Arc::new(self.ground.system.rest().to_vec());
        let lengths = self.ground.system.lengths(self.ground.system.rest());
        let postures = vec![Arc::clone(&rest); self.postures()];
        Place {
            lengths: lengths.repeat(postures.len()),
            postures,
            baseline: rest,
            baseline_lengths: lengths,
            beside: Vec::new(),
        }
    }

    /// The lanes in which it is solved.
    pub fn lanes(&self) -> &Lanes<'a, 2> {
        &self.lanes
    }

    /// How each equilibrium is solved.
    pub fn settings(&self) -> &'static SolveSettings {
        &SOLVE
    }

    /// Residuals of what was measured: the stretches at given lengths of all muscles of the body in all postures, then what was seen beside
    /// them.
    pub fn residuals(&self, lengths: &[f64], baseline: &[f64], beside: &[f64]) -> DVector<f64> {
        let seen = &self.seen;
        let stretches = seen.stretches.iter().enumerate();
        let stretches = stretches.map(|(i, s)| s - lengths[self.rows[i]] / baseline[seen.muscles[i]]);
        let measured = seen.beside.iter().flat_map(|b| &b.measured);
        let all = stretches.chain(measured.zip(beside).map(|(measured, value)| measured - value));
        DVector::from_iterator(self.rows.len(), all)
    }
}

impl Place {
    /// Positions and lengths of posture `shape`, numbered as in [`Ground::load`].
    pub fn shape(&self, shape: usize) -> (&[SVector<f64, 2>], &[f64]) {
        let count = self.baseline_lengths.len();
        match self.postures.get(shape) {
            Some(positions) => (positions, &self.lengths[shape * count..(shape + 1) * count]),
            None => (&self.baseline, &self.baseline_lengths),
        }
    }
}

/// Whether the solver converged without its barrier.
pub fn is_found(shape: &Equilibrium<2>) -> bool {
    shape.solution.status == SolveStatus::Converged && shape.solution.guarded == 0
}
