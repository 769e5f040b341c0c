//! Evaluates a density, as many points at once as there are lanes: its logarithm with the exact gradient, by which is sampled, and how all
//! stretches answer.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::statics::lanes::{Adjoint, Equilibrium, Group, length_gradient};

use super::branch::on_branch;
use super::density::{Density, Meaning, Parameter, Place, is_found};
use super::differences::{self, Answers};
use super::hmc::{Point, Target};
use super::shape::of_springs;

/// How the stretches of all muscles of the body answer at a point.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Stretches of all muscles of the body.
    pub stretches: DVector<f64>,
    /// By the scores: a row a muscle.
    pub jacobian: DMatrix<f64>,
    /// By the sources of geometry and constants.
    pub geometry: Answers,
}

/// Solves and differentiates points of a density, up to as many as there are lanes at once.
#[derive(Debug)]
pub struct Evaluator<'a> {
    density: &'a Density<'a>,
    posture: Group<'a, 2>,
    baseline: Group<'a, 2>,
    /// Follows shapes from rest.
    from_rest: Group<'a, 2>,
}

/// What scores mean with their slopes, and where they were solved.
type Solved = (Vec<(Meaning, Vec<f64>)>, Vec<Option<Place>>);

impl<'a> Evaluator<'a> {
    /// One a thread.
    pub fn new(density: &'a Density<'_>) -> Self {
        let group = || density.lanes().group();
        Self { density, posture: group(), baseline: group(), from_rest: group() }
    }

    /// Solves points, each begun at a place; what they mean, and `None` where the density is zero.
    fn solve(&mut self, points: &[(&DVector<f64>, &Place)]) -> Solved {
        let density = self.density;
        let meanings: Vec<_> = points.iter().map(|(g, _)| density.meaning(g)).collect();
        let each = || meanings.iter().zip(points);
        let postures: Vec<_> = each().map(|((m, _), (_, p))| density.posture(m, Some(&p.posture))).collect();
        let baselines: Vec<_> =
            each().map(|((m, _), (_, p))| density.baseline(m, Some(&p.baseline))).collect();
        self.posture.solve(&postures, density.settings());
        self.baseline.solve(&baselines, density.settings());
        let system = &density.ground.system;
        let place = |(posture, baseline): (&Equilibrium<2>, &Equilibrium<2>)| {
            (is_found(posture) && is_found(baseline)).then(|| Place {
                lengths: system.lengths(&posture.positions),
                baseline_lengths: system.lengths(&baseline.positions),
                posture: Arc::new(posture.positions.clone()),
                baseline: Arc::new(baseline.positions.clone()),
            })
        };
        let places = self.posture.answers().iter().zip(self.baseline.answers()).map(place).collect();
        (meanings, places)
    }

    /// How all stretches answer at a point; `None` where the density is zero.
    pub fn linearise(&mut self, scores: &DVector<f64>, begin: &Place) -> Option<(Linear, Place)> {
        self.linearise_all(&[(scores, begin)], true).pop()?
    }

    /// The same at points, up to as many as there are lanes; of bodies whose answers to their geometry cost more than all else, without these
    /// where they are not wanted.
    pub(super) fn linearise_all(
        &mut self,
        points: &[(&DVector<f64>, &Place)],
        geometry: bool,
    ) -> Vec<Option<(Linear, Place)>> {
        let (meanings, places) = self.solve(points);
        let (postures, baselines) = (self.posture.length_rates(), self.baseline.length_rates());
        let mut out = Vec::with_capacity(points.len());
        for (i, place) in places.into_iter().enumerate() {
            let solved = place.zip(postures[i].as_ref().zip(baselines[i].as_ref()));
            out.push(solved.and_then(|(place, (posture, baseline))| {
                let linear = self.linear(&meanings[i], &place, (posture, baseline), geometry)?;
                Some((linear, place))
            }));
        }
        out
    }

    /// How all stretches answer at a solved point, of which the adjoints of all lengths are known.
    fn linear(
        &self,
        (meaning, slopes): &(Meaning, Vec<f64>),
        place: &Place,
        (posture, baseline): (&[Adjoint<2>], &[Adjoint<2>]),
        geometry: bool,
    ) -> Option<Linear> {
        let ground = self.density.ground;
        let count = ground.muscles.len();
        let stretches = DVector::from_fn(count, |m, _| place.lengths[m] / place.baseline_lengths[m]);
        // d(L/L0) = dL/L0 - s dL0/L0.
        let parts = |m: usize| (1.0 / place.baseline_lengths[m], -stretches[m] / place.baseline_lengths[m]);
        let jacobian = DMatrix::from_fn(count, slopes.len(), |m, p| {
            let (own, over) = parts(m);
            slopes[p]
                * match self.density.parameters[p] {
                    Parameter::Tension(n) => own * posture[m].by_tension[n],
                    Parameter::Tone(n) => over * baseline[m].by_tension[n],
                    Parameter::Hyoid(axis) => own * posture[m].by_bone(&ground.hyoid)[axis],
                }
        });
        let geometry = match (ground.is_of_springs(), geometry) {
            (true, _) => of_springs(ground, place, posture, baseline),
            (false, true) => differences::answers(
                ground,
                place,
                (&place.posture, &meaning.tensions, posture),
                (&place.baseline, &meaning.tones, baseline),
            )?,
            (false, false) => Answers::none(count),
        };
        Some(Linear { stretches, jacobian, geometry })
    }
}

impl Target for Evaluator<'_> {
    type Place = Place;

    fn evaluate(&mut self, points: &[(&DVector<f64>, &Place)]) -> Vec<Option<Point<Place>>> {
        let (meanings, places) = self.solve(points);
        let (density, system) = (self.density, &self.density.ground.system);
        let seen = &density.seen;
        let nodes = system.rest().len();
        // Of every point its residuals, and the weights with which they pull at the stretches.
        let weighed: Vec<Option<(f64, DVector<f64>)>> = places
            .iter()
            .map(|place| {
                let place = place.as_ref()?;
                let residuals = density.residuals(&place.lengths, &place.baseline_lengths);
                let weights = density.factor().solve(&residuals);
                Some((-0.5 * residuals.dot(&weights), weights))
            })
            .collect();
        let gradients = |positions: fn(&Place) -> &[SVector<f64, 2>], part: &dyn Fn(&Place, usize) -> f64| {
            let of = |(place, weighed): (&Option<Place>, &Option<(f64, DVector<f64>)>)| {
                let mut gradient = vec![SVector::zeros(); nodes];
                if let (Some(place), Some((_, weights))) = (place, weighed) {
                    for (i, &m) in seen.muscles.iter().enumerate() {
                        length_gradient(
                            system,
                            positions(place),
                            m,
                            weights[i] * part(place, m),
                            &mut gradient,
                        );
                    }
                }
                gradient
            };
            places.iter().zip(&weighed).map(of).collect::<Vec<_>>()
        };
        let of_posture = gradients(|p| &p.posture, &|p, m| 1.0 / p.baseline_lengths[m]);
        let of_baseline = gradients(|p| &p.baseline, &|p, m| -p.lengths[m] / p.baseline_lengths[m].powi(2));
        let postures = self.posture.adjoint(&of_posture);
        let baselines = self.baseline.adjoint(&of_baseline);
        let mut out = Vec::with_capacity(points.len());
        for (i, (place, weighed)) in places.into_iter().zip(weighed).enumerate() {
            let (scores, slopes) = (points[i].0, &meanings[i].1);
            let found = place.zip(weighed).zip(postures[i].as_ref().zip(baselines[i].as_ref()));
            out.push(found.map(|((place, (log, _)), (posture, baseline))| {
                let by = |p: usize| match density.parameters[p] {
                    Parameter::Tension(m) => posture.by_tension[m],
                    Parameter::Tone(m) => baseline.by_tension[m],
                    Parameter::Hyoid(axis) => posture.by_bone(&density.ground.hyoid)[axis],
                };
                let gradient = DVector::from_fn(scores.len(), |p, _| slopes[p] * by(p) - scores[p]);
                Point { log: log - 0.5 * scores.norm_squared(), gradient, place }
            }));
        }
        out
    }

    /// Where both shapes, of the vowel and of the baseline, are where their tensions lead from rest.
    fn allowed(&mut self, points: &[(&DVector<f64>, &Point<Place>)]) -> Vec<bool> {
        let density = self.density;
        let meanings: Vec<Meaning> = points.iter().map(|(g, _)| density.meaning(g).0).collect();
        let with = |lengths: fn(&Place) -> &[f64]| -> Vec<(&Meaning, &[f64])> {
            meanings.iter().zip(points).map(|(m, (_, p))| (m, lengths(&p.place))).collect()
        };
        let group = &mut self.from_rest;
        let postures = on_branch(density, group, &with(|p| &p.lengths), &|m, s| density.posture(m, s));
        let bases = on_branch(density, group, &with(|p| &p.baseline_lengths), &|m, s| density.baseline(m, s));
        postures.into_iter().zip(bases).map(|(a, b)| a && b).collect()
    }

    /// Tensions, tones, hyoid, lengths, lengths in the baseline, logarithm of the density.
    fn keep(&self, at: &DVector<f64>, point: &Point<Place>) -> Vec<f64> {
        let (meaning, _) = self.density.meaning(at);
        let Place { lengths, baseline_lengths, .. } = &point.place;
        let parts: [&[f64]; 6] = [
            &meaning.tensions,
            &meaning.tones,
            meaning.hyoid.as_slice(),
            lengths,
            baseline_lengths,
            &[point.log],
        ];
        parts.concat()
    }
}
