//! Evaluates a density, as many points at once as there are lanes: its logarithm with the exact gradient, by which is sampled, and how all
//! stretches answer.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::statics::lanes::{Adjoint, Equilibrium, Group, length_gradient};

use super::branch::on_branch;
use super::density::{Density, Meaning, Parameter, Place, is_found};
use super::differences::{self, Answers};
use super::hmc::{Point, Target};
use super::run::Draw;
use super::shape;

/// How probable residuals of the measured stretches are.
pub trait Errors: Sync {
    /// The logarithm of their density up to a constant, and minus its derivatives by the residuals.
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>);
}

impl Errors for Density<'_> {
    fn log(&self, residuals: &DVector<f64>) -> (f64, DVector<f64>) {
        let pulls = self.factor().solve(residuals);
        (-0.5 * residuals.dot(&pulls), pulls)
    }
}

/// How the stretches of all muscles of the body in all postures answer at a point.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Stretches of all muscles of the body in the first posture, then in the second one, and so on.
    pub stretches: DVector<f64>,
    /// By the scores: a row a stretch.
    pub jacobian: DMatrix<f64>,
    /// By the sources of geometry and constants.
    pub geometry: Answers,
}

/// Solves and differentiates points of a density, up to as many as there are lanes at once.
pub struct Evaluator<'a> {
    density: &'a Density<'a>,
    errors: &'a dyn Errors,
    /// One for each posture, and the last for the baseline.
    shapes: Vec<Group<'a, 2>>,
    /// Follows shapes from rest.
    from_rest: Vec<Group<'a, 2>>,
}

/// Meanings and derivatives of the points, and where they were solved.
type Solved = (Vec<(Meaning, Vec<f64>)>, Vec<Option<Place>>);

/// For one shape: the adjoints of all lengths at each point.
type Rates = Vec<Option<Vec<Adjoint<2>>>>;

impl<'a> Evaluator<'a> {
    /// One a thread.
    pub fn new(density: &'a Density<'_>) -> Self {
        Self::with(density, density)
    }

    /// The same with another likelihood of the residuals.
    pub fn with(density: &'a Density<'_>, errors: &'a dyn Errors) -> Self {
        let groups = || (0..=density.postures()).map(|_| density.lanes().group()).collect();
        Self { density, errors, shapes: groups(), from_rest: groups() }
    }

    /// Solves points, each begun at a place; what they mean, and `None` where the density is zero.
    fn solve(&mut self, points: &[(&DVector<f64>, &Place)]) -> Solved {
        let density = self.density;
        let meanings: Vec<_> = points.iter().map(|(g, _)| density.meaning(g)).collect();
        for (shape, group) in self.shapes.iter_mut().enumerate() {
            let load =
                |i: usize| density.ground.load(&meanings[i].0, shape, Some(points[i].1.shape(shape).0));
            let loads: Vec<_> = (0..points.len()).map(load).collect();
            group.solve(&loads, density.settings());
        }
        let system = &density.ground.system;
        let place = |point: usize| {
            let mut found: Vec<&Equilibrium<2>> =
                self.shapes.iter().map(|group| &group.answers()[point]).collect();
            if !found.iter().all(|shape| is_found(shape)) {
                return None;
            }
            let baseline = found.pop()?;
            Some(Place {
                lengths: found.iter().flat_map(|shape| system.lengths(&shape.positions)).collect(),
                baseline_lengths: system.lengths(&baseline.positions),
                postures: found.iter().map(|shape| Arc::new(shape.positions.clone())).collect(),
                baseline: Arc::new(baseline.positions.clone()),
            })
        };
        let places = (0..points.len()).map(place).collect();
        (meanings, places)
    }

    /// How all stretches answer at a point; `None` where the density is zero.
    pub fn linearise(&mut self, scores: &DVector<f64>, begin: &Place) -> Option<(Linear, Place)> {
        self.linearise_all(&[(scores, begin)], true).pop()?
    }

    /// The same at points, up to as many as there are lanes; without the answers to geometry where these are not wanted, which cost more than
    /// all else.
    pub(super) fn linearise_all(
        &mut self,
        points: &[(&DVector<f64>, &Place)],
        geometry: bool,
    ) -> Vec<Option<(Linear, Place)>> {
        let (meanings, places) = self.solve(points);
        let mut rates: Vec<Rates> = self.shapes.iter_mut().map(Group::length_rates).collect();
        let mut out = Vec::with_capacity(points.len());
        for (i, place) in places.into_iter().enumerate() {
            let own: Option<Vec<Vec<Adjoint<2>>>> = rates.iter_mut().map(|r| r[i].take()).collect();
            out.push(place.zip(own).and_then(|(place, rates)| {
                let linear = self.linear(&meanings[i], &place, &rates, geometry)?;
                Some((linear, place))
            }));
        }
        out
    }

    /// How all stretches answer at a solved point, of which the adjoints of all lengths are known, shape by shape.
    fn linear(
        &self,
        (meaning, slopes): &(Meaning, Vec<f64>),
        place: &Place,
        rates: &[Vec<Adjoint<2>>],
        geometry: bool,
    ) -> Option<Linear> {
        let ground = self.density.ground;
        let (count, postures) = (ground.muscles.len(), self.density.postures());
        let over = &place.baseline_lengths;
        let stretches = DVector::from_fn(postures * count, |row, _| place.lengths[row] / over[row % count]);
        let length = |shape: usize, m: usize, p: Parameter| -> f64 {
            by_parameter(ground, meaning, (shape, postures), &rates[shape][m], p)
        };
        // d(L/L0) = dL/L0 - s dL0/L0.
        let jacobian = DMatrix::from_fn(postures * count, slopes.len(), |row, p| {
            let (posture, m, parameter) = (row / count, row % count, self.density.parameters[p]);
            let (own, base) = (length(posture, m, parameter), length(postures, m, parameter));
            slopes[p] * (own - stretches[row] * base) / over[m]
        });
        let geometry = match (geometry, ground.is_of_springs()) {
            (true, true) => shape::of_springs(ground, place, meaning, rates)?,
            (true, false) => differences::answers(ground, place, meaning, rates)?,
            (false, _) => Answers::none(postures * count),
        };
        Some(Linear { stretches, jacobian, geometry })
    }

    /// The derivatives of the logarithm of the density by the scores, given those of the shapes.
    fn gradient(
        &self,
        scores: &DVector<f64>,
        (meaning, slopes): &(Meaning, Vec<f64>),
        adjoints: &[&Adjoint<2>],
    ) -> DVector<f64> {
        let density = self.density;
        let by = |p: Parameter| -> f64 {
            let each = adjoints.iter().enumerate().map(|(shape, adjoint)| {
                by_parameter(density.ground, meaning, (shape, density.postures()), adjoint, p)
            });
            each.sum()
        };
        DVector::from_fn(scores.len(), |p, _| slopes[p] * by(density.parameters[p]) - scores[p])
    }
}

/// How a function of one shape, `shape` of so many postures or the baseline, answers to a number that is sampled.
fn by_parameter(
    ground: &super::Ground,
    meaning: &Meaning,
    (shape, postures): (usize, usize),
    adjoint: &Adjoint<2>,
    parameter: Parameter,
) -> f64 {
    let of_posture = |posture: usize| posture == shape;
    let by_hyoid = |which: usize| match meaning.postures.get(shape) {
        Some(own) => ground.hyoid_rates(adjoint, own.hyoid, meaning.tilt)[which],
        None => 0.0,
    };
    match parameter {
        Parameter::Tension(posture, m) if of_posture(posture) => adjoint.by_tension[m],
        Parameter::Tone(m) if shape == postures => adjoint.by_tension[m],
        Parameter::Hyoid(posture, axis) if of_posture(posture) => by_hyoid(axis),
        Parameter::Tilt => by_hyoid(2),
        _ => 0.0,
    }
}

impl Target for Evaluator<'_> {
    type Place = Place;
    type Kept = Draw;

    fn evaluate(&mut self, points: &[(&DVector<f64>, &Place)]) -> Vec<Option<Point<Place>>> {
        let (meanings, places) = self.solve(points);
        let (density, errors) = (self.density, self.errors);
        let (seen, system) = (&density.seen, &density.ground.system);
        let (nodes, postures) = (system.rest().len(), density.postures());
        // Of every point the logarithm, and the weights with which its residuals pull at the stretches.
        let weighed: Vec<Option<(f64, DVector<f64>)>> = places
            .iter()
            .map(|place| {
                let place = place.as_ref()?;
                Some(errors.log(&density.residuals(&place.lengths, &place.baseline_lengths)))
            })
            .collect();
        let adjoints = self.shapes.iter_mut().enumerate().map(|(shape, group)| {
            let of = |(place, weighed): (&Option<Place>, &Option<(f64, DVector<f64>)>)| {
                let mut gradient = vec![SVector::zeros(); nodes];
                let Some((place, (_, weights))) = place.as_ref().zip(weighed.as_ref()) else {
                    return gradient;
                };
                for (i, &m) in seen.muscles.iter().enumerate() {
                    let over = place.baseline_lengths[m];
                    let part = match seen.postures[i] {
                        _ if shape == postures => -place.lengths[density.rows()[i]] / (over * over),
                        posture if posture == shape => 1.0 / over,
                        _ => continue,
                    };
                    length_gradient(system, place.shape(shape).0, m, weights[i] * part, &mut gradient);
                }
                gradient
            };
            group.adjoint(&places.iter().zip(&weighed).map(of).collect::<Vec<_>>())
        });
        let adjoints: Vec<Vec<Option<Adjoint<2>>>> = adjoints.collect();
        let mut out = Vec::with_capacity(points.len());
        for (i, (place, weighed)) in places.into_iter().zip(weighed).enumerate() {
            let own: Option<Vec<&Adjoint<2>>> = adjoints.iter().map(|a| a[i].as_ref()).collect();
            out.push(place.zip(weighed).zip(own).map(|((place, (log, _)), own)| {
                let gradient = self.gradient(points[i].0, &meanings[i], &own);
                Point { log: log - 0.5 * points[i].0.norm_squared(), gradient, place }
            }));
        }
        out
    }

    /// Whether the tensions of each point lead from rest to its shapes, those of the postures and that of the baseline.
    fn allowed(&mut self, points: &[(&DVector<f64>, &Point<Place>)]) -> Vec<bool> {
        let density = self.density;
        let meanings: Vec<Meaning> = points.iter().map(|(g, _)| density.meaning(g).0).collect();
        let found = self.from_rest.iter_mut().enumerate().map(|(shape, group)| {
            let with: Vec<(&Meaning, &[f64])> =
                meanings.iter().zip(points).map(|(m, (_, p))| (m, p.place.shape(shape).1)).collect();
            on_branch(density, group, &with, shape)
        });
        let found: Vec<Vec<bool>> = found.collect();
        (0..points.len()).map(|i| found.iter().all(|shape| shape[i])).collect()
    }

    fn keep(&self, at: &DVector<f64>, point: &Point<Place>) -> Draw {
        let (meaning, _) = self.density.meaning(at);
        let Place { lengths, baseline_lengths, .. } = &point.place;
        Draw {
            chain: 0,
            number: 0,
            meaning,
            lengths: lengths.clone(),
            baseline_lengths: baseline_lengths.clone(),
            log: point.log,
            log_likelihood: point.log + 0.5 * at.norm_squared(),
        }
    }
}
