//! Speakers whose tensions are known, drawn from the priors of a posterior, and what is measured of them.

use nalgebra::DMatrix;
use tongue_core::random::normals;
use tongue_core::statics::lanes::Lanes;
use tongue_fit::MM;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::statics::{self, SolveStatus};
use tongue_fit::system::{Model, System};
use tongue_infer::posterior::{Density, Measurements, ParameterValues, PosteriorModel, Priors};

/// Variance of a stretch by the rounding of lengths of some 50 mm to millimetres.
const ROUNDING: f64 = 6.7e-5;

/// The tongue of springs under priors (TOML).
pub fn posterior_model(priors: &str) -> PosteriorModel {
    posterior_model_at(5.5 * MM, priors)
}

/// The same with a coarse mesh, for what holds on any mesh: a posterior takes a quarter of the time.
pub fn coarse_posterior_model(priors: &str) -> PosteriorModel {
    posterior_model_at(10.0 * MM, priors)
}

/// The same with another mesh spacing, m.
pub fn posterior_model_at(spacing_m: f64, priors: &str) -> PosteriorModel {
    let priors = Priors::from_toml(priors, "test").unwrap();
    PosteriorModel::new(&Body::tongue(spacing_m).unwrap(), &Model::default(), &priors).unwrap()
}

/// Shapes of a body in the postures of a speaker, one after the other, and at last in the baseline, if it has them.
pub fn shapes(density: &Density<'_>, truth: &ParameterValues, system: &System<2>) -> Option<Vec<Vec<Point>>> {
    let lanes = Lanes::new(system);
    let settings = statics::SolveSettings::default();
    let shape = |posture| {
        let load = density.posterior_model.load(truth, posture, None);
        let shape = lanes.solve(&[load], &settings).remove(0);
        (shape.solution.status == SolveStatus::Converged).then_some(shape.positions)
    };
    (0..=density.postures()).map(shape).collect()
}

/// Stretches of shapes against the last one.
pub fn stretches_of(system: &System<2>, shapes: &[Vec<Point>]) -> Vec<f64> {
    let lengths: Vec<Vec<f64>> = shapes.iter().map(|shape| system.lengths(shape)).collect();
    let (over, postures) = lengths.split_last().unwrap();
    postures.iter().flat_map(|own| own.iter().zip(over).map(|(l, l0)| l / l0)).collect()
}

/// Stretches of a body in the postures of a speaker, one after the other, if it has them.
pub fn stretches(density: &Density<'_>, truth: &ParameterValues, system: &System<2>) -> Option<Vec<f64>> {
    Some(stretches_of(system, &shapes(density, truth, system)?))
}

/// Of so many postures, with errors that are zero.
fn exact(posterior_model: &PosteriorModel, postures: usize, stretches: &[f64]) -> Measurements {
    let count = posterior_model.muscles.len();
    let n = stretches.len();
    let rounding = DMatrix::from_fn(n, n, |i, j| {
        // Half of it comes from the baseline, which the postures share.
        let of_baseline = if i % count == j % count { 0.5 * ROUNDING } else { 0.0 };
        of_baseline + if i == j { 0.5 * ROUNDING } else { 0.0 }
    });
    Measurements {
        names: (0..n).map(|i| posterior_model.muscles[i % count].clone()).collect(),
        muscles: (0..n).map(|i| i % count).collect(),
        postures: (0..n).map(|i| i / count).collect(),
        stretches: stretches.to_vec(),
        rounding,
        labels: (0..postures).map(|p| format!("v{p}")).collect(),
        ..Measurements::nothing()
    }
}

/// What was seen of true stretches.
pub fn seen(
    posterior_model: &PosteriorModel,
    postures: usize,
    stretches: &[f64],
    random: &mut fastrand::Rng,
) -> Measurements {
    let mut seen = exact(posterior_model, postures, stretches);
    let n = stretches.len();
    let errors = &seen.rounding + DMatrix::identity(n, n) * posterior_model.priors.discrepancy.sd.powi(2);
    let errors = errors.cholesky().unwrap().l() * normals(n, random);
    seen.stretches.iter_mut().zip(errors.iter()).for_each(|(s, e)| *s += e);
    seen
}

/// A density of which nothing was seen yet.
pub fn unseen(posterior_model: &PosteriorModel, postures: usize) -> Density<'_> {
    let count = postures * posterior_model.muscles.len();
    Density::new(posterior_model, exact(posterior_model, postures, &vec![1.0; count])).unwrap()
}

/// A number of a meaning.
pub struct Number {
    /// F0, F, F - F0, contrast, hyoid or tilt.
    pub kind: &'static str,
    pub name: String,
    pub value: Box<dyn Fn(&ParameterValues) -> f64 + Sync>,
}

/// All that is sampled, and what is told of it.
pub fn unknowns(posterior_model: &PosteriorModel, postures: usize) -> Vec<Number> {
    let mut all: Vec<Number> = Vec::new();
    let mut add = |kind: &'static str, of: String, value: Box<dyn Fn(&ParameterValues) -> f64 + Sync>| {
        all.push(Number { kind, name: format!("{kind} {of}"), value });
    };
    for (m, name) in posterior_model.muscles.iter().enumerate() {
        add("F0", name.clone(), Box::new(move |d| d.tones[m]));
        for p in 0..postures {
            add("F", format!("{name} {p}"), Box::new(move |d| d.postures[p].tensions[m]));
            let change = move |d: &ParameterValues| d.postures[p].tensions[m] - d.tones[m];
            add("F - F0", format!("{name} {p}"), Box::new(change));
        }
        if postures > 1 {
            let contrast = move |d: &ParameterValues| d.postures[0].tensions[m] - d.postures[1].tensions[m];
            add("contrast", name.clone(), Box::new(contrast));
        }
    }
    for p in 0..postures {
        for axis in 0..2 {
            add("hyoid", format!("{axis} {p}"), Box::new(move |d| d.postures[p].hyoid[axis]));
        }
    }
    add("tilt", String::new(), Box::new(|d| d.tilt));
    all
}

/// Probability that uniform numbers are as far from uniform as these, after Kolmogorov and Smirnov, with
/// Stephens's correction.
pub fn p_of_uniform(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    let n = all.len() as f64;
    let away = |(i, x): (usize, &f64)| (x - i as f64 / n).max((i as f64 + 1.0) / n - x);
    let largest = all.iter().enumerate().map(away).fold(0.0, f64::max);
    let t = largest * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
    let term = |k: i32| 2.0 * if k % 2 == 1 { 1.0 } else { -1.0 } * (-2.0 * f64::from(k * k) * t * t).exp();
    (1..=60).map(term).sum::<f64>().clamp(0.0, 1.0)
}
