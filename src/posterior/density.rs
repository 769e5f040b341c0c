//! The density: how probable tensions, tones and a place of the hyoid are, given the measured stretches.
//!
//! ```text
//! y ~ N(s, C),  s = L(F, d) / L(F0, 0),  C = C_geo + sd² I + R
//! F = scale Z((1 + Phi(g))/2) with g ~ N(0, 1) (half-normal), F0 likewise, d = sd g
//! ```
//! All that is sampled is in the scores `g`, so that there are no bounds. The derivatives need one back-substitution for the vowel and one
//! for the baseline, however many unknowns there are.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector};

use crate::inverse::Matched;
use crate::statics::lanes::{Adjoint, Equilibrium, Group, Lanes, Load, length_gradient};
use crate::statics::{Settings, Status};
use crate::track::scores;

use super::PosteriorError;
use super::branch::on_branch;
use super::differences::{self, Answers};
use super::ground::Ground;
use super::hmc::{Point, Target};
use super::shape::of_springs;

/// The stretches that were measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Names of their muscles.
    pub names: Vec<String>,
    /// Numbers of the muscles in the body.
    pub muscles: Vec<usize>,
    /// Measured stretches.
    pub stretches: Vec<f64>,
    /// Variances by the rounding of both lengths.
    pub rounding: Vec<f64>,
}

impl Seen {
    /// All that was measured in both vowels: `m/b` of lengths of half widths `h`, whose variance by rounding is
    /// `(h_m²/b² + h_b² m²/b⁴)/3`.
    pub fn of(matched: &Matched) -> Self {
        let target = &matched.target;
        let each = |m: usize| {
            let (length, over) = (target.measured_mm[m], target.baseline_mm[m]);
            let (half, half_over) = (target.half_width_mm[m], target.baseline_half_width_mm[m]);
            let variance = ((half / over).powi(2) + (half_over * length / (over * over)).powi(2)) / 3.0;
            (length / over, variance)
        };
        let (stretches, rounding) = (0..target.muscles.len()).map(each).unzip();
        let muscles = matched.numbers[..target.muscles.len()].to_vec();
        Self { names: target.muscles.clone(), muscles, stretches, rounding }
    }

    /// Without the muscle at a position.
    pub fn without(&self, position: usize) -> Self {
        let mut seen = self.clone();
        seen.names.remove(position);
        seen.muscles.remove(position);
        seen.stretches.remove(position);
        seen.rounding.remove(position);
        seen
    }
}

/// A number that is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Tension of a muscle in the vowel.
    Tension(usize),
    /// Tension of a muscle in the baseline.
    Tone(usize),
    /// Displacement of the hyoid along an axis.
    Hyoid(usize),
}

/// What a point of the scores means.
#[derive(Debug, Clone, PartialEq)]
pub struct Meaning {
    /// Tensions in the vowel, N per metre of thickness.
    pub tensions: Vec<f64>,
    /// In the baseline.
    pub tones: Vec<f64>,
    /// Displacement of the hyoid, m.
    pub hyoid: SVector<f64, 2>,
}

/// Where a point was solved: what its neighbours begin at.
#[derive(Debug, Clone)]
pub struct Place {
    /// Positions of all nodes in the vowel, m.
    pub posture: Arc<Vec<SVector<f64, 2>>>,
    /// In the baseline.
    pub baseline: Arc<Vec<SVector<f64, 2>>>,
    /// Lengths of all muscles of the body in the vowel, m.
    pub lengths: Vec<f64>,
    /// In the baseline.
    pub baseline_lengths: Vec<f64>,
}

/// How the stretches of all muscles of the body answer at a point.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Stretches of all muscles of the body.
    pub stretches: DVector<f64>,
    /// By the scores: a row a muscle.
    pub jacobian: DMatrix<f64>,
    /// By the sources of geometry and constants, each by one standard deviation; a row a muscle.
    pub ends: DMatrix<f64>,
    /// The outline.
    pub outline: DMatrix<f64>,
    /// Kappa.
    pub kappa: DMatrix<f64>,
    /// The width of muscles.
    pub width: DMatrix<f64>,
    /// The patches of bones.
    pub patch: DMatrix<f64>,
}

/// The density of a set of measured stretches.
#[derive(Debug)]
pub struct Density<'a> {
    /// The body.
    pub ground: &'a Ground,
    /// What was measured.
    pub seen: Seen,
    /// What is sampled.
    pub parameters: Vec<Parameter>,
    lanes: Lanes<'a, 2>,
    fixed: Meaning,
    /// Covariance of the stretches of all muscles of the body by geometry and constants; zero at first.
    pub geometry: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
}

/// How exactly is solved: to forces that cancel as for any fit. No load steps: what a direct solve does not reach has no density.
const SOLVE: Settings =
    Settings { tolerance: 1e-9, max_iterations: 60, load_steps: 0, certify: false, most_solves: 1 };

impl<'a> Density<'a> {
    /// With no covariance of geometry yet.
    ///
    /// # Errors
    /// [`PosteriorError::Body`] where the body has no hyoid to displace.
    pub fn new(ground: &'a Ground, seen: Seen) -> Result<Self, PosteriorError> {
        let (priors, count) = (&ground.priors, ground.muscles.len());
        let mut parameters = Vec::new();
        let mut fixed =
            Meaning { tensions: vec![0.0; count], tones: vec![0.0; count], hyoid: SVector::zeros() };
        for (m, name) in ground.muscles.iter().enumerate() {
            match priors.fixed_tension(name) {
                Some(value) => fixed.tensions[m] = value,
                None => parameters.push(Parameter::Tension(m)),
            }
        }
        for (m, name) in ground.muscles.iter().enumerate() {
            match priors.fixed_tone(name) {
                Some(value) => fixed.tones[m] = value,
                None => parameters.push(Parameter::Tone(m)),
            }
        }
        match (priors.hyoid.off, priors.hyoid.fixed_mm) {
            (true, _) => {}
            (false, Some(mm)) => fixed.hyoid = SVector::from(mm) * 1e-3,
            (false, None) => parameters.extend([Parameter::Hyoid(0), Parameter::Hyoid(1)]),
        }
        let moves = !priors.hyoid.off;
        if moves && ground.hyoid.is_empty() {
            return Err(PosteriorError::Body(
                "this body names no bone \"hyoid\"; name it, or switch it off in the priors ([hyoid] off = true)"
                    .to_owned(),
            ));
        }
        let factor = Cholesky::new(DMatrix::identity(1, 1)).ok_or(PosteriorError::Covariance)?;
        let lanes = Lanes::new(&ground.system);
        let geometry = DMatrix::zeros(count, count);
        let mut density = Self { ground, seen, parameters, lanes, fixed, geometry, factor };
        density.set_geometry(DMatrix::zeros(count, count))?;
        Ok(density)
    }

    /// The same of other stretches.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`].
    pub fn of(&self, seen: Seen) -> Result<Self, PosteriorError> {
        let lanes = Lanes::new(&self.ground.system);
        let (parameters, fixed) = (self.parameters.clone(), self.fixed.clone());
        let (geometry, factor) = (self.geometry.clone(), self.factor.clone());
        let mut other = Self { ground: self.ground, seen, parameters, lanes, fixed, geometry, factor };
        other.set_geometry(self.geometry.clone())?;
        Ok(other)
    }

    /// Takes a covariance by geometry and constants, of all muscles of the body.
    ///
    /// # Errors
    /// [`PosteriorError::Covariance`] where what comes out is not positive definite.
    pub fn set_geometry(&mut self, geometry: DMatrix<f64>) -> Result<(), PosteriorError> {
        self.geometry = geometry;
        self.factor = Cholesky::new(self.covariance()).ok_or(PosteriorError::Covariance)?;
        Ok(())
    }

    /// Covariance of the measured stretches about the computed ones.
    pub fn covariance(&self) -> DMatrix<f64> {
        let own = self.own_variances();
        let mut all = self.geometry.select_rows(&self.seen.muscles).select_columns(&self.seen.muscles);
        own.iter().enumerate().for_each(|(i, v)| all[(i, i)] += v);
        all
    }

    /// Variances of the measured stretches by discrepancy and rounding.
    fn own_variances(&self) -> Vec<f64> {
        self.seen.rounding.iter().map(|r| self.discrepancy() + self.rounding(*r)).collect()
    }

    /// Variance of a stretch by the model's error.
    pub fn discrepancy(&self) -> f64 {
        let prior = &self.ground.priors.discrepancy;
        if prior.off { 0.0 } else { prior.sd * prior.sd }
    }

    /// Variance of a stretch by rounding, given what it would be if it counted.
    pub fn rounding(&self, variance: f64) -> f64 {
        if self.ground.priors.rounding.off { 0.0 } else { variance }
    }

    /// The factor of [`Density::covariance`].
    pub fn factor(&self) -> &Cholesky<f64, Dyn> {
        &self.factor
    }

    /// What scores mean, and the derivative of each number by its score.
    pub fn meaning(&self, scores: &DVector<f64>) -> (Meaning, Vec<f64>) {
        let priors = &self.ground.priors;
        let mut meaning = self.fixed.clone();
        let each = self.parameters.iter().zip(scores.iter()).map(|(p, &g)| {
            let half_normal = |scale: f64| {
                let (value, slope) = scores::tension(g);
                (scale * value, scale * slope)
            };
            match *p {
                Parameter::Tension(m) => {
                    let (value, slope) = half_normal(priors.tension.scale_n_per_m);
                    meaning.tensions[m] = value;
                    slope
                }
                Parameter::Tone(m) => {
                    let (value, slope) = half_normal(priors.baseline.scale_n_per_m);
                    meaning.tones[m] = value;
                    slope
                }
                Parameter::Hyoid(axis) => {
                    let sd = 1e-3 * priors.hyoid.sd_mm;
                    meaning.hyoid[axis] = sd * g;
                    sd
                }
            }
        });
        let slopes = each.collect();
        (meaning, slopes)
    }

    /// The place from which the first point begins: rest.
    pub fn rest(&self) -> Place {
        let rest = Arc::new(self.ground.system.rest().to_vec());
        let lengths = self.ground.system.lengths(self.ground.system.rest());
        Place { posture: Arc::clone(&rest), baseline: rest, baseline_lengths: lengths.clone(), lengths }
    }

    /// The load of a vowel, begun from given positions.
    pub fn posture<'l>(&'l self, meaning: &Meaning, start: Option<&'l [SVector<f64, 2>]>) -> Load<'l, 2> {
        let mut load = Load { start, ..Load::new(meaning.tensions.clone()) };
        if !self.ground.hyoid.is_empty() && !self.ground.priors.hyoid.off {
            load = load.with_bone(&self.ground.hyoid, meaning.hyoid);
        }
        load
    }

    /// The load of the baseline.
    pub fn baseline<'l>(&'l self, meaning: &Meaning, start: Option<&'l [SVector<f64, 2>]>) -> Load<'l, 2> {
        Load { start, ..Load::new(meaning.tones.clone()) }
    }

    /// What evaluates it, one a thread.
    pub fn evaluator(&self) -> Evaluator<'_> {
        let group = || self.lanes.group();
        Evaluator { density: self, posture: group(), baseline: group(), from_rest: group() }
    }

    /// The lanes in which it is solved.
    pub fn lanes(&self) -> &Lanes<'a, 2> {
        &self.lanes
    }

    /// How each equilibrium is solved.
    pub fn settings(&self) -> &'static Settings {
        &SOLVE
    }

    /// Residuals of the measured stretches at given lengths of all muscles of the body.
    pub fn residuals(&self, lengths: &[f64], baseline: &[f64]) -> DVector<f64> {
        let seen = &self.seen;
        DVector::from_fn(seen.muscles.len(), |i, _| {
            let m = seen.muscles[i];
            seen.stretches[i] - lengths[m] / baseline[m]
        })
    }
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

/// Whether an equilibrium is one that the density knows.
pub fn is_found(shape: &Equilibrium<2>) -> bool {
    shape.solution.status == Status::Converged && shape.solution.guarded == 0
}

impl Evaluator<'_> {
    /// Solves points, each begun at a place; what they mean, and `None` where the density is zero.
    fn solve(&mut self, points: &[(&DVector<f64>, &Place)]) -> Solved {
        let density = self.density;
        let meanings: Vec<_> = points.iter().map(|(g, _)| density.meaning(g)).collect();
        let each = || meanings.iter().zip(points);
        let postures: Vec<_> = each().map(|((m, _), (_, p))| density.posture(m, Some(&p.posture))).collect();
        let baselines: Vec<_> =
            each().map(|((m, _), (_, p))| density.baseline(m, Some(&p.baseline))).collect();
        self.posture.solve(&postures, &SOLVE);
        self.baseline.solve(&baselines, &SOLVE);
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
                let linear = self.density.linear(&meanings[i], &place, (posture, baseline), geometry)?;
                Some((linear, place))
            }));
        }
        out
    }
}

impl Density<'_> {
    /// How all stretches answer at a solved point, of which the adjoints of all lengths are known.
    fn linear(
        &self,
        (meaning, slopes): &(Meaning, Vec<f64>),
        place: &Place,
        (posture, baseline): (&[Adjoint<2>], &[Adjoint<2>]),
        geometry: bool,
    ) -> Option<Linear> {
        let ground = self.ground;
        let count = ground.muscles.len();
        let stretches = DVector::from_fn(count, |m, _| place.lengths[m] / place.baseline_lengths[m]);
        // d(L/L0) = dL/L0 - s dL0/L0.
        let parts = |m: usize| (1.0 / place.baseline_lengths[m], -stretches[m] / place.baseline_lengths[m]);
        let jacobian = DMatrix::from_fn(count, slopes.len(), |m, p| {
            let (own, over) = parts(m);
            slopes[p]
                * match self.parameters[p] {
                    Parameter::Tension(n) => own * posture[m].by_tension[n],
                    Parameter::Tone(n) => over * baseline[m].by_tension[n],
                    Parameter::Hyoid(axis) => own * posture[m].by_bone(&ground.hyoid)[axis],
                }
        });
        let Answers { ends, outline, kappa, width, patch } = match (ground.is_of_springs(), geometry) {
            (true, _) => of_springs(ground, place, posture, baseline),
            (false, true) => differences::answers(
                ground,
                place,
                (&place.posture, &meaning.tensions, posture),
                (&place.baseline, &meaning.tones, baseline),
            )?,
            (false, false) => Answers::none(count),
        };
        Some(Linear { stretches, jacobian, ends, outline, kappa, width, patch })
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
                let weights = density.factor.solve(&residuals);
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
