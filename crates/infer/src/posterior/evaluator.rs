//! Solves points of a density, at most as many at once as there are lanes, and differentiates what is computed there.

use std::sync::Arc;

use nalgebra::{DVector, SVector};

use tongue_core::statics::lanes::{Adjoint, LaneGroup};

use super::auxiliary::DataSource;
use super::finite_differences;
use super::linearisation::{DifferentiatedPoint, LinearisationPoint};
use super::parameters::{ParameterValues, SolvedPoint};
use super::problem::{PosteriorProblem, is_found};
use super::rest_shape;

/// The work spaces of one thread.
pub struct Evaluator<'a> {
    problem: &'a PosteriorProblem<'a>,
    /// A group for each posture, then one for the baseline.
    shapes: Vec<LaneGroup<'a, 2>>,
}

impl<'a> Evaluator<'a> {
    pub fn new(problem: &'a PosteriorProblem<'_>) -> Self {
        let shapes = (0..=problem.postures()).map(|_| problem.lanes().group()).collect();
        Self { problem, shapes }
    }

    /// Solves points from states nearby; `None` where the density is zero.
    pub fn solve(&mut self, points: &[(&ParameterValues, &SolvedPoint)]) -> Vec<Option<SolvedPoint>> {
        let problem = self.problem;
        for (index, group) in self.shapes.iter_mut().enumerate() {
            let loads = Vec::from_iter(points.iter().map(|(values, from)| {
                problem.posterior_model.load(values, index, Some(from.shape(index).0))
            }));
            group.solve(&loads, problem.settings());
        }
        let each = points.iter().enumerate().map(|(point, (values, _))| {
            let found = self.shapes.iter().map(|group| &group.equilibria()[point]);
            let shapes = found.map(|shape| is_found(shape).then(|| shape.positions.clone()));
            problem.solved(values, shapes.collect::<Option<_>>()?)
        });
        each.collect()
    }

    /// The points to whose shapes the tensions lead from rest; `None` where the density is zero.
    pub fn solve_from_rest(&mut self, points: &[&ParameterValues]) -> Vec<Option<SolvedPoint>> {
        let problem = self.problem;
        let groups = self.shapes.iter_mut().enumerate();
        let mut shapes: Vec<_> = groups
            .map(|(index, group)| {
                let load =
                    |i: usize, part| problem.posterior_model.load(&points[i].scaled(part), index, None);
                group.solve_from_rest(points.len(), problem.settings(), &load).into_iter()
            })
            .collect();
        let each = points.iter().map(|values| {
            // Every shape of this point is taken, also behind one that is not reached.
            let own: Vec<_> = shapes.iter_mut().map(|shape| shape.next().flatten()).collect();
            let positions = own.into_iter().map(|shape| Some(shape?.positions));
            problem.solved(values, positions.collect::<Option<_>>()?)
        });
        each.collect()
    }

    /// The linearisation at a point, solved from `begin`; `None` where the density is zero.
    pub fn linearise(&mut self, scores: &DVector<f64>, begin: &SolvedPoint) -> Option<LinearisationPoint> {
        self.linearise_all(&[(scores, begin)]).pop()?
    }

    /// Linearisations at up to as many points as there are lanes, `None` where the density is zero. The sensitivities to geometry cost more
    /// than everything else.
    pub(super) fn linearise_all(
        &mut self,
        points: &[(&DVector<f64>, &SolvedPoint)],
    ) -> Vec<Option<LinearisationPoint>> {
        let is_of_springs = self.problem.posterior_model.is_of_springs();
        let each = self.differentiate(points).into_iter().map(|point| {
            let point = point?;
            let geometry = if is_of_springs {
                rest_shape::of_springs(&point)?
            } else {
                finite_differences::of_perturbed_bodies(&point)?
            };
            Some(LinearisationPoint { jacobian: point.jacobian(), geometry, solved: point.solved })
        });
        each.collect()
    }

    /// The points with the adjoints of all numbers of their shapes, `None` where the density is zero.
    pub(super) fn differentiate(
        &mut self,
        points: &[(&DVector<f64>, &SolvedPoint)],
    ) -> Vec<Option<DifferentiatedPoint<'a>>> {
        let problem = self.problem;
        let values: Vec<_> = points.iter().map(|(scores, _)| problem.parameter_values(scores)).collect();
        let starts: Vec<_> =
            values.iter().zip(points).map(|((values, _), (_, from))| (values, *from)).collect();
        let solved = self.solve(&starts);
        // Adjoints of the numbers of each shape, at each point: of all lengths, then of the auxiliary numbers that follow from the shape.
        let mut adjoints: Vec<Vec<Option<Vec<Adjoint<2>>>>> =
            self.shapes.iter_mut().map(LaneGroup::length_rates).collect();
        for (source, number) in problem.measurements.auxiliary.numbers() {
            let DataSource::Shape(view) = source else { continue };
            let index = view.posture.unwrap_or(problem.postures());
            let gradients = solved.iter().map(|solved| match solved {
                Some(solved) => view.gradient_of(number, solved.shape(index).0),
                None => vec![SVector::zeros(); problem.posterior_model.system.rest().len()],
            });
            let found = self.shapes[index].adjoint(&gradients.collect::<Vec<_>>());
            for (all, one) in adjoints[index].iter_mut().zip(found) {
                *all = all.take().zip(one).map(|(mut all, one)| {
                    all.push(one);
                    all
                });
            }
        }
        let each = solved.into_iter().zip(values).enumerate().map(|(i, (solved, (values, slopes)))| {
            let adjoints: Option<Vec<_>> = adjoints.iter_mut().map(|shape| shape[i].take()).collect();
            Some(DifferentiatedPoint { problem, solved: solved?, values, slopes, adjoints: adjoints? })
        });
        each.collect()
    }
}

impl PosteriorProblem<'_> {
    /// A point with these positions of all nodes, m, in each posture and in the baseline; `None` if a number is not finite.
    fn solved(&self, values: &ParameterValues, shapes: Vec<Vec<SVector<f64, 2>>>) -> Option<SolvedPoint> {
        let system = &self.posterior_model.system;
        let view = |posture: Option<usize>| shapes[posture.unwrap_or(self.postures())].as_slice();
        let auxiliary = self.measurements.auxiliary.values(values, view);
        let lengths = shapes.iter().flat_map(|positions| system.lengths(positions)).collect();
        auxiliary.iter().all(|v| v.is_finite()).then(|| SolvedPoint {
            lengths,
            shapes: shapes.into_iter().map(Arc::new).collect(),
            auxiliary,
        })
    }
}
