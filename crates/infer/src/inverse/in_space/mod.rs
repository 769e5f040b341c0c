//! Activations of a body in space from marks (places of nodes and coils, points of the surface and the midsagittal contour, lengths of
//! muscles), by the same search as every other inverse problem.
//!
//! Residuals are in standard deviations of the marks, activations in hundredths. A weak prior with mean 0 determines the combinations of
//! activations that the data leave open, which the answer lists ([`Combination`]).

mod intervals;
mod observations;
mod recorded;

use nalgebra::DVector;
use serde::Serialize;
use tongue_core::body::Body;
use tongue_core::body::space::{Half, Side};
use tongue_core::system::System;

use self::intervals::LinearResponse;
use self::observations::{Observed, on_half};
pub use self::recorded::Recorded;
use super::forward::Forward;
use super::problem::LeastSquaresProblem;
use super::projection::decompose;
use super::{Answer, FitError, FitSettings, Method, Unknown, refused, solve};
use crate::posterior::Priors;
use crate::standard_deviations::ACTIVATION;
use tongue_input::measured::{ByMuscle, SpaceMark};

/// Settings of the search for activations.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceSearch {
    /// Whether both sides of a muscle have activations of their own instead of a common one.
    pub sides_apart: bool,
    /// Standard deviation of the prior of every activation, whose mean is 0.
    pub prior_sd: f64,
    /// The search. Default: Gauss-Newton from four starts.
    pub settings: FitSettings,
}

impl Default for SpaceSearch {
    fn default() -> Self {
        let settings = FitSettings {
            best_steps: true,
            method: Method::GaussNewton,
            misfit_tolerance: 1.0,
            tension_tolerance: 1e-2,
            cost_tolerance: 1e-8,
            max_iterations: 100,
            ..FitSettings::default()
        };
        Self { sides_apart: false, prior_sd: ACTIVATION, settings }
    }
}

/// Standard deviation above which a combination of activations counts as open.
pub const OPEN_ABOVE: f64 = 0.1;

/// A combination of activations, and its uncertainty by the data alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Combination {
    /// Unit vector over the activations that are unknown; its largest entry is positive.
    pub direction: ByMuscle<f64>,
    /// Standard deviation of its amount; infinite (null in JSON) if no observation depends on it.
    pub sd: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EndedSearch {
    pub activations: ByMuscle<f64>,
    /// Root of the mean squared residual, in standard deviations.
    pub misfit: f64,
    pub factorisations: usize,
    /// Whether its steps converged to an equilibrium that Newton's method finds from rest.
    pub converged: bool,
}

impl EndedSearch {
    /// Whether no activation differs from these by more than 0.05.
    fn is_at(&self, activations: &[f64]) -> bool {
        self.activations.0.iter().zip(activations).all(|((_, a), b)| (a - b).abs() <= 0.05)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct SpaceFit {
    /// Names of the unknowns: muscles, or the common name of both sides of a muscle.
    pub names: Vec<String>,
    /// Root mean square distance from the marks, m.
    pub rms_m: f64,
    /// Distance from each mark, m: of a place, of the surface or contour, or of a length. Differences of stretches and ratios are
    /// multiplied by the length at rest by which they are divided.
    pub distances_m: Vec<f64>,
    /// The observations linearised at the answer; `None` where there is no equilibrium.
    response: Option<LinearResponse>,
    /// Combinations of activations, the most certain first; those above [`OPEN_ABOVE`] are open.
    pub combinations: Vec<Combination>,
    pub starts: Vec<EndedSearch>,
    pub factorisations: usize,
    /// The answer of the inverse problem: its unknowns are in hundredths, and its tensions are the activations of all muscles.
    pub answer: Answer<3>,
}

fn activations_of(hundredths: &[f64]) -> Vec<f64> {
    hundredths.iter().map(|x| 0.01 * x).collect()
}

impl SpaceFit {
    /// The activations of the unknowns, in the order of [`Self::names`].
    pub fn activations_found(&self) -> Vec<f64> {
        activations_of(&self.answer.x)
    }

    /// The 95 % interval of each activation of [`Self::names`]; empty where there is no equilibrium at the answer.
    pub fn intervals_95(&self) -> Vec<[f64; 2]> {
        let found = DVector::from_vec(self.activations_found());
        self.response.as_ref().map_or_else(Vec::new, |response| response.intervals_95(&found))
    }

    /// Number of starts that converged to this answer, with no activation that differs by more than 0.05.
    pub fn ended_here(&self) -> usize {
        let found = self.activations_found();
        self.starts.iter().filter(|e| e.converged && e.is_at(&found)).count()
    }

    /// Converged starts at another answer whose misfit is at most `part` larger, relative to the answer's.
    pub fn others_as_good(&self, part: f64) -> impl Iterator<Item = &EndedSearch> {
        let found = self.activations_found();
        let most = self.answer.misfit * (1.0 + part);
        self.starts.iter().filter(move |e| e.converged && e.misfit <= most && !e.is_at(&found))
    }
}

#[derive(Clone, Copy)]
enum SearchStart<'a> {
    /// At rest, and at further starting points.
    Rest,
    /// At the answer of the frame before.
    Before(&'a Answer<3>),
    /// At an answer found on one half, which is only completed on the whole: its positions there are nearly these.
    Found(&'a Answer<3>),
}

/// Groups of muscles with one activation: their common name and their numbers.
fn searched(body: &Body<3>, sides_apart: bool) -> Vec<(String, Vec<usize>)> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (number, muscle) in body.muscles.iter().enumerate() {
        let name = if sides_apart { &muscle.name } else { &muscle.group };
        match groups.iter_mut().find(|(known, _)| known == name && muscle.side != Side::Middle) {
            Some((_, numbers)) => numbers.push(number),
            None => groups.push((name.clone(), vec![number])),
        }
    }
    groups
}

impl SpaceSearch {
    /// [`SpaceSearch::fit`] for two sides that are alike: searches on one half of the body, with the system `left`, which costs a third,
    /// and completes the best answer on the whole.
    pub fn fit_alike(
        &self,
        (body, system): (&Body<3>, &System<3>),
        (half, left): (&Half, &System<3>),
        marks: &[SpaceMark],
        begin: Option<&Answer<3>>,
    ) -> Result<SpaceFit, FitError> {
        let images = marks.iter().map(|mark| on_half(half, body, mark)).collect::<Option<Vec<_>>>();
        let Some(images) = images.filter(|_| !self.sides_apart) else {
            return self.fit(body, system, marks, begin);
        };
        let begin = begin.map(|b| {
            let positions = half.nodes.iter().map(|&n| b.positions[n]).collect();
            Answer { positions, ..b.clone() }
        });
        let found = self.fit(&half.body, left, &images, begin.as_ref())?;
        let on_whole = Answer { positions: half.positions_of_whole(&found.answer.positions), ..found.answer };
        let fit = self.fit_from(body, system, marks, SearchStart::Found(&on_whole))?;
        Ok(SpaceFit {
            factorisations: found.factorisations + fit.factorisations,
            starts: found.starts,
            ..fit
        })
    }

    /// Finds the activations that bring a body to the marks. `begin` is the answer of the frame before, at which the only start begins;
    /// without it there are several starts, the first at rest.
    ///
    /// # Errors
    /// [`FitError`] if the search cannot begin; later failures are a status of the answer.
    pub fn fit(
        &self,
        body: &Body<3>,
        system: &System<3>,
        marks: &[SpaceMark],
        begin: Option<&Answer<3>>,
    ) -> Result<SpaceFit, FitError> {
        self.fit_from(body, system, marks, begin.map_or(SearchStart::Rest, SearchStart::Before))
    }

    fn fit_from(
        &self,
        body: &Body<3>,
        system: &System<3>,
        marks: &[SpaceMark],
        begin: SearchStart<'_>,
    ) -> Result<SpaceFit, FitError> {
        let groups = searched(body, self.sides_apart);
        let mut observed = Observed::new(body);
        let observations =
            marks.iter().map(|mark| observed.observations_of(mark)).collect::<Result<Vec<_>, _>>()?;
        if !(self.prior_sd.is_finite() && self.prior_sd > 0.0) {
            return refused(format!("the prior of activations has the standard deviation {}", self.prior_sd));
        }
        let tied = groups.iter().flat_map(|(_, m)| m[1..].iter().map(|&other| [m[0], other])).collect();
        let unknowns = groups.iter().map(|(_, muscles)| {
            let unknown = Unknown::activation(muscles[0]);
            unknown.with_prior(0.0, unknown.unit / self.prior_sd)
        });
        let unknowns = unknowns.collect();
        let none = vec![0.0; groups.len()];
        let (begin_at, starts) = match begin {
            SearchStart::Rest => ((&none[..], system.rest()), self.settings.starts),
            SearchStart::Before(b) | SearchStart::Found(b) => ((&b.x[..], &b.positions[..]), 1),
        };
        let problem = LeastSquaresProblem::new(system, observations.concat(), unknowns);
        let problem = LeastSquaresProblem { tied, begin: Some(begin_at), ..problem };
        let settings = FitSettings { starts, ..self.settings };
        let mut forward = Forward::new(&problem, &settings);
        let mut answer = match begin {
            SearchStart::Found(found) => found.clone(),
            SearchStart::Rest | SearchStart::Before(_) => solve(&problem, &settings)?,
        };
        let mut factorisations = answer.counts.factorisations;
        forward.begin_at(&answer.x, &answer.positions);
        let linear = forward.linearise(&answer.x);
        if let SearchStart::Found(found) = begin {
            let Some(linear) = &linear else {
                return self.fit_from(body, system, marks, SearchStart::Before(found));
            };
            factorisations = 0;
            answer.tensions = problem.tensions_of(&answer.x);
            answer.lengths = forward.lengths();
            answer.misfit = forward.misfit(Some(&linear.residuals));
            answer.positions = forward.positions().to_vec();
        }
        let names: Vec<String> = groups.into_iter().map(|(name, _)| name).collect();
        let rows = problem.observations.len();
        let response = linear.as_ref().map(|l| LinearResponse {
            residuals: l.residuals.rows(0, rows).into_owned(),
            jacobian: l.jacobian.rows(0, rows) * 100.0,
            prior_sd: self.prior_sd,
            stiffness_sd_ln: Priors::default().young_modulus.sd_ln,
        });
        let decomposed = linear.as_ref().and_then(|l| decompose(&l.jacobian.rows(0, rows).into_owned()));
        let (values, directions) = decomposed.unwrap_or_default();
        let combinations = values.into_iter().zip(directions).map(|(value, direction)| Combination {
            direction: ByMuscle::new(&names, direction.iter().copied()),
            sd: 0.01 / value,
        });
        let combinations = combinations.collect();
        let distances_m: Vec<f64> = Vec::from_iter(marks.iter().zip(&observations).map(|(mark, own)| {
            let squares: f64 = own.iter().map(|o| o.residual(&answer.positions).powi(2)).sum();
            mark.sd_m * squares.sqrt()
        }));
        let squares: f64 = distances_m.iter().map(|d| d * d).sum();
        let prior = |x: &[f64]| activations_of(x).iter().map(|a| (a / self.prior_sd).powi(2)).sum::<f64>();
        let starts = Vec::from_iter(answer.starts.iter().map(|s| EndedSearch {
            activations: ByMuscle::new(&names, activations_of(&s.x)),
            misfit: ((s.cost - prior(&s.x)).max(0.0) / rows as f64).sqrt(),
            factorisations: s.counts.factorisations,
            converged: s.converged && s.solved,
        }));
        Ok(SpaceFit {
            names,
            rms_m: (squares / marks.len() as f64).sqrt(),
            distances_m,
            response,
            combinations,
            factorisations: factorisations + forward.counts.factorisations,
            starts,
            answer,
        })
    }
}
