//! A quadratic model of the numbers that follow from one shape.
//!
//! The logarithms of all muscle lengths, and other numbers of the shape, are quadratic functions of the logarithms `ln(1 + F/(2 s))` of the
//! tensions there (`s`: scale of their prior), the displacement of the hyoid and its angle. The coefficients are fitted by least squares to
//! the numbers and to their exact derivatives at solved points.

use nalgebra::{DMatrix, DVector};

use super::linearisation::DifferentiatedPoint;
use super::parameters::{ParameterValues, Posture};
use super::problem::PosteriorProblem;

/// Weight of small coefficients, over that of an equation; it decides what few points leave open.
const RIDGE: f64 = 1e-4;

#[derive(Debug)]
pub(super) struct QuadraticShape {
    /// Inputs that vary: their number in [`inputs`], mean and standard deviation.
    inputs: Vec<(usize, f64, f64)>,
    /// A row for each monomial: 1, all inputs, all products of two. A column for each number: logarithms of all lengths, then the others.
    coefficients: DMatrix<f64>,
}

/// Logarithms of the tensions in a shape, the hyoid's displacement along both axes, m, and its angle; each with its derivative by the
/// tension, the displacement or the angle.
pub(super) fn inputs(
    problem: &PosteriorProblem<'_>,
    values: &ParameterValues,
    index: usize,
) -> Vec<(f64, f64)> {
    let (Posture { tensions, hyoid }, scale) = (&values.postures[index], problem.scale(index));
    let logarithms = tensions.iter().map(|f| ((0.5 * f / scale).ln_1p(), 1.0 / (f + 2.0 * scale)));
    logarithms.chain([hyoid.x, hyoid.y, values.tilt * hyoid.x].map(|value| (value, 1.0))).collect()
}

/// All monomials up to the second degree.
fn monomials(inputs: &[f64]) -> impl Iterator<Item = f64> {
    let products = inputs.iter().enumerate().flat_map(|(i, a)| inputs[..=i].iter().map(move |b| a * b));
    std::iter::once(1.0).chain(inputs.iter().copied()).chain(products)
}

/// Derivatives of all monomials by one of the inputs.
fn derivatives(inputs: &[f64], by: usize) -> impl Iterator<Item = f64> {
    let of = move |i: usize| f64::from(u8::from(i == by));
    let products = inputs
        .iter()
        .enumerate()
        .flat_map(move |(i, a)| inputs[..=i].iter().enumerate().map(move |(j, b)| of(i) * b + of(j) * a));
    std::iter::once(0.0).chain((0..inputs.len()).map(of)).chain(products)
}

impl QuadraticShape {
    /// The model of a shape, numbered as in [`super::PosteriorModel::load`]; `None` without points.
    pub fn fit(
        problem: &PosteriorProblem<'_>,
        points: &[DifferentiatedPoint<'_>],
        index: usize,
    ) -> Option<Self> {
        let posture = (index < problem.postures()).then_some(index);
        let count = points.len() as f64;
        let all: Vec<Vec<(f64, f64)>> =
            points.iter().map(|point| inputs(problem, &point.values, index)).collect();
        let moments = (0..all.first()?.len()).map(|i| {
            let mean = all.iter().map(|x| x[i].0).sum::<f64>() / count;
            let variance = all.iter().map(|x| (x[i].0 - mean).powi(2)).sum::<f64>() / count;
            (i, mean, variance.sqrt())
        });
        let varies = |i: usize| all.iter().any(|x| x[i].0 != all[0][i].0);
        let varying: Vec<(usize, f64, f64)> = moments.filter(|&(i, ..)| varies(i)).collect();
        let mut model = Self { inputs: varying, coefficients: DMatrix::zeros(0, 0) };
        // One column for each equation: for the numbers at a point, then for their derivatives by each input.
        let (mut equations, mut sides) = (Vec::new(), Vec::new());
        for (point, all) in points.iter().zip(&all) {
            let (positions, lengths) = point.solved.shape(index);
            let own = model.standardised(all);
            equations.extend(monomials(&own));
            sides.extend(lengths.iter().map(|l| l.ln()));
            sides.extend(problem.measurements.auxiliary.of_shape(posture, positions));
            let by_load: Vec<Vec<f64>> = Vec::from_iter(point.adjoints[index].iter().map(|adjoint| {
                let hyoid = problem.posterior_model.hyoid_rates(adjoint);
                adjoint.by_tension.iter().chain(&hyoid).copied().collect()
            }));
            for (by, &(i, _, sd)) in model.inputs.iter().enumerate() {
                equations.extend(derivatives(&own, by));
                let rates = by_load.iter().enumerate();
                sides.extend(
                    rates.map(|(number, r)| r[i] * sd / all[i].1 / lengths.get(number).unwrap_or(&1.0)),
                );
            }
        }
        let terms = monomials(&vec![0.0; model.inputs.len()]).count();
        let columns = equations.len() / terms;
        let equations = DMatrix::from_vec(terms, columns, equations);
        let sides = DMatrix::from_vec(sides.len() / columns, columns, sides);
        let ridge = DMatrix::from_diagonal_element(terms, terms, RIDGE);
        let matrix = &equations * equations.transpose() + ridge;
        model.coefficients = matrix.cholesky()?.solve(&(equations * sides.transpose()));
        Some(model)
    }

    /// The numbers at these inputs: the logarithms of all lengths, then the others.
    pub fn numbers(&self, all: &[(f64, f64)]) -> DVector<f64> {
        let own = self.standardised(all);
        self.coefficients.tr_mul(&DVector::from_iterator(self.coefficients.nrows(), monomials(&own)))
    }

    /// Derivatives by every tension, the hyoid's displacement and its angle of the sum of the numbers, each times its weight.
    pub fn gradient(&self, all: &[(f64, f64)], weights: &DVector<f64>) -> Vec<f64> {
        let own = self.standardised(all);
        let by_term = &self.coefficients * weights;
        // The terms are in the order of `monomials`.
        let mut next = by_term.iter().skip(1);
        let mut slopes: Vec<f64> = next.by_ref().take(own.len()).copied().collect();
        for i in 0..own.len() {
            for (j, weight) in (0..=i).zip(next.by_ref()) {
                slopes[i] += weight * own[j];
                slopes[j] += weight * own[i];
            }
        }
        let mut by_load = vec![0.0; all.len()];
        for (slope, &(i, _, sd)) in slopes.iter().zip(&self.inputs) {
            by_load[i] = slope * all[i].1 / sd;
        }
        by_load
    }

    /// The inputs that vary, in standard deviations from their means.
    fn standardised(&self, all: &[(f64, f64)]) -> Vec<f64> {
        self.inputs.iter().map(|&(i, mean, sd)| (all[i].0 - mean) / sd).collect()
    }
}
