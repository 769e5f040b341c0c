//! The most probable scores by damped Gauss-Newton with exact derivatives, and the covariance due to geometry.
//!
//! The sensitivity of stretches to geometry grows with the tensions, so the covariance due to geometry is the mean over draws of the normal
//! approximation at the mode. At the mode alone it would be too small, because tensions that the data do not resolve are small there.
//!
//! The mean of the precisions instead would weigh draws near a fold less, where linear responses are far too large: P(SGm rises) of S1 /i/
//! becomes .05 instead of .12, nearer to the .02 of a posterior that samples geometry. But the intervals of changes then hold only 92.6 ±
//! .6 % of the truths of 200 speakers of three vowels, instead of 94.3 %.
//!
//! If ends, outline and kappa are sampled too (65 parameters in place of 20, with exact derivatives), P(SGm rises) of S1 /i/ is .034 ± .007.
//! That took 75 to 98 CPU seconds of Hamiltonian Monte Carlo on the density itself and mixed less well: steps must be short near a fold, and
//! a quarter of the trajectories end where a cell of the body folds or the tensions do not lead from rest. Nor does a quadratic model (as in
//! `surrogate`) of the 65 parameters follow it: fitted to 320 solved points it leaves an error of .018 in stretches. The density would accept
//! a quarter of its draws, and chains would stay for very long at one draw of 300, whose density is more than e^13 times that of the model.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::least_squares::{Rule, TrialStep, descend};
use tongue_core::parallel;
use tongue_core::statics::SAME_SHAPE_M;
use tongue_core::statics::lanes::LANES;

use super::PosteriorError;
use super::evaluator::Evaluator;
use super::hmc::Whitened;
use super::linearisation::{GeometrySensitivities, LinearisationPoint};
use super::parameters::SolvedPoint;
use super::problem::PosteriorProblem;
use super::quantiles::{effective, shares};

/// Covariance due to geometry and constants at a point.
fn covariance(point: &LinearisationPoint) -> DMatrix<f64> {
    let GeometrySensitivities { ends, outline, kappa, width, patch } = &point.geometry;
    [outline, kappa, width, patch].into_iter().fold(ends * ends.transpose(), |sum, m| sum + m * m.transpose())
}

#[derive(Debug)]
struct DrawAround {
    scores: DVector<f64>,
    /// Logarithm of the normal density from which it is drawn, up to a constant.
    log: f64,
    /// Covariance due to geometry and constants there.
    geometry: DMatrix<f64>,
}

/// Weighted mean of the covariance due to geometry; the weights add up to one.
fn mean<'a>(draws: impl Iterator<Item = (&'a DrawAround, f64)>) -> DMatrix<f64> {
    draws.map(|(draw, weight)| &draw.geometry * weight).sum()
}

#[derive(Debug, Clone)]
pub struct MapEstimate {
    pub scores: DVector<f64>,
    pub solved: SolvedPoint,
    /// Derivatives of all computed numbers by the scores.
    jacobian: DMatrix<f64>,
    /// Minus the derivatives of the logarithm of the density by the scores.
    gradient: DVector<f64>,
    /// `I + Jᵀ C⁻¹ J`, the precision of the scores.
    pub precision: DMatrix<f64>,
    /// Logarithm of the density, up to a constant.
    pub log: f64,
    /// The draws over which the covariance due to geometry was averaged last.
    around: Arc<Vec<DrawAround>>,
}

/// Longest change of a score for which the linear response holds.
const LONGEST: f64 = 2.0;
const CLIMB: Rule = Rule { max_steps: 40, least_damping: 0.5, most_damping: 1e8, ..Rule::UNDAMPED };
/// Largest error of the scores of a mode, and of one that serves only as a centre for draws.
const TOLERANCE: f64 = 1e-4;
const CENTRE_TOLERANCE: f64 = 1e-2;
/// Number of averages of the covariance, each followed by a search for the mode.
const ROUNDS: usize = 2;
/// Number of draws for the average, half of which mirror the others about the mode.
const DRAWS: usize = 64;
/// The number in bodies that are not made of springs, where a draw costs more.
const DRAWS_WITHOUT_LANES: usize = 16;
/// Smallest effective part of the draws about a mode that are used for the average about a neighbour.
const LEAST_EFFECTIVE: f64 = 0.25;
const SEED: u64 = 3;
/// Standard normal quantile of the probability 0.99.
const ONE_IN_HUNDRED: f64 = 2.326;

impl PosteriorProblem<'_> {
    /// The most probable scores. Sets the covariance due to geometry, averaged about them.
    pub fn map(&mut self) -> Result<MapEstimate, PosteriorError> {
        // Begins at the medians, or at smaller tensions where these have no equilibrium.
        let (n, rest) = (self.parameters.len(), self.rest());
        let begin = [0.0, -1.0, -2.0, -3.0, -4.0].into_iter().find_map(|score| {
            let start = DVector::from_element(n, score);
            let linear = Evaluator::new(self).linearise(&start, &rest)?;
            Some((start, linear))
        });
        let (start, linear) = begin.ok_or(PosteriorError::NoMode)?;
        self.set_geometry(covariance(&linear))?;
        let mut map_estimate = MapEstimate::new(self, start, linear.jacobian, linear.solved);
        for _ in 0..ROUNDS {
            map_estimate.climb(self, CENTRE_TOLERANCE);
            map_estimate.average(self)?;
        }
        map_estimate.climb(self, TOLERANCE);
        Ok(map_estimate)
    }
}

impl MapEstimate {
    /// Refuses data that the prior predictive distribution hardly gives. For a linear model the squared deviations at the mode have the
    /// chi-square distribution with as many degrees of freedom as there are numbers (Gelman and others, Bayesian Data Analysis 2013, 6.3).
    pub fn check_data(&self, problem: &PosteriorProblem<'_>) -> Result<(), PosteriorError> {
        let (squares, numbers) = (-2.0 * self.log, problem.rows.len());
        // Wilson and Hilferty 1931.
        let (n, sd) = (numbers as f64, (2.0 / (9.0 * numbers as f64)).sqrt());
        let most = n * (1.0 - sd * sd + ONE_IN_HUNDRED * sd).powi(3);
        if squares > most { Err(PosteriorError::Contradicted { squares, numbers }) } else { Ok(()) }
    }

    /// Whether the loads lead from rest to these shapes, which the search found from neighbours.
    pub fn is_reached_from_rest(&self, problem: &PosteriorProblem<'_>) -> bool {
        let (values, _) = problem.parameter_values(&self.scores);
        let reached = Evaluator::new(problem).solve_from_rest(&[&values]).remove(0);
        reached.is_some_and(|reached| {
            let mut lengths = reached.lengths.iter().zip(&self.solved.lengths);
            lengths.all(|(a, b)| (a - b).abs() <= SAME_SHAPE_M)
        })
    }

    /// Finds the mode from that of nearly the same stretches, `near`, about which `density` must have the covariance due to geometry. Sets
    /// its average about the mode of the linear model: over the draws about `near`, which are weighted, and, where too few of these are
    /// effective, over more draws.
    pub fn find_near(problem: &mut PosteriorProblem<'_>, near: &Self) -> Result<Self, PosteriorError> {
        let (scores, jacobian, solved) = (near.scores.clone(), near.jacobian.clone(), near.solved.clone());
        let mut map_estimate = Self::new(problem, scores, jacobian, solved);
        let step = TrialStep::newton(map_estimate.precision.clone(), &map_estimate.gradient, LONGEST);
        let expected = &near.scores + step.ok_or(PosteriorError::Covariance)?.by;
        let logs = near.around.iter().map(|draw| {
            let away = &draw.scores - &expected;
            -0.5 * away.dot(&(&map_estimate.precision * &away)) - draw.log
        });
        let (weights, _) = shares(logs.collect::<Vec<_>>().into_iter());
        let old = effective(&weights);
        let more = if old < LEAST_EFFECTIVE * weights.len() as f64 {
            let whitened = Whitened::new(expected, map_estimate.precision.clone());
            map_estimate.draws_around(problem, whitened, Self::draws_for_average(problem) / 2)?
        } else {
            Vec::new()
        };
        let total = old + more.len() as f64;
        let weighted = near.around.iter().zip(weights.into_iter().map(|weight| weight * old / total));
        if !near.around.is_empty() {
            problem.set_geometry(mean(weighted.chain(more.iter().map(|draw| (draw, 1.0 / total)))))?;
        }
        map_estimate.climb(problem, CENTRE_TOLERANCE);
        Ok(map_estimate)
    }

    fn average(&mut self, problem: &mut PosteriorProblem<'_>) -> Result<(), PosteriorError> {
        let count = Self::draws_for_average(problem);
        self.around = Arc::new(self.draws_around(problem, self.whitened(), count)?);
        let weight = 1.0 / self.around.len() as f64;
        if !self.around.is_empty() {
            problem.set_geometry(mean(self.around.iter().map(|draw| (draw, weight))))?;
        }
        Ok(())
    }

    fn draws_for_average(problem: &PosteriorProblem<'_>) -> usize {
        if problem.posterior_model.is_of_springs() { DRAWS } else { DRAWS_WITHOUT_LANES }
    }

    /// Draws from the normal distribution of some coordinates, solved from the mode; those without an equilibrium are left out.
    fn draws_around(
        &self,
        problem: &PosteriorProblem<'_>,
        whitened: Option<Whitened>,
        count: usize,
    ) -> Result<Vec<DrawAround>, PosteriorError> {
        let whitened = whitened.ok_or(PosteriorError::Covariance)?;
        let draws: Vec<(DVector<f64>, f64)> =
            whitened.mirrored_draws(count, 1.0, SEED).map(|(z, x)| (x, -0.5 * z.norm_squared())).collect();
        let groups: Vec<_> = draws.chunks(LANES).collect();
        let found = parallel::map(&groups, |group| {
            let points: Vec<_> = group.iter().map(|(x, _)| (x, &self.solved)).collect();
            let linear = Evaluator::new(problem).linearise_all(&points);
            let each = group.iter().zip(linear).filter_map(|((scores, log), linear)| {
                Some(DrawAround { scores: scores.clone(), log: *log, geometry: covariance(&linear?) })
            });
            each.collect::<Vec<_>>()
        });
        Ok(found.into_iter().flatten().collect())
    }

    fn new(
        problem: &PosteriorProblem<'_>,
        scores: DVector<f64>,
        jacobian: DMatrix<f64>,
        solved: SolvedPoint,
    ) -> Self {
        let of_measured = jacobian.select_rows(&problem.rows);
        let n = scores.len();
        let precision = DMatrix::identity(n, n) + of_measured.tr_mul(&(&problem.precision * &of_measured));
        let residuals = problem.residuals(&solved.lengths, &solved.auxiliary);
        let weighted = &problem.precision * &residuals;
        let log = -0.5 * (residuals.dot(&weighted) + scores.norm_squared());
        let gradient = &scores - of_measured.tr_mul(&weighted);
        Self { scores, solved, jacobian, gradient, precision, log, around: Arc::default() }
    }

    /// Moves to the mode for the present covariance.
    fn climb(&mut self, problem: &PosteriorProblem<'_>, step_tolerance: f64) {
        let Self { scores, jacobian, solved, around, .. } = self.clone();
        let begin = Self::new(problem, scores, jacobian, solved);
        let mut evaluator = Evaluator::new(problem);
        let step = |here: &Self, damping: f64| {
            let mut matrix = here.precision.clone();
            (0..here.scores.len()).for_each(|i| matrix[(i, i)] += damping);
            TrialStep::newton(matrix, &here.gradient, LONGEST)
        };
        let moved = |here: &Self, step: &DVector<f64>| {
            let next = &here.scores + step;
            let point = evaluator.differentiate(&[(&next, &here.solved)]).pop().flatten()?;
            Some(Self::new(problem, next, point.jacobian(), point.solved))
        };
        let rule = Rule { step_tolerance, ..CLIMB };
        *self = Self { around, ..descend(begin, &rule, |here| -here.log, step, moved).here };
    }

    /// Coordinates in which the posterior is nearly standard normal.
    pub fn whitened(&self) -> Option<Whitened> {
        Whitened::new(self.scores.clone(), self.precision.clone())
    }
}
