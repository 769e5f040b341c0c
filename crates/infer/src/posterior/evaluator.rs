//! Evaluates a density at as many points as there are lanes: its logarithm with the exact gradient, and its linearisation.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::statics::lanes::{Adjoint, LaneEquilibrium, LaneGroup, length_gradient};

use super::density::{Density, is_found};
use super::finite_differences::{self, Adjoints, FiniteDifferences, GeometrySensitivity};
use super::from_rest::lengths_reached_from_rest;
use super::hmc::{DensityPoint, SampledDensity};
use super::parameters::{Draw, Parameter, ParameterValues, SolvedPoint};
use super::rest_shape;

pub trait ResidualLikelihood: Sync {
    /// The logarithm of their density up to a constant, and minus its derivatives by the residuals.
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>);
}

impl ResidualLikelihood for Density<'_> {
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>) {
        let pulls = self.factor().solve(residuals);
        (-0.5 * residuals.dot(&pulls), pulls)
    }
}

/// Linearisation of all computed numbers at a point.
#[derive(Debug, Clone)]
pub struct LinearisationPoint {
    /// The stretches of all muscles of the body, posture by posture, then the auxiliary data.
    pub computed: DVector<f64>,
    /// Derivatives of these by the scores.
    pub jacobian: DMatrix<f64>,
    pub geometry: FiniteDifferences,
}

/// Solves and differentiates points of a density, at most as many at once as there are lanes.
pub struct Evaluator<'a> {
    density: &'a Density<'a>,
    errors: &'a dyn ResidualLikelihood,
    /// A group for each posture, then one for the baseline.
    shapes: Vec<LaneGroup<'a, 2>>,
    /// As `shapes`, for load paths.
    from_rest: Vec<LaneGroup<'a, 2>>,
}

/// For each point the values of the parameters with their derivatives by the scores, and the solved point.
type SolvedPoints = (Vec<(ParameterValues, Vec<f64>)>, Vec<Option<SolvedPoint>>);

/// The shape from which an auxiliary number follows, and the number's adjoint at each point; `None` where it follows from tensions.
type DataAdjoint = Option<(usize, Vec<Option<Adjoint<2>>>)>;

/// The adjoints of all lengths of one shape, for each point.
type LengthRates = Vec<Option<Vec<Adjoint<2>>>>;

impl<'a> Evaluator<'a> {
    pub fn new(density: &'a Density<'_>) -> Self {
        Self::with_errors(density, density)
    }

    /// [`Self::new`] with another likelihood of the residuals.
    pub fn with_errors(density: &'a Density<'_>, errors: &'a dyn ResidualLikelihood) -> Self {
        let groups = || (0..=density.postures()).map(|_| density.lanes().group()).collect();
        Self { density, errors, shapes: groups(), from_rest: groups() }
    }

    fn solve(&mut self, points: &[(&DVector<f64>, &SolvedPoint)]) -> SolvedPoints {
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
            let mut solved = SolvedPoint {
                lengths: found.iter().flat_map(|shape| system.lengths(&shape.positions)).collect(),
                shapes: found.iter().map(|shape| Arc::new(shape.positions.clone())).collect(),
                auxiliary: Vec::new(),
            };
            solved.auxiliary = density
                .measurements
                .auxiliary
                .iter()
                .flat_map(|b| b.values(&values[point].0, &solved))
                .collect();
            solved.auxiliary.iter().all(|v| v.is_finite()).then_some(solved)
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
        let mut rates: Vec<LengthRates> = self.shapes.iter_mut().map(LaneGroup::length_rates).collect();
        let mut data = self.data_adjoints(&solved);
        let mut out = Vec::with_capacity(points.len());
        for (i, solved) in solved.into_iter().enumerate() {
            let lengths: Option<Vec<Vec<Adjoint<2>>>> = rates.iter_mut().map(|r| r[i].take()).collect();
            // `None` where the adjoint of a number that follows from a shape was not found.
            let data: Option<Vec<_>> = data
                .iter_mut()
                .map(|own| match own {
                    Some((index, all)) => Some(Some((*index, all[i].take()?))),
                    None => Some(None),
                })
                .collect();
            out.push(solved.zip(lengths).zip(data).and_then(|((solved, lengths), data)| {
                let linear = self.linear(&values[i], &solved, &Adjoints { lengths, data }, geometry)?;
                Some((linear, solved))
            }));
        }
        out
    }

    fn data_adjoints(&mut self, solved: &[Option<SolvedPoint>]) -> Vec<DataAdjoint> {
        let nodes = self.density.posterior_model.system.rest().len();
        Vec::from_iter(self.density.measurements.auxiliary_numbers().map(|(auxiliary, number)| {
            let posture = auxiliary.posture(number)?;
            let index = posture.unwrap_or(self.shapes.len() - 1);
            let gradients: Vec<_> = solved
                .iter()
                .map(|solved| {
                    let mut gradient = vec![SVector::zeros(); nodes];
                    if let Some(solved) = solved {
                        let at = (posture, solved.shape(index).0);
                        auxiliary.gradient(at, &auxiliary.only(number), &mut gradient);
                    }
                    gradient
                })
                .collect();
            Some((index, self.shapes[index].adjoint(&gradients)))
        }))
    }

    fn linear(
        &self,
        (values, slopes): &(ParameterValues, Vec<f64>),
        solved: &SolvedPoint,
        rates: &Adjoints,
        geometry: bool,
    ) -> Option<LinearisationPoint> {
        let posterior_model = self.density.posterior_model;
        let (count, postures) = (posterior_model.muscles.len(), self.density.postures());
        let (_, over) = solved.shape(postures);
        let of_muscles = postures * count;
        let stretches = (0..of_muscles).map(|row| solved.lengths[row] / over[row % count]);
        let computed = stretches.chain(solved.auxiliary.iter().copied());
        let computed = DVector::from_iterator(of_muscles + solved.auxiliary.len(), computed);
        let mut jacobian = DMatrix::from_fn(computed.len(), slopes.len(), |row, p| {
            if row >= of_muscles {
                return 0.0;
            }
            solved.stretch_rate(row, slopes[p], |index, m| {
                let (adjoint, parameter) = (&rates.lengths[index][m], self.density.parameters[p]);
                by_parameter(posterior_model, values, (index, postures), adjoint, parameter)
            })
        });
        let numbers = self.density.measurements.auxiliary_numbers().zip(&rates.data);
        for (row, ((auxiliary, number), own)) in numbers.enumerate() {
            let weights = auxiliary.only(number);
            for (p, &parameter) in self.density.parameters.iter().enumerate() {
                let by_shape = own.as_ref().map_or(0.0, |(index, adjoint)| {
                    by_parameter(posterior_model, values, (*index, postures), adjoint, parameter)
                });
                let by = by_shape + auxiliary.slope(values, &weights, parameter);
                jacobian[(of_muscles + row, p)] = slopes[p] * by;
            }
        }
        let point =
            GeometrySensitivity { solved, values, rates, auxiliary: &self.density.measurements.auxiliary };
        let geometry = match (geometry, posterior_model.is_of_springs()) {
            (true, true) => rest_shape::of_springs(posterior_model, &point)?,
            (true, false) => finite_differences::answers(posterior_model, &point)?,
            (false, _) => FiniteDifferences::none(computed.len()),
        };
        Some(LinearisationPoint { computed, jacobian, geometry })
    }

    /// Derivatives of the logarithm of the density by the scores, from the adjoints of all shapes and the weights of the auxiliary data.
    fn gradient(
        &self,
        scores: &DVector<f64>,
        (values, slopes): &(ParameterValues, Vec<f64>),
        (adjoints, weights): (&[&Adjoint<2>], &[f64]),
    ) -> DVector<f64> {
        let density = self.density;
        DVector::from_fn(scores.len(), |i, _| {
            let p = density.parameters[i];
            let each = adjoints.iter().enumerate().map(|(index, adjoint)| {
                by_parameter(density.posterior_model, values, (index, density.postures()), adjoint, p)
            });
            let auxiliary = density
                .measurements
                .split_weights(weights)
                .map(|(auxiliary, w)| auxiliary.slope(values, w, p));
            slopes[i] * (each.sum::<f64>() + auxiliary.sum::<f64>()) - scores[i]
        })
    }
}

/// Derivative of a function of one shape by a parameter; `index` is the number of a posture, or `postures` for the baseline.
fn by_parameter(
    posterior_model: &super::PosteriorModel,
    values: &ParameterValues,
    (index, postures): (usize, usize),
    adjoint: &Adjoint<2>,
    parameter: Parameter,
) -> f64 {
    let by_hyoid = |which: usize| match values.postures.get(index) {
        Some(own) => posterior_model.hyoid_rates(adjoint, own.hyoid, values.tilt)[which],
        None => 0.0,
    };
    match parameter {
        Parameter::Tension(posture, m) if posture == index => adjoint.by_tension[m],
        Parameter::Tone(m) if index == postures => adjoint.by_tension[m],
        Parameter::Hyoid(posture, axis) if posture == index => by_hyoid(axis),
        Parameter::Tilt => by_hyoid(2),
        _ => 0.0,
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
                        _ if index == postures => -solved.lengths[density.rows()[i]] / (over * over),
                        posture if posture == index => 1.0 / over,
                        _ => continue,
                    };
                    length_gradient(system, solved.shape(index).0, m, weights[i] * part, &mut gradient);
                }
                let at = ((index < postures).then_some(index), solved.shape(index).0);
                for (auxiliary, weights) in
                    measurements.split_weights(&weights.as_slice()[measurements.len()..])
                {
                    auxiliary.gradient(at, weights, &mut gradient);
                }
                gradient
            })))
        });
        let adjoints: Vec<Vec<Option<Adjoint<2>>>> = adjoints.collect();
        let mut out = Vec::with_capacity(points.len());
        for (i, (solved, weighed)) in solved.into_iter().zip(weighed).enumerate() {
            let own: Option<Vec<&Adjoint<2>>> = adjoints.iter().map(|a| a[i].as_ref()).collect();
            out.push(solved.zip(weighed).zip(own).map(|((solved, (log, weights)), own)| {
                let auxiliary = &weights.as_slice()[measurements.len()..];
                let gradient = self.gradient(points[i].0, &values[i], (&own, auxiliary));
                DensityPoint { log: log - 0.5 * points[i].0.norm_squared(), gradient, solved }
            }));
        }
        out
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
        let found = self.from_rest.iter_mut().enumerate().map(|(index, group)| {
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
