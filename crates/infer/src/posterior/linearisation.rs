//! The linearisation of all computed numbers at a solved point, from the adjoints of the numbers of each shape.

use nalgebra::{DMatrix, DVector};

use tongue_core::statics::lanes::Adjoint;

use super::auxiliary::{Active, DataSource};
use super::density::Density;
use super::parameters::{Parameter, ParameterValues, SolvedPoint};

/// Linearisation of all computed numbers at a point.
#[derive(Debug, Clone)]
pub struct LinearisationPoint {
    /// Derivatives by the scores of the stretches of all muscles of the body, posture by posture, then of the auxiliary data.
    pub jacobian: DMatrix<f64>,
    pub geometry: FiniteDifferences,
}

/// Changes of all computed numbers for one standard deviation of each source of error; one row for each number.
#[derive(Debug, Clone)]
pub struct FiniteDifferences {
    pub ends: DMatrix<f64>,
    pub outline: DMatrix<f64>,
    pub kappa: DMatrix<f64>,
    pub width: DMatrix<f64>,
    pub patch: DMatrix<f64>,
}

impl FiniteDifferences {
    pub(super) fn none(numbers: usize) -> Self {
        let none = || DMatrix::zeros(numbers, 0);
        Self { ends: none(), outline: none(), kappa: none(), width: none(), patch: none() }
    }
}

pub(super) struct DifferentiatedPoint<'a> {
    pub density: &'a Density<'a>,
    pub solved: &'a SolvedPoint,
    pub values: &'a ParameterValues,
    /// For each shape the adjoints of all lengths, then of the auxiliary numbers that follow from it.
    pub adjoints: Vec<Vec<Adjoint<2>>>,
}

impl DifferentiatedPoint<'_> {
    /// Derivatives of all computed numbers by the scores; `slopes` are the derivatives of the parameters by the scores.
    pub fn jacobian(&self, slopes: &[f64]) -> DMatrix<f64> {
        let columns = self.density.parameters.iter().zip(slopes).map(|(&parameter, &slope)| {
            let of_shapes: Vec<Vec<f64>> =
                Vec::from_iter(self.adjoints.iter().enumerate().map(|(index, own)| {
                    own.iter()
                        .map(|adjoint| by_parameter(self.density, self.values, index, adjoint, parameter))
                        .collect()
                }));
            self.changes(slope, &of_shapes, |active| active.slope(self.values, parameter))
        });
        self.matrix(&columns.collect::<Vec<_>>())
    }

    /// Changes of all computed numbers, times `unit`. `of_shapes` has the changes of the numbers of each shape in the order of its
    /// adjoints, `of_activity` gives that of a number that follows from tensions.
    pub fn changes(
        &self,
        unit: f64,
        of_shapes: &[Vec<f64>],
        of_activity: impl Fn(&Active) -> f64,
    ) -> DVector<f64> {
        let (postures, muscles) = (self.density.postures(), self.density.posterior_model.muscles.len());
        let stretches = (0..postures * muscles)
            .map(|row| self.solved.stretch_rate(row, unit, |index, m| of_shapes[index][m]));
        // The auxiliary numbers of a shape follow its lengths.
        let mut next = vec![muscles; postures + 1];
        let others = self.density.measurements.auxiliary.numbers().map(|(source, _)| match source {
            DataSource::Shape(view) => {
                let index = view.posture.unwrap_or(postures);
                next[index] += 1;
                unit * of_shapes[index][next[index] - 1]
            }
            DataSource::Activity(active) => unit * of_activity(active),
        });
        DVector::from_vec(stretches.chain(others).collect())
    }

    /// A matrix with a row for each computed number, of any number of columns.
    pub fn matrix(&self, columns: &[DVector<f64>]) -> DMatrix<f64> {
        DMatrix::from_fn(self.density.numbers(), columns.len(), |row, c| columns[c][row])
    }
}

/// Derivative of a function of one shape by a parameter; shapes are numbered as in [`super::PosteriorModel::load`].
pub(super) fn by_parameter(
    density: &Density<'_>,
    values: &ParameterValues,
    index: usize,
    adjoint: &Adjoint<2>,
    parameter: Parameter,
) -> f64 {
    let by_hyoid = |which: usize| match values.postures.get(index) {
        Some(own) => density.posterior_model.hyoid_rates(adjoint, own.hyoid, values.tilt)[which],
        None => 0.0,
    };
    match parameter {
        Parameter::Tension(posture, m) if posture == index => adjoint.by_tension[m],
        Parameter::Tone(m) if index == density.postures() => adjoint.by_tension[m],
        Parameter::Hyoid(posture, axis) if posture == index => by_hyoid(axis),
        Parameter::Tilt => by_hyoid(2),
        _ => 0.0,
    }
}
