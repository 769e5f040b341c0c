//! Activations of a body in space from marks (places of nodes and coils, points of the surface and the midsagittal contour, lengths of
//! muscles), by the same search as every other inverse problem.
//!
//! Residuals are in standard deviations of the marks, activations in hundredths. A weak prior with mean 0 determines the combinations of
//! activations that the data leave open, which the answer lists ([`Combination`]).

mod intervals;
mod observations;
mod recorded;

use nalgebra::{DVector, SVector};
use serde::{Serialize, Serializer};
use serde_json::json;
use tongue_core::body::Body;
use tongue_core::body::space::Half;
use tongue_core::statistics::grouped;
use tongue_core::system::System;

use self::intervals::intervals_95;
use self::observations::{Observed, on_half};
pub use self::recorded::Recorded;
use super::alarms::{self, Alarm};
use super::forward::Forward;
use super::problem::LeastSquaresProblem;
use super::projection::decompose;
use super::{Answer, FitError, FitSettings, Method, Unknown, refused};
use crate::posterior::Priors;
use crate::standard_deviations::ACTIVATION;
use tongue_input::measured::{ByMuscle, Marked, SpaceMark};

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
const OPEN_ABOVE: f64 = 0.1;
/// Misfits that differ by at most this part count as equal.
const AS_GOOD: f64 = 0.05;

/// A combination of activations, and its uncertainty by the data alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Combination {
    /// Unit vector over the activations that are unknown; its largest entry is positive.
    pub direction: ByMuscle<f64>,
    /// Standard deviation of its amount; infinite (null in JSON) if no observation depends on it.
    pub sd: f64,
}

impl Combination {
    pub fn is_open(&self) -> bool {
        self.sd > OPEN_ABOVE
    }
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
    fn is_at(&self, activations: &ByMuscle<f64>) -> bool {
        self.activations.0.iter().zip(&activations.0).all(|((_, a), (_, b))| (a - b).abs() <= 0.05)
    }
}

/// Data that a body misses by more, m (RMS), have another unit or other axes.
const FARTHEST_M: f64 = 15e-3;
/// The same of a body at rest: a tongue moves by less.
const FARTHEST_FROM_REST_M: f64 = 50e-3;

/// Extents of the nodes that were seen, over those at rest, that a tongue can have; others have another unit.
const SIZES: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Extent at rest, m (RMS), from which it is compared.
const LEAST_EXTENT_M: f64 = 5e-3;

/// Activations that move a body to marks.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceFit {
    /// The answer of the inverse problem: its unknowns are in hundredths, and its tensions are the activations of all muscles.
    pub answer: Answer<3>,
    /// Root mean square distance from the marks, m.
    pub rms_m: f64,
    /// Distance from each mark, m: of a place, of the surface or contour, or of a length. Differences of stretches and ratios are
    /// multiplied by the length at rest by which they are divided.
    pub distances_m: Vec<f64>,
    /// Activations, 0 to 1, of muscles, or of both sides under their common name.
    pub activations: ByMuscle<f64>,
    /// 95 % intervals that include the prior and a common factor of stiffness; empty without an equilibrium.
    pub interval_95: ByMuscle<[f64; 2]>,
    /// Combinations of activations, the most certain first; the data leave some of them open.
    pub combinations: Vec<Combination>,
    pub starts: Vec<EndedSearch>,
    pub factorisations: usize,
    pub alarms: Vec<Alarm>,
}

fn activations_of(hundredths: &[f64]) -> Vec<f64> {
    hundredths.iter().map(|x| 0.01 * x).collect()
}

impl SpaceFit {
    /// The combinations of activations that the data leave open.
    pub fn open(&self) -> impl Iterator<Item = &Combination> {
        self.combinations.iter().filter(|c| c.is_open())
    }

    /// Number of starts that converged to this answer, with no activation that differs by more than 0.05.
    pub fn ended_here(&self) -> usize {
        self.starts.iter().filter(|e| e.converged && e.is_at(&self.activations)).count()
    }

    /// Converged starts at another answer that meets the data as well, with a misfit at most a twentieth larger.
    pub fn others_as_good(&self) -> impl Iterator<Item = &ByMuscle<f64>> {
        let most = self.answer.misfit * (1.0 + AS_GOOD);
        let others = self.starts.iter().filter(move |e| e.converged && e.misfit <= most);
        others.filter(|e| !e.is_at(&self.activations)).map(|e| &e.activations)
    }
}

impl Serialize for SpaceFit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let record = json!({
            "status": self.answer.status,
            "rms_mm": 1e3 * self.rms_m,
            "distances_mm": Vec::from_iter(self.distances_m.iter().map(|d| 1e3 * d)),
            "activations": self.activations,
            "interval_95": self.interval_95,
            "open": Vec::from_iter(self.open()),
            "starts": self.starts,
            "ended_here": self.ended_here(),
            "others_as_good": Vec::from_iter(self.others_as_good()),
            "factorisations": self.factorisations,
            "alarms": self.alarms,
        });
        record.serialize(serializer)
    }
}

/// The extent of the nodes that were seen over that of the same nodes at rest; `None` for fewer than two, or if they lie together.
fn size_of_nodes(marks: &[SpaceMark], body: &Body<3>) -> Option<f64> {
    let nodes = marks.iter().filter_map(|mark| match mark.what {
        Marked::Node { node, place } => Some((place, body.mesh.nodes[node])),
        _ => None,
    });
    let (places, rest): (Vec<_>, Vec<_>) = nodes.unzip();
    let [now, before] = [places, rest].map(|points: Vec<SVector<f64, 3>>| {
        let centre = points.iter().sum::<SVector<f64, 3>>() / points.len() as f64;
        root_mean_square(&points.iter().map(|p| (p - centre).norm()).collect::<Vec<_>>())
    });
    (before > LEAST_EXTENT_M).then(|| now / before)
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Groups of muscles with one activation: their common name and their numbers.
fn searched(body: &Body<3>, sides_apart: bool) -> Vec<(String, Vec<usize>)> {
    let names = body.muscles.iter().map(|m| if sides_apart { &m.name } else { &m.group });
    let groups = grouped(names.enumerate(), |(_, name)| *name).into_iter();
    groups.map(|group| (group[0].1.clone(), group.iter().map(|(number, _)| *number).collect())).collect()
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
        let fit = self.fit_from(body, system, marks, Some(&on_whole), true)?;
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
        self.fit_from(body, system, marks, begin, false)
    }

    /// [`SpaceSearch::fit`], without a search if the answer `begin` `is_found` on one half: its positions on the whole are nearly these.
    fn fit_from(
        &self,
        body: &Body<3>,
        system: &System<3>,
        marks: &[SpaceMark],
        begin: Option<&Answer<3>>,
        is_found: bool,
    ) -> Result<SpaceFit, FitError> {
        let groups = searched(body, self.sides_apart);
        let mut observed = Observed::new(body);
        let observations =
            marks.iter().map(|mark| observed.observations_of(mark)).collect::<Result<Vec<_>, _>>()?;
        let distances_m = |positions: &[SVector<f64, 3>]| -> Vec<f64> {
            Vec::from_iter(marks.iter().zip(&observations).map(|(mark, own)| {
                mark.sd_m * own.iter().map(|o| o.residual(positions).powi(2)).sum::<f64>().sqrt()
            }))
        };
        let from_rest_m = root_mean_square(&distances_m(&body.mesh.nodes));
        if let Some(ratio) = size_of_nodes(marks, body).filter(|ratio| !SIZES.contains(ratio)) {
            return refused(format!(
                "the nodes that were seen span {ratio:.2} times as much as at rest; give their places in millimetres"
            ));
        }
        if from_rest_m > FARTHEST_FROM_REST_M {
            return refused(Alarm::FarFromData { rms_mm: 1e3 * from_rest_m }.to_string());
        }
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
            None => ((&none[..], system.rest()), self.settings.starts),
            Some(b) => ((&b.x[..], &b.positions[..]), 1),
        };
        let problem = LeastSquaresProblem::new(system, observations.concat(), unknowns);
        let problem = LeastSquaresProblem { tied, begin: Some(begin_at), ..problem };
        let settings = FitSettings { starts, ..self.settings };
        let mut forward = Forward::new(&problem, &settings);
        let mut answer = match begin {
            Some(found) if is_found => found.clone(),
            _ => problem.solve(&settings)?,
        };
        let mut factorisations = answer.counts.factorisations;
        forward.begin_at(&answer.x, &answer.positions);
        let linear = forward.linearise(&answer.x);
        if is_found {
            let Some(linear) = &linear else { return self.fit(body, system, marks, begin) };
            factorisations = 0;
            answer.tensions = problem.tensions_of(&answer.x);
            answer.lengths = forward.lengths();
            answer.misfit = forward.misfit(Some(&linear.residuals));
            answer.positions = forward.positions().to_vec();
        }
        let names: Vec<String> = groups.into_iter().map(|(name, _)| name).collect();
        let rows = problem.observations.len();
        let activations = activations_of(&answer.x);
        let interval_95 = linear.as_ref().map(|l| {
            let (residuals, jacobian) =
                (l.residuals.rows(0, rows).into_owned(), l.jacobian.rows(0, rows) * 100.0);
            let found = DVector::from_column_slice(&activations);
            intervals_95(&residuals, &jacobian, &found, self.prior_sd, Priors::default().young_modulus.sd_ln)
        });
        let decomposed = linear.as_ref().and_then(|l| decompose(&l.jacobian.rows(0, rows).into_owned()));
        let (values, directions) = decomposed.unwrap_or_default();
        let combinations = values.into_iter().zip(directions).map(|(value, direction)| Combination {
            direction: ByMuscle::new(&names, direction.iter().copied()),
            sd: 0.01 / value,
        });
        let combinations: Vec<Combination> = combinations.collect();
        let replay = &answer.replay;
        let mut alarms = alarms::of_equilibrium(&replay.trace.solution, replay.trace.from_rest);
        let ratios = body.volume_ratios(&answer.positions);
        alarms.extend(alarms::of_strain(&body.mesh, ratios, &answer.positions));
        if !combinations.is_empty() && combinations.iter().all(Combination::is_open) {
            alarms.push(Alarm::NothingResolved);
        }
        let distances_m = distances_m(&answer.positions);
        let rms_m = root_mean_square(&distances_m);
        if rms_m > FARTHEST_M {
            alarms.push(Alarm::FarFromData { rms_mm: 1e3 * rms_m });
        }
        let prior = |x: &[f64]| activations_of(x).iter().map(|a| (a / self.prior_sd).powi(2)).sum::<f64>();
        let starts = Vec::from_iter(answer.starts.iter().map(|s| EndedSearch {
            activations: ByMuscle::new(&names, activations_of(&s.x)),
            misfit: ((s.cost - prior(&s.x)).max(0.0) / rows as f64).sqrt(),
            factorisations: s.counts.factorisations,
            converged: s.converged && s.solved,
        }));
        Ok(SpaceFit {
            rms_m,
            distances_m,
            activations: ByMuscle::new(&names, activations),
            interval_95: ByMuscle::new(&names, interval_95.unwrap_or_default()),
            combinations,
            starts,
            factorisations: factorisations + forward.counts.factorisations,
            alarms,
            answer,
        })
    }
}
