//! A body prepared for posteriors: its system, its hyoid, the random fields that displace it, and perturbed bodies for other errors.

use std::sync::Arc;

use nalgebra::{DMatrix, SVector};

use super::PosteriorError;
use super::parameters::ParameterValues;
use super::priors::{MuscleEndsPrior, OutlinePrior, Priors};
use crate::error_model::bell;
use tongue_core::body::{Body, ContinuumSettings, HYOID};
use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statics::lanes::{Adjoint, Load};
use tongue_core::system::{Model, System};

/// Points nearer to each other than this are one point, m.
const SAME_POINT_M: f64 = 1e-6;
/// Distance between the points that carry the field of the outline, in correlation lengths.
const CARRIERS_APART: f64 = 1.0;

/// Part of a standard deviation by which perturbed bodies differ to either side.
const STEP: f64 = 1e-3;
/// The same part for widths and patches, large enough to average over the jumps where their points pass from one element to another.
const WIDE_STEP: f64 = 0.5;

/// Displacements of all nodes of the body at rest, m, for one standard deviation.
pub type Field = Vec<SVector<f64, 2>>;

#[derive(Debug)]
pub struct PosteriorModel {
    pub priors: Priors,
    pub body: Body<2>,
    /// The system with the Poisson's ratio of the priors; every muscle can contract.
    pub system: Arc<System<2>>,
    pub model: Model,
    pub muscles: Vec<String>,
    /// Nodes of the hyoid; empty for a body without one.
    pub hyoid: Vec<usize>,
    /// Fields of the ends of the muscles: two for each distinct end.
    pub ends: Vec<Field>,
    pub outline: Vec<Field>,
    /// Displacements of the hyoid's nodes, m, for a tilt of one radian, the greater horn downwards.
    pub(super) turn: Vec<SVector<f64, 2>>,
    /// The body with lower and with higher kappa; `None` if kappa is known.
    pub(super) kappa: Option<[System<2>; 2]>,
    /// Perturbed bodies of a continuum, for all sources of error but kappa; `None` for bodies of springs.
    pub(super) sides: Option<PerturbedBodies>,
}

impl PosteriorModel {
    /// Load of a posture by its number, or of the baseline for the number after the last posture, solved from the positions `start`. The
    /// hyoid is displaced, and tilted by `values.tilt` radians for every metre that it moves back.
    pub fn load<'l>(
        &'l self,
        values: &ParameterValues,
        posture: usize,
        start: Option<&'l [SVector<f64, 2>]>,
    ) -> Load<'l, 2> {
        let own = &values.postures[posture];
        let load = Load { start, ..Load::new(own.tensions.clone()) };
        if !self.moves_hyoid() || own.hyoid == SVector::<f64, 2>::zeros() {
            return load;
        }
        if values.tilt == 0.0 {
            return load.with_bone(&self.hyoid, own.hyoid);
        }
        let angle = values.tilt * own.hyoid.x;
        let nodes = self.hyoid.chunks(1).zip(&self.turn);
        nodes.fold(load, |load, (node, turn)| load.with_bone(node, own.hyoid + turn * angle))
    }

    pub fn moves_hyoid(&self) -> bool {
        !self.hyoid.is_empty() && !self.priors.hyoid.off
    }

    /// Derivatives of a function of a shape by the displacement of the hyoid along both axes, and by the angle by which it tilts.
    pub(crate) fn hyoid_rates(&self, adjoint: &Adjoint<2>) -> [f64; 3] {
        let shift = adjoint.by_bone(&self.hyoid);
        let each = self.hyoid.iter().zip(&self.turn);
        [shift.x, shift.y, each.map(|(&node, turn)| adjoint.by_node[node].dot(turn)).sum()]
    }

    pub fn is_of_springs(&self) -> bool {
        self.sides.is_none()
    }

    /// The body at rest displaced by fields, each with its number of standard deviations; the parts of muscles outside the tissue stay
    /// straight. `None` where a cell would fold.
    pub fn displaced<'f>(&self, fields: impl IntoIterator<Item = (&'f Field, f64)>) -> Option<Body<2>> {
        let mut body = self.body.clone();
        for (field, by) in fields {
            body.mesh.nodes.iter_mut().zip(field).for_each(|(x, d)| *x += d * by);
        }
        for path in self.system.paths() {
            let [a, b] = path.ends();
            let before = &self.body.mesh.nodes;
            let whole = (before[b] - before[a]).norm();
            let (from, to) = (body.mesh.nodes[a], body.mesh.nodes[b]);
            for node in path.inner_nodes() {
                body.mesh.nodes[node] = from + (to - from) * ((before[node] - before[a]).norm() / whole);
            }
        }
        if let Some(continuum) = &mut body.mesh.continuum {
            *continuum = Arc::new(continuum.moved(&self.body.mesh.nodes, &mut body.mesh.nodes));
        }
        // A palate is an obstacle of the body at rest, which the posterior does not use.
        body.palate = None;
        let (low, _) = self.system.cell_ratios(&body.mesh.nodes);
        (low > LEAST_RATIO).then_some(body)
    }
}

/// Displacements of the hyoid's nodes, m, for a turn of one radian about its foremost node by which the nodes behind it move downwards.
fn turn(rest: &[SVector<f64, 2>], hyoid: &[usize]) -> Vec<SVector<f64, 2>> {
    let foremost = hyoid.iter().copied().min_by(|a, b| rest[*a].x.total_cmp(&rest[*b].x));
    let arms = hyoid.iter().map(|&node| foremost.map_or(SVector::zeros(), |pivot| rest[node] - rest[pivot]));
    arms.map(|arm| SVector::from([arm.y, -arm.x])).collect()
}

fn laid_anew(body: &Body<2>, settings: &ContinuumSettings) -> Result<Body<2>, PosteriorError> {
    if body.mesh.continuum.as_ref().is_some_and(|c| c.settings == *settings) {
        return Ok(body.clone());
    }
    let Some(laid) = body.with_continuum(settings) else {
        let why = "this continuum cannot be given other muscles and patches; leave them as they are in the priors ([bundle_width] off = true, [bone_patch] off = true)";
        return Err(PosteriorError::Refused(why.to_owned()));
    };
    laid.map_err(|e| PosteriorError::Refused(e.to_string()))
}

/// A cell that keeps less than this part of its area counts as folded.
const LEAST_RATIO: f64 = 0.1;

/// Fields of every distinct muscle end along every axis: this end moves by one standard deviation, and the others stay.
fn attachment_fields(body: &Body<2>, prior: &MuscleEndsPrior) -> Vec<Field> {
    let (nodes, muscles) = (&body.mesh.nodes, &body.mesh.muscles);
    let places = distant(nodes, muscles.iter().flat_map(|m| m.ends()), SAME_POINT_M);
    let reach = 1e-3 * prior.reach_mm;
    // These weights are one at an end and zero at all others.
    let weights = if prior.off { None } else { kernel(&places, reach).try_inverse() };
    weights.map_or_else(Vec::new, |weights| fields(nodes, &places, reach, &(weights * (1e-3 * prior.sd_mm))))
}

/// Independent fields whose sum is a Gaussian random displacement of the outline with the covariance of the priors.
fn outline_fields(body: &Body<2>, prior: &OutlinePrior) -> Vec<Field> {
    let nodes = &body.mesh.nodes;
    let reach = 1e-3 * prior.reach_mm;
    let places = distant(nodes, body.mesh.outlines().into_iter().flatten(), CARRIERS_APART * reach);
    // u(x) = k(x, c) K⁻¹ u_c with u_c ~ N(0, sd² K); the weights are the inverse of the transposed Cholesky factor of K.
    let n = places.len();
    let factor = if prior.off { None } else { kernel(&places, reach).cholesky() };
    let weights =
        factor.and_then(|factor| factor.l().transpose().solve_upper_triangular(&DMatrix::identity(n, n)));
    weights.map_or_else(Vec::new, |weights| fields(nodes, &places, reach, &(weights * (1e-3 * prior.sd_mm))))
}

/// Places, m, of nodes that are farther than `apart`, m, from every place kept before.
fn distant(nodes: &[Point], numbers: impl Iterator<Item = usize>, apart: f64) -> Vec<Point> {
    let mut places: Vec<Point> = Vec::new();
    for node in numbers {
        if places.iter().all(|p| (p - nodes[node]).norm() > apart) {
            places.push(nodes[node]);
        }
    }
    places
}

fn kernel(places: &[Point], reach: f64) -> DMatrix<f64> {
    DMatrix::from_fn(places.len(), places.len(), |i, j| bell((places[i] - places[j]).norm(), reach))
}

/// Sums of bell curves at `places`, one for each column of `weights` (amplitudes, m) and axis.
fn fields(nodes: &[Point], places: &[Point], reach: f64, weights: &DMatrix<f64>) -> Vec<Field> {
    Vec::from_iter(weights.column_iter().flat_map(|weights| {
        let way =
            |x: &Point| places.iter().zip(weights.iter()).map(|(p, w)| w * bell((x - p).norm(), reach)).sum();
        let ways: Vec<f64> = nodes.iter().map(way).collect();
        [SVector::x(), SVector::y()].map(|axis| ways.iter().map(|w| axis * *w).collect())
    }))
}

impl PosteriorModel {
    pub fn new(body: &Body<2>, model: &Model, priors: &Priors) -> Result<Self, PosteriorError> {
        priors.check()?;
        let muscles = body.mesh.muscle_names();
        if let Some(name) = priors.unknown_muscle(&muscles) {
            return Err(PosteriorError::Refused(format!(
                "the priors fix {name}, a muscle that this body does not have; it has {}",
                muscles.join(", ")
            )));
        }
        let mut model = *model;
        if !priors.compressibility.off {
            model.poisson_ratio = priors.compressibility.poisson_ratio;
        }
        let body = match &body.mesh.continuum {
            Some(continuum) => laid_anew(body, &priors.continuum(&continuum.settings))?,
            None => body.clone(),
        };
        let all: Vec<usize> = (0..muscles.len()).collect();
        let system = Arc::new(System::new(&body.mesh, &model, &all)?);
        let hyoid = body.bone(HYOID).to_vec();
        let (ends, outline) =
            (attachment_fields(&body, &priors.muscle_ends), outline_fields(&body, &priors.outline));
        let (priors, turn) = (priors.clone(), turn(system.rest(), &hyoid));
        let (kappa, sides) = (None, None);
        let whole = Self { priors, body, system, model, muscles, hyoid, ends, outline, turn, kappa, sides };
        let sides = whole.body.mesh.continuum.as_ref().map(|_| PerturbedBodies::new(&whole)).transpose()?;
        Ok(Self { kappa: with_other_kappa(&whole)?, sides, ..whole })
    }
}

/// A body that differs from that of a posterior at rest or in a constant, with the same unknowns.
#[derive(Debug)]
pub struct PerturbedBody {
    pub(super) system: System<2>,
    pub(super) hyoid: Vec<usize>,
    /// Displacements of the hyoid's nodes for one radian, m.
    pub(super) turn: Vec<SVector<f64, 2>>,
}

/// Bodies perturbed in opposite directions, and by how many standard deviations.
pub type PerturbedPair = ([PerturbedBody; 2], f64);

/// Perturbed bodies for every source of error; none for a source that is known or has no effect in the body.
#[derive(Debug)]
pub struct PerturbedBodies {
    pub(super) ends: Vec<PerturbedPair>,
    pub(super) outline: Vec<PerturbedPair>,
    pub(super) width: Option<PerturbedPair>,
    pub(super) patch: Option<PerturbedPair>,
}

impl PerturbedBody {
    fn new(posterior_model: &PosteriorModel, body: &Body<2>) -> Result<Self, PosteriorError> {
        let all = posterior_model.system.contracting();
        let system = System::new(&body.mesh, &posterior_model.model, all)?;
        let hyoid = body.bone(HYOID).to_vec();
        let turn = if hyoid == posterior_model.hyoid {
            posterior_model.turn.clone()
        } else {
            turn(system.rest(), &hyoid)
        };
        Ok(Self { system, hyoid, turn })
    }
}

impl PerturbedBodies {
    fn new(posterior_model: &PosteriorModel) -> Result<Self, PosteriorError> {
        let PosteriorModel { body, priors, .. } = posterior_model;
        let pair = |by: f64, step: f64, changed: &dyn Fn(f64) -> Result<Body<2>, PosteriorError>| {
            let side = |by: f64| PerturbedBody::new(posterior_model, &changed(by)?);
            Ok::<PerturbedPair, PosteriorError>(([side(-by)?, side(by)?], step))
        };
        let fields = |fields: &[Field]| {
            let pairs = parallel::map(fields, |field| {
                pair(STEP, STEP, &|by| {
                    posterior_model.displaced([(field, by)]).ok_or_else(|| {
                        PosteriorError::Refused("a cell of this body is nearly folded at rest".to_owned())
                    })
                })
            });
            pairs.into_iter().collect::<Result<Vec<_>, _>>()
        };
        let settings = body.mesh.continuum.as_ref().map(|c| c.settings);
        let laid = |sd: f64, change: fn(&mut ContinuumSettings, f64)| {
            let pair = settings.filter(|_| sd != 0.0).map(|settings| {
                pair(WIDE_STEP * sd, WIDE_STEP, &|by| {
                    let mut settings = settings;
                    change(&mut settings, by.exp());
                    laid_anew(body, &settings)
                })
            });
            pair.transpose()
        };
        Ok(Self {
            ends: fields(&posterior_model.ends)?,
            outline: fields(&posterior_model.outline)?,
            width: laid(priors.sd_ln_width(), |settings, times| settings.bundle_width_m *= times)?,
            patch: laid(priors.sd_ln_patch(), |settings, times| settings.patch_radius_m *= times)?,
        })
    }
}

/// Systems with kappa one standard deviation of its logarithm lower and higher, and the same second Lamé constant; `None` where it is known.
fn with_other_kappa(posterior_model: &PosteriorModel) -> Result<Option<[System<2>; 2]>, PosteriorError> {
    let prior = &posterior_model.priors.compressibility;
    if prior.off {
        return Ok(None);
    }
    let (lambda, mu) = posterior_model.model.lame();
    // Kappa is the difference of the Lamé constants in springs, and the first one in other tissue.
    let is_of_springs = posterior_model.body.mesh.continuum.is_none();
    let [low, high] = [-prior.sd_ln_kappa, prior.sd_ln_kappa].map(f64::exp).map(|times| {
        let lambda = if is_of_springs { mu + (lambda - mu) * times } else { lambda * times };
        let poisson_ratio = lambda / (2.0 * (lambda + mu));
        let young_modulus = 2.0 * mu * (1.0 + poisson_ratio);
        let model = Model { poisson_ratio, young_modulus, ..posterior_model.model };
        System::new(&posterior_model.body.mesh, &model, posterior_model.system.contracting())
    });
    Ok(Some([low?, high?]))
}
