//! The density of tensions, tones and displacements of the hyoid, given stretches of a speaker's postures and auxiliary data.
//!
//! [`super`] states the model. Parameters are sampled as scores, which have no bounds. The derivatives (`evaluator`) need one
//! back-substitution for each posture and one for the baseline, for any number of parameters.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector};

use tongue_core::statics::lanes::{LaneEquilibrium, Lanes};
use tongue_core::statics::{SolveSettings, SolveStatus};

use super::PosteriorError;
use super::measurements::Measurements;
use super::model::PosteriorModel;
use super::parameters::{self, Parameter, ParameterValues, Posture, SolvedPoint};

#[derive(Debug, Clone)]
pub struct PosteriorProblem<'a> {
    pub posterior_model: &'a PosteriorModel,
    pub measurements: Measurements,
    pub parameters: Vec<Parameter>,
    fixed: ParameterValues,
    /// Covariance due to geometry and constants of the stretches of all muscles in all postures and of the auxiliary data; zero at first.
    pub geometry: DMatrix<f64>,
    /// Factor of [`PosteriorProblem::covariance`].
    pub factor: Cholesky<f64, Dyn>,
    /// Inverse of the covariance.
    pub precision: DMatrix<f64>,
    /// [`Measurements::rows`] of the measurements.
    pub rows: Vec<usize>,
}

/// Without load steps: the density is zero where a direct solve fails.
const SOLVE: SolveSettings = SolveSettings {
    tolerance: 1e-9,
    max_iterations: 60,
    load_steps: 0,
    certify: false,
    most_solves: 1,
    beyond: false,
};

/// The sampled parameters, and the values of the others. In /ɯ/ the hyoid is in its place in the body.
fn parameters(
    posterior_model: &PosteriorModel,
    measurements: &Measurements,
) -> (ParameterValues, Vec<Parameter>) {
    let (priors, muscles) = (&posterior_model.priors, &posterior_model.muscles);
    let postures = measurements.labels.len();
    let mut parameters = Vec::new();
    let mut known = |fixed: Option<f64>, parameter: Parameter| {
        fixed.unwrap_or_else(|| {
            parameters.push(parameter);
            0.0
        })
    };
    let place = if priors.hyoid.off { Some([0.0; 2]) } else { priors.hyoid.fixed_mm };
    let shapes = Vec::from_iter((0..=postures).map(|index| {
        let is_baseline = index == postures;
        // A baseline that is at rest, or with a known displacement of the vowel's hyoid, has its hyoid in place.
        let stays = is_baseline && (priors.baseline.off || place.is_some());
        let place = if stays || measurements.neutral == Some(index) { Some([0.0; 2]) } else { place };
        let tensions = muscles.iter().enumerate().map(|(m, name)| {
            let fixed = if is_baseline { priors.fixed_tone(name) } else { priors.fixed_tension(name) };
            known(fixed, Parameter::Tension(index, m))
        });
        let tensions = tensions.collect();
        let hyoid = [0, 1].map(|axis| known(place.map(|mm| mm[axis] * 1e-3), Parameter::Hyoid(index, axis)));
        Posture { tensions, hyoid: SVector::from(hyoid) }
    }));
    let tilts = !priors.hyoid.off && !priors.hyoid_tilt.off && posterior_model.hyoid.len() > 1;
    let tilt = known(if tilts { priors.hyoid_tilt.fixed_rad_per_m } else { Some(0.0) }, Parameter::Tilt);
    (ParameterValues { postures: shapes, tilt }, parameters)
}

impl<'a> PosteriorProblem<'a> {
    /// A density without a covariance due to geometry; an error where there is no hyoid to displace, or nothing is left to sample.
    pub fn new(
        posterior_model: &'a PosteriorModel,
        measurements: Measurements,
    ) -> Result<Self, PosteriorError> {
        let (fixed, parameters) = parameters(posterior_model, &measurements);
        if parameters.iter().all(|p| *p == Parameter::Tilt) {
            let why =
                "these priors fix every tension, every tone and the hyoid: leave at least one of them free";
            return Err(PosteriorError::Refused(why.to_owned()));
        }
        if !posterior_model.priors.hyoid.off && posterior_model.hyoid.is_empty() {
            return Err(PosteriorError::Refused(
                "this body names no bone \"hyoid\"; name it, or switch it off in the priors ([hyoid] off = true)"
                    .to_owned(),
            ));
        }
        let rows = measurements.rows(posterior_model.muscles.len());
        let factor = Cholesky::new(DMatrix::identity(1, 1)).ok_or(PosteriorError::Covariance)?;
        let (geometry, precision) = (DMatrix::zeros(0, 0), DMatrix::zeros(0, 0));
        let mut problem =
            Self { posterior_model, measurements, parameters, fixed, geometry, factor, precision, rows };
        problem.set_geometry(DMatrix::zeros(problem.numbers(), problem.numbers()))?;
        Ok(problem)
    }

    /// The density with other measurements of the same postures.
    pub fn with_measurements(&self, measurements: Measurements) -> Result<Self, PosteriorError> {
        let rows = measurements.rows(self.posterior_model.muscles.len());
        let mut problem = Self { rows, measurements, ..self.clone() };
        problem.set_geometry(self.geometry.clone())?;
        Ok(problem)
    }

    pub(crate) fn set_geometry(&mut self, geometry: DMatrix<f64>) -> Result<(), PosteriorError> {
        self.geometry = geometry;
        self.factor = Cholesky::new(self.covariance()).ok_or(PosteriorError::Covariance)?;
        self.precision = self.factor.inverse();
        Ok(())
    }

    pub fn postures(&self) -> usize {
        self.measurements.labels.len()
    }

    /// Number of computed numbers: the stretches of all muscles in all postures, and the auxiliary data.
    pub(super) fn numbers(&self) -> usize {
        self.postures() * self.posterior_model.muscles.len() + self.measurements.auxiliary.len()
    }

    /// Rows and columns of the measured numbers, from a matrix of all muscles in all postures and the auxiliary data.
    pub fn select_measured(&self, all: &DMatrix<f64>) -> DMatrix<f64> {
        all.select_rows(&self.rows).select_columns(&self.rows)
    }

    /// Covariance of measured less computed numbers.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.select_measured(&self.geometry)
            + self.discrepancies()
            + self.rounding()
            + self.placed(self.measurements.stretches.len(), &self.measurements.auxiliary.errors)
    }

    /// Covariance due to the model's error of stretches, and to that of a baseline in which muscles pull, which all postures share.
    pub fn discrepancies(&self) -> DMatrix<f64> {
        let prior = &self.posterior_model.priors.discrepancy;
        let variance = if prior.off { 0.0 } else { prior.sd * prior.sd };
        // Of a posture and of the baseline; where muscles pull in both, they have equal parts, so that they can be exchanged.
        let (own, shared) = if self.has_active_baseline() && !prior.off {
            let half = 0.5 * (variance + prior.sd_of_baseline * prior.sd_of_baseline);
            (half, half)
        } else {
            (variance, 0.0)
        };
        let stretches = &self.measurements.stretches;
        let covariance = |i: usize, j: usize| {
            let of_baseline = if stretches[i].muscle == stretches[j].muscle { shared } else { 0.0 };
            of_baseline + if i == j { own } else { 0.0 }
        };
        self.placed(0, &DMatrix::from_fn(stretches.len(), stretches.len(), covariance))
    }

    /// Covariance due to rounding of the lengths; zero if the priors leave rounding out.
    pub fn rounding(&self) -> DMatrix<f64> {
        let part = if self.posterior_model.priors.rounding.off { 0.0 } else { 1.0 };
        self.placed(0, &(&self.measurements.rounding * part))
    }

    /// Whether no posture and not the baseline is /ɯ/ or at rest, so that the model errs in the baseline as in any vowel.
    pub fn has_active_baseline(&self) -> bool {
        self.measurements.neutral.is_none() && !self.posterior_model.priors.baseline.off
    }

    /// Whether the displacement of the hyoid in the baseline is sampled.
    pub fn moves_hyoid_in_baseline(&self) -> bool {
        self.parameters.contains(&Parameter::Hyoid(self.postures(), 0))
    }

    /// A matrix over all measured numbers with the covariance `part` of those from number `from` on.
    fn placed(&self, from: usize, part: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.rows.len();
        let mut all = DMatrix::zeros(n, n);
        all.view_mut((from, from), part.shape()).copy_from(part);
        all
    }

    /// Scale of the prior of tensions in a posture or, for the number after the last posture, in the baseline, N per metre of thickness.
    pub(super) fn scale(&self, posture: usize) -> f64 {
        let priors = &self.posterior_model.priors;
        if posture < self.postures() { priors.tension.scale_n_per_m } else { priors.baseline.scale_n_per_m }
    }

    /// Values of the parameters at these scores, and the derivative of each sampled parameter by its score.
    pub fn parameter_values(&self, scores: &DVector<f64>) -> (ParameterValues, Vec<f64>) {
        let priors = &self.posterior_model.priors;
        let mut values = self.fixed.clone();
        let each = self.parameters.iter().zip(scores.iter()).map(|(p, &g)| {
            let (scale, (value, slope)) = match p {
                Parameter::Tension(posture, _) => (self.scale(*posture), parameters::tension(g)),
                Parameter::Hyoid(..) => (1e-3 * priors.hyoid.sd_mm, (g, 1.0)),
                Parameter::Tilt => (priors.hyoid_tilt.sd_rad_per_m, (g, 1.0)),
            };
            *values.get_mut(*p) = scale * value;
            scale * slope
        });
        let slopes = each.collect();
        (values, slopes)
    }

    /// The body at rest, from which the first point is solved.
    pub fn rest(&self) -> SolvedPoint {
        let system = &self.posterior_model.system;
        let rest = Arc::new(system.rest().to_vec());
        let shapes = vec![Arc::clone(&rest); self.postures() + 1];
        let lengths = system.lengths(system.rest()).repeat(shapes.len());
        SolvedPoint { shapes, lengths, auxiliary: Vec::new() }
    }

    pub fn lanes(&self) -> Lanes<'a, 2> {
        Lanes::new(&self.posterior_model.system)
    }

    pub fn settings(&self) -> &'static SolveSettings {
        &SOLVE
    }

    /// Residuals of the stretches and then of the auxiliary data, from the lengths of all muscles in all postures and, last, in the
    /// baseline (m), and from the computed auxiliary data.
    pub fn residuals(&self, lengths: &[f64], auxiliary: &[f64]) -> DVector<f64> {
        let measurements = &self.measurements;
        let baseline = &lengths[lengths.len() - self.posterior_model.muscles.len()..];
        let stretches = measurements.stretches.iter().enumerate();
        let stretches = stretches.map(|(i, s)| s.value - lengths[self.rows[i]] / baseline[s.muscle]);
        let others = measurements.auxiliary.measured.iter().zip(auxiliary);
        let all = stretches.chain(others.map(|(measured, value)| measured - value));
        DVector::from_iterator(self.rows.len(), all)
    }
}

impl SolvedPoint {
    /// `unit` times the derivative `d(L/L0) = dL/L0 - s dL0/L0` of the stretch in a row of the list of all muscles in all postures; `rate`
    /// gives the derivatives of lengths by shape and muscle.
    pub(super) fn stretch_rate(&self, row: usize, unit: f64, rate: impl Fn(usize, usize) -> f64) -> f64 {
        let (count, baseline) = (self.lengths.len() / self.shapes.len(), self.shapes.len() - 1);
        let (posture, m) = (row / count, row % count);
        let over = self.lengths[baseline * count + m];
        unit * (rate(posture, m) - self.lengths[row] / over * rate(baseline, m)) / over
    }

    /// Positions and lengths of a posture, numbered as in [`PosteriorModel::load`].
    pub fn shape(&self, posture: usize) -> (&[SVector<f64, 2>], &[f64]) {
        let count = self.lengths.len() / self.shapes.len();
        (&self.shapes[posture], &self.lengths[posture * count..][..count])
    }
}

/// Whether the solver converged without its barrier.
pub fn is_found(shape: &LaneEquilibrium<2>) -> bool {
    shape.solution.status == SolveStatus::Converged && shape.solution.guarded == 0
}
