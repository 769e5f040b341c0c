//! Evaluates a density at as many points as there are lanes: its logarithm with the exact gradient, and its linearisation.

use std::sync::Arc;

use nalgebra::{DVector, SVector};

use tongue_core::statics::lanes::{Adjoint, LaneEquilibrium, LaneGroup, length_gradient};

use super::auxiliary::DataSource;
use super::density::{Density, is_found};
use super::finite_differences;
use super::from_rest::lengths_reached_from_rest;
use super::hmc::{DensityPoint, SampledDensity};
use super::linearisation::{DifferentiatedPoint, FiniteDifferences, LinearisationPoint, by_parameter};
use super::parameters::{Draw, ParameterValues, SolvedPoint};
use super::rest_shape;

pub trait ResidualLikelihood: Sync {
    /// The logarithm of their density up to a constant, and minus its derivatives by the residuals.
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>);
}

impl ResidualLikelihood for Density<'_> {
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>) {
        let pulls = self.factor.solve(residuals);
        (-0.5 * residuals.dot(&pulls), pulls)
    }
}

/// Solves and differentiates points of a density, at most as many at once as there are lanes.
pub struct Evaluator<'a> {
    density: &'a Density<'a>,
    errors: &'a dyn ResidualLikelihood,
    /// A group for each posture, then one for the baseline.
    shapes: Vec<LaneGroup<'a, 2>>,
    /// As `shapes`, for load paths.
    load_paths: Vec<LaneGroup<'a, 2>>,
}

/// The values of the parameters at a point, and their derivatives by the scores.
type ValuesAndSlopes = (ParameterValues, Vec<f64>);

impl<'a> Evaluator<'a> {
    pub fn new(density: &'a Density<'_>) -> Self {
        Self::with_errors(density, density)
    }

    /// [`Self::new`] with another likelihood of the residuals.
    pub fn with_errors(density: &'a Density<'_>, errors: &'a dyn ResidualLikelihood) -> Self {
        let groups = || (0..=density.postures()).map(|_| density.lanes().group()).collect();
        Self { density, errors, shapes: groups(), load_paths: groups() }
    }

    fn solve(
        &mut self,
        points: &[(&DVector<f64>, &SolvedPoint)],
    ) -> (Vec<ValuesAndSlopes>, Vec<Option<SolvedPoint>>) {
        let density = self.density;
        let values: Vec<_> = points.iter().map(|(g, _)| density.parameter_values(g)).collect();
        for (index, group) in self.shapes.iter_mut().enumerate() {
            let loads = Vec::from_iter((0..points.len()).map(|i| {
                density.posterior_model.load(&values[i].0, index, Some(points[i].1.shape(index).0))
            }));
            group.solve(&loads, density.settings());
        }
        let system = &density.posterior_model.system;
        let solved = Vec::from_iter((0..points.len()).map(|point| {
            let found: Vec<&LaneEquilibrium<2>> =
                self.shapes.iter().map(|group| &group.answers()[point]).collect();
            if !found.iter().all(|shape| is_found(shape)) {
                return None;
            }
            let auxiliary = density
                .measurements
                .auxiliary
                .values(&values[point].0, |posture| &found[posture.unwrap_or(density.postures())].positions);
            auxiliary.iter().all(|v| v.is_finite()).then(|| SolvedPoint {
                lengths: found.iter().flat_map(|shape| system.lengths(&shape.positions)).collect(),
                shapes: found.iter().map(|shape| Arc::new(shape.positions.clone())).collect(),
                auxiliary,
            })
        }));
        (values, solved)
    }

    /// The linearisation at a point, solved from `begin`; `None` where the density is zero.
    pub fn linearise(
        &mut self,
        scores: &DVector<f64>,
        begin: &SolvedPoint,
    ) -> Option<(LinearisationPoint, SolvedPoint)> {
        self.linearise_all(&[(scores, begin)], true).pop()?
    }

    /// Linearisations at up to as many points as there are lanes, `None` where the density is zero. The sensitivities to geometry cost more
    /// than everything else and are computed only if `geometry` is set.
    pub(super) fn linearise_all(
        &mut self,
        points: &[(&DVector<f64>, &SolvedPoint)],
        geometry: bool,
    ) -> Vec<Option<(LinearisationPoint, SolvedPoint)>> {
        let (values, solved) = self.solve(points);
        // Adjoints of the numbers of each shape, at each point: of all lengths, then of the auxiliary numbers that follow from the shape.
        let mut adjoints: Vec<Vec<Option<Vec<Adjoint<2>>>>> =
            self.shapes.iter_mut().map(LaneGroup::length_rates).collect();
        for (source, number) in self.density.measurements.auxiliary.numbers() {
            let DataSource::Shape(view) = source else { continue };
            let index = view.posture.unwrap_or(self.density.postures());
            let gradients = solved.iter().map(|solved| match solved {
                Some(solved) => view.gradient_of(number, solved.shape(index).0),
                None => vec![SVector::zeros(); self.density.posterior_model.system.rest().len()],
            });
            let found = self.shapes[index].adjoint(&gradients.collect::<Vec<_>>());
            for (all, one) in adjoints[index].iter_mut().zip(found) {
                *all = all.take().zip(one).map(|(mut all, one)| {
                    all.push(one);
                    all
                });
            }
        }
        let each = solved.into_iter().zip(&values).enumerate().map(|(i, (solved, (values, slopes)))| {
            let adjoints: Option<Vec<_>> = adjoints.iter_mut().map(|shape| shape[i].take()).collect();
            let (solved, adjoints) = (solved?, adjoints?);
            let point = DifferentiatedPoint { density: self.density, solved: &solved, values, adjoints };
            let geometry = match (geometry, self.density.posterior_model.is_of_springs()) {
                (true, true) => rest_shape::of_springs(&point)?,
                (true, false) => finite_differences::answers(&point)?,
                (false, _) => FiniteDifferences::none(self.density.numbers()),
            };
            let jacobian = point.jacobian(slopes);
            Some((LinearisationPoint { jacobian, geometry }, solved))
        });
        each.collect()
    }

    /// Derivatives of the logarithm of the density by the scores, from the adjoints of all shapes and the weights of the auxiliary data.
    fn gradient(
        &self,
        scores: &DVector<f64>,
        (values, slopes): &ValuesAndSlopes,
        (adjoints, weights): (&[&Adjoint<2>], &[f64]),
    ) -> DVector<f64> {
        let density = self.density;
        DVector::from_fn(scores.len(), |i, _| {
            let p = density.parameters[i];
            let each = adjoints
                .iter()
                .enumerate()
                .map(|(index, adjoint)| by_parameter(density, values, index, adjoint, p));
            let auxiliary = density.measurements.auxiliary.slope(values, weights, p);
            slopes[i] * (each.sum::<f64>() + auxiliary) - scores[i]
        })
    }
}

impl SampledDensity for Evaluator<'_> {
    type Solved = SolvedPoint;
    type Kept = Draw;

    fn evaluate(
        &mut self,
        points: &[(&DVector<f64>, &SolvedPoint)],
    ) -> Vec<Option<DensityPoint<SolvedPoint>>> {
        let (values, solved) = self.solve(points);
        let (density, errors) = (self.density, self.errors);
        let (measurements, system) = (&density.measurements, &density.posterior_model.system);
        let (nodes, postures) = (system.rest().len(), density.postures());
        // Logarithm of the likelihood at every point, and minus its derivatives by the residuals.
        let weighed: Vec<Option<(f64, DVector<f64>)>> = solved
            .iter()
            .map(|solved| {
                let solved = solved.as_ref()?;
                Some(errors.log(&density.residuals(&solved.lengths, &solved.auxiliary)))
            })
            .collect();
        let adjoints = self.shapes.iter_mut().enumerate().map(|(index, group)| {
            group.adjoint(&Vec::from_iter(solved.iter().zip(&weighed).map(|(solved, weighed)| {
                let mut gradient = vec![SVector::zeros(); nodes];
                let Some((solved, (_, weights))) = solved.as_ref().zip(weighed.as_ref()) else {
                    return gradient;
                };
                for (i, &m) in measurements.muscles.iter().enumerate() {
                    let over = solved.shape(postures).1[m];
                    let part = match measurements.postures[i] {
                        _ if index == postures => -solved.lengths[density.rows[i]] / (over * over),
                        posture if posture == index => 1.0 / over,
                        _ => continue,
                    };
                    length_gradient(system, solved.shape(index).0, m, weights[i] * part, &mut gradient);
                }
                let at = ((index < postures).then_some(index), solved.shape(index).0);
                let weights = &weights.as_slice()[measurements.len()..];
                measurements.auxiliary.add_gradient(at, weights, &mut gradient);
                gradient
            })))
        });
        let adjoints: Vec<Vec<Option<Adjoint<2>>>> = adjoints.collect();
        let each = solved.into_iter().zip(weighed).enumerate().map(|(i, (solved, weighed))| {
            let own: Option<Vec<&Adjoint<2>>> = adjoints.iter().map(|a| a[i].as_ref()).collect();
            let (solved, (log, weights), own) = (solved?, weighed?, own?);
            let auxiliary = &weights.as_slice()[measurements.len()..];
            let gradient = self.gradient(points[i].0, &values[i], (&own, auxiliary));
            Some(DensityPoint { log: log - 0.5 * points[i].0.norm_squared(), gradient, solved })
        });
        each.collect()
    }

    /// Extrapolates the shapes linearly by another step.
    fn ahead(here: &SolvedPoint, before: &SolvedPoint) -> SolvedPoint {
        let each = here.shapes.iter().zip(&before.shapes);
        let further = each
            .map(|(here, before)| Arc::new(here.iter().zip(&**before).map(|(x, y)| x + (x - y)).collect()));
        SolvedPoint { shapes: further.collect(), ..here.clone() }
    }

    /// Whether the tensions of each point lead from rest to its shapes in all postures and in the baseline.
    fn allowed(&mut self, points: &[(&DVector<f64>, &DensityPoint<SolvedPoint>)]) -> Vec<bool> {
        let density = self.density;
        let values: Vec<ParameterValues> =
            points.iter().map(|(g, _)| density.parameter_values(g).0).collect();
        let found = self.load_paths.iter_mut().enumerate().map(|(index, group)| {
            let with: Vec<(&ParameterValues, &[f64])> =
                values.iter().zip(points).map(|(values, (_, p))| (values, p.solved.shape(index).1)).collect();
            lengths_reached_from_rest(density, group, &with, index)
        });
        let found: Vec<Vec<bool>> = found.collect();
        (0..points.len()).map(|i| found.iter().all(|shape| shape[i])).collect()
    }

    fn keep(&self, at: &DVector<f64>, point: &DensityPoint<SolvedPoint>) -> Draw {
        let (values, _) = self.density.parameter_values(at);
        Draw {
            chain: 0,
            number: 0,
            values,
            lengths: point.solved.lengths.clone(),
            auxiliary: point.solved.auxiliary.clone(),
            log: point.log,
            log_likelihood: point.log + 0.5 * at.norm_squared(),
        }
    }
}
