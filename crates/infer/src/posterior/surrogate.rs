//! The approximation of a density that the sampler's trajectories follow: a quadratic model of what is computed from each shape
//! (`quadratic_shape`), fitted to draws about the mode, and again to draws of the density.

use nalgebra::DVector;

use tongue_core::parallel;
use tongue_core::statics::lanes::LANES;

use super::PosteriorError;
use super::auxiliary::NumberOrigin;
use super::evaluator::Evaluator;
use super::hmc::{self, SampledDensity, Settings, Whitened};
use super::linearisation::{DifferentiatedPoint, by_parameter};
use super::parameters::{Draw, ParameterValues, SolvedPoint};
use super::problem::PosteriorProblem;
use super::quadratic_shape::{QuadraticShape, inputs};

/// Number of draws to which the model is fitted first, half of which mirror the others about the mode, and their spread over that of the
/// given coordinates, so that tails are reached.
const DRAWS: usize = 64;
const SPREAD: f64 = 1.3;
const SEED: u64 = 11;
/// The run that gives further draws.
const BRIEF: Settings = Settings { warm_up: 40, draws: 16, thin: 2, seed: SEED };
/// Power of the likelihood in the approximation, whose tails must not be lighter than those of the density, because chains would stay there
/// for long.
const TEMPERED: f64 = 0.9;

/// A likelihood of the residuals of all measured numbers.
pub trait ResidualLikelihood: Sync {
    /// The logarithm of their density up to a constant, and minus its derivatives by the residuals.
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>);
}

impl ResidualLikelihood for PosteriorProblem<'_> {
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>) {
        let weighted = &self.precision * residuals;
        (-0.5 * residuals.dot(&weighted), weighted)
    }
}

/// Models of all shapes of a density: of each posture, then of the baseline.
#[derive(Debug)]
pub struct Surrogate<'d> {
    shapes: Vec<QuadraticShape>,
    /// Where each auxiliary number of the density comes from.
    origins: Vec<NumberOrigin<'d>>,
}

impl<'d> Surrogate<'d> {
    /// Models that are fitted to draws from the normal distribution of these coordinates.
    pub fn about(problem: &'d PosteriorProblem<'_>, whitened: &Whitened) -> Result<Self, PosteriorError> {
        Self::fit(problem, &drawn(problem, whitened)?)
    }

    /// Models that are fitted to the draws of [`Self::about`] and to draws of the density that those models gave.
    pub fn refined(
        problem: &'d PosteriorProblem<'_>,
        errors: &dyn ResidualLikelihood,
        whitened: &Whitened,
    ) -> Result<Self, PosteriorError> {
        let mut points = drawn(problem, whitened)?;
        let first = Self::fit(problem, &points)?;
        let target = || SurrogateDensity::new(problem, errors, &first);
        let chains = hmc::sample_briefly(target, whitened, &BRIEF, None);
        let mut draws: Vec<DVector<f64>> = chains.into_iter().flat_map(|chain| chain.scores).collect();
        draws.dedup();
        points.extend(differentiated(problem, &draws));
        Self::fit(problem, &points)
    }

    fn fit(
        problem: &'d PosteriorProblem<'_>,
        points: &[DifferentiatedPoint<'_>],
    ) -> Result<Self, PosteriorError> {
        let (muscles, postures) = (problem.posterior_model.muscles.len(), problem.postures());
        let shapes = (0..=postures).map(|index| QuadraticShape::fit(problem, points, index));
        let shapes = shapes.collect::<Option<_>>().ok_or(PosteriorError::NoMode)?;
        Ok(Self { shapes, origins: problem.measurements.auxiliary.origins(postures, muscles).collect() })
    }

    /// Logarithm of the approximate density at these scores, and its derivatives.
    fn log(
        &self,
        problem: &PosteriorProblem<'_>,
        errors: &dyn ResidualLikelihood,
        scores: &DVector<f64>,
    ) -> (f64, DVector<f64>) {
        let (values, slopes) = problem.parameter_values(scores);
        let (muscles, postures) = (problem.posterior_model.muscles.len(), problem.postures());
        let measurements = &problem.measurements;
        let all: Vec<_> = (0..=postures).map(|index| inputs(problem, &values, index)).collect();
        let numbers: Vec<_> = self.shapes.iter().zip(&all).map(|(shape, all)| shape.numbers(all)).collect();
        let lengths: Vec<f64> =
            numbers.iter().flat_map(|own| own.iter().take(muscles).map(|ln| ln.exp())).collect();
        let auxiliary = self.origins.iter().map(|origin| match *origin {
            NumberOrigin::Activity(active) => active.value(&values),
            NumberOrigin::Shape(index, number) => numbers[index][number],
        });
        let auxiliary: Vec<f64> = auxiliary.collect();
        let (log, weights) = errors.log(&problem.residuals(&lengths, &auxiliary));
        let (log, weights) = (TEMPERED * log, weights * TEMPERED);
        // Derivatives of the logarithm by the numbers of each shape.
        let mut by_number: Vec<DVector<f64>> = numbers.iter().map(|own| DVector::zeros(own.len())).collect();
        for (i, measured) in measurements.stretches.iter().enumerate() {
            let m = measured.muscle;
            let stretch = lengths[problem.rows[i]] / lengths[postures * muscles + m];
            by_number[measured.posture][m] += weights[i] * stretch;
            by_number[postures][m] -= weights[i] * stretch;
        }
        let of_auxiliary = &weights.as_slice()[measurements.stretches.len()..];
        for (origin, weight) in self.origins.iter().zip(of_auxiliary) {
            if let NumberOrigin::Shape(index, number) = *origin {
                by_number[index][number] += weight;
            }
        }
        let shapes = self.shapes.iter().zip(&all).zip(&by_number);
        let by_load: Vec<_> = shapes.map(|((shape, all), weights)| shape.gradient(all, weights)).collect();
        let gradient = DVector::from_fn(scores.len(), |i, _| {
            let parameter = problem.parameters[i];
            let of_activity = self.origins.iter().zip(of_auxiliary).map(|(origin, weight)| match origin {
                NumberOrigin::Activity(active) => weight * active.slope(&values, parameter),
                NumberOrigin::Shape(..) => 0.0,
            });
            let of_shapes = by_load.iter().enumerate().map(|(index, by)| {
                let hyoid = [by[muscles], by[muscles + 1], by[muscles + 2]];
                by_parameter(&values, index, by, hyoid, parameter)
            });
            slopes[i] * (of_activity.sum::<f64>() + of_shapes.sum::<f64>()) - scores[i]
        });
        (log - 0.5 * scores.norm_squared(), gradient)
    }
}

/// Draws from the normal distribution of these coordinates, differentiated; an error where fewer than half of them have an equilibrium.
fn drawn<'a>(
    problem: &'a PosteriorProblem<'_>,
    whitened: &Whitened,
) -> Result<Vec<DifferentiatedPoint<'a>>, PosteriorError> {
    let draws: Vec<DVector<f64>> = whitened.mirrored_draws(DRAWS, SPREAD, SEED).map(|(_, x)| x).collect();
    let points = differentiated(problem, &draws);
    if 2 * points.len() < DRAWS { Err(PosteriorError::NoMode) } else { Ok(points) }
}

/// The points at these scores, solved from rest and differentiated; those of zero density are left out.
fn differentiated<'a>(
    problem: &'a PosteriorProblem<'_>,
    scores: &[DVector<f64>],
) -> Vec<DifferentiatedPoint<'a>> {
    let groups: Vec<&[DVector<f64>]> = scores.chunks(LANES).collect();
    let points = parallel::map(&groups, |group| {
        let mut evaluator = Evaluator::new(problem);
        let values: Vec<ParameterValues> = group.iter().map(|x| problem.parameter_values(x).0).collect();
        let begun = evaluator.solve_from_rest(&values.iter().collect::<Vec<_>>());
        let begun: Vec<(&DVector<f64>, &SolvedPoint)> =
            group.iter().zip(&begun).filter_map(|(x, begun)| Some((x, begun.as_ref()?))).collect();
        evaluator.differentiate(&begun)
    });
    points.into_iter().flatten().flatten().collect()
}

/// A density with its model, for one thread.
pub struct SurrogateDensity<'a> {
    pub problem: &'a PosteriorProblem<'a>,
    pub errors: &'a dyn ResidualLikelihood,
    pub surrogate: &'a Surrogate<'a>,
    evaluator: Evaluator<'a>,
}

impl<'a> SurrogateDensity<'a> {
    /// The density with another likelihood of the residuals.
    pub fn new(
        problem: &'a PosteriorProblem<'_>,
        errors: &'a dyn ResidualLikelihood,
        surrogate: &'a Surrogate<'_>,
    ) -> Self {
        Self { problem, errors, surrogate, evaluator: Evaluator::new(problem) }
    }
}

impl SampledDensity for SurrogateDensity<'_> {
    type Kept = Draw;

    fn approximate(&self, at: &DVector<f64>) -> (f64, DVector<f64>) {
        self.surrogate.log(self.problem, self.errors, at)
    }

    fn evaluate(&mut self, points: &[&DVector<f64>]) -> Vec<Option<(f64, Draw)>> {
        let values: Vec<ParameterValues> =
            points.iter().map(|x| self.problem.parameter_values(x).0).collect();
        let solved = self.evaluator.solve_from_rest(&values.iter().collect::<Vec<_>>());
        let each = solved.into_iter().zip(values).zip(points).map(|((solved, values), at)| {
            let SolvedPoint { lengths, auxiliary, .. } = solved?;
            let log_likelihood = self.errors.log(&self.problem.residuals(&lengths, &auxiliary)).0;
            let log = log_likelihood - 0.5 * at.norm_squared();
            Some((log, Draw { chain: 0, number: 0, values, lengths, auxiliary, log, log_likelihood }))
        });
        each.collect()
    }
}
