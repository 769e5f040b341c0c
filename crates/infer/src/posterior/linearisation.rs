//! The linearisation of all computed numbers at a solved point, from the adjoints of the numbers of each shape.

use nalgebra::{DMatrix, DVector};

use tongue_core::statics::lanes::Adjoint;

use super::auxiliary::{Active, NumberOrigin};
use super::parameters::{Parameter, ParameterValues, SolvedPoint};
use super::problem::PosteriorProblem;

/// Linearisation of all computed numbers at a point.
#[derive(Debug, Clone)]
pub struct LinearisationPoint {
    /// Derivatives by the scores of the stretches of all muscles of the body, posture by posture, then of the auxiliary data.
    pub jacobian: DMatrix<f64>,
    pub geometry: GeometrySensitivities,
    pub solved: SolvedPoint,
}

/// Changes of all computed numbers for one standard deviation of each source of error; one row for each number.
#[derive(Debug, Clone)]
pub struct GeometrySensitivities {
    pub ends: DMatrix<f64>,
    pub outline: DMatrix<f64>,
    pub kappa: DMatrix<f64>,
    pub width: DMatrix<f64>,
    pub patch: DMatrix<f64>,
}

pub(super) struct DifferentiatedPoint<'a> {
    pub problem: &'a PosteriorProblem<'a>,
    pub solved: SolvedPoint,
    pub values: ParameterValues,
    /// Derivatives of the parameters by their scores.
    pub slopes: Vec<f64>,
    /// For each shape the adjoints of all lengths, then of the auxiliary numbers that follow from it.
    pub adjoints: Vec<Vec<Adjoint<2>>>,
}

impl DifferentiatedPoint<'_> {
    /// Derivatives of all computed numbers by the scores.
    pub fn jacobian(&self) -> DMatrix<f64> {
        let rates = |adjoint: &Adjoint<2>| self.problem.posterior_model.hyoid_rates(adjoint);
        let by_hyoid: Vec<Vec<[f64; 3]>> =
            self.adjoints.iter().map(|own| own.iter().map(rates).collect()).collect();
        let columns = self.problem.parameters.iter().zip(&self.slopes).map(|(&parameter, &slope)| {
            let shapes = self.adjoints.iter().zip(&by_hyoid).enumerate();
            let of_shapes: Vec<Vec<f64>> = Vec::from_iter(shapes.map(|(index, (own, by_hyoid))| {
                let each = own.iter().zip(by_hyoid);
                each.map(|(a, hyoid)| by_parameter(&self.values, index, &a.by_tension, *hyoid, parameter))
                    .collect()
            }));
            self.changes(slope, &of_shapes, |active| active.slope(&self.values, parameter))
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
        let (postures, muscles) = (self.problem.postures(), self.problem.posterior_model.muscles.len());
        let stretches = (0..postures * muscles)
            .map(|row| self.solved.stretch_rate(row, unit, |index, m| of_shapes[index][m]));
        let origins = self.problem.measurements.auxiliary.origins(postures, muscles);
        let others = origins.map(|origin| match origin {
            NumberOrigin::Activity(active) => unit * of_activity(active),
            NumberOrigin::Shape(index, number) => unit * of_shapes[index][number],
        });
        DVector::from_vec(stretches.chain(others).collect())
    }

    /// A matrix with a row for each computed number, of any number of columns.
    pub fn matrix(&self, columns: &[DVector<f64>]) -> DMatrix<f64> {
        DMatrix::from_fn(self.problem.numbers(), columns.len(), |row, c| columns[c][row])
    }
}

/// Derivative of a function of one shape by a parameter, from those by its tensions and by the hyoid's displacement and angle
/// ([`super::PosteriorModel::hyoid_rates`]); shapes are numbered as in [`super::PosteriorModel::load`].
pub(super) fn by_parameter(
    values: &ParameterValues,
    index: usize,
    by_tension: &[f64],
    [by_x, by_y, by_angle]: [f64; 3],
    parameter: Parameter,
) -> f64 {
    match parameter {
        Parameter::Tension(posture, m) if posture == index => by_tension[m],
        Parameter::Hyoid(posture, 0) if posture == index => by_x + values.tilt * by_angle,
        Parameter::Hyoid(posture, _) if posture == index => by_y,
        Parameter::Tilt => values.postures[index].hyoid.x * by_angle,
        _ => 0.0,
    }
}
