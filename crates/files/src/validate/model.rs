//! Predictions of the mechanical models: the thesis's fit, and the most probable point of the posterior's model.

use tongue_core::body::{Body, HYOID, Mesh};
use tongue_core::system::Model;
use tongue_infer::inverse::{self, FitSettings, FitStatus, Method};
use tongue_infer::posterior::{Density, MapEstimate, Measurements, PosteriorError, PosteriorModel, Priors};

use super::cases::Case;

/// Stretches of all muscles of the target by the thesis's fit; ones if there is no equilibrium.
pub fn of_thesis(mesh: &Mesh<2>, model: &Model, case: &Case) -> Vec<f64> {
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    match inverse::fit(mesh, model, case.target(), &settings) {
        Ok(fit) if fit.status != FitStatus::NoEquilibrium => fit.simulated,
        _ => vec![1.0; case.target().muscles.len()],
    }
}

pub fn posterior_model(body: &Body<2>, model: &Model) -> Result<PosteriorModel, PosteriorError> {
    let mut priors = Priors::default();
    priors.hyoid.off = body.bone(HYOID).is_empty();
    PosteriorModel::new(body, model, &priors)
}

/// Stretches of all muscles of the target at the most probable point, which sees the shorter muscles; ones if there is no equilibrium.
pub fn most_probable(posterior_model: &PosteriorModel, case: &Case) -> Vec<f64> {
    let mut seen = Measurements::of(&case.matched);
    for position in (0..seen.len()).rev().filter(|m| !case.target().active.contains(m)) {
        seen = seen.without(position);
    }
    let found = Density::new(posterior_model, seen).and_then(|mut density| MapEstimate::find(&mut density));
    let Ok(MapEstimate { place, .. }) = found else { return vec![1.0; case.target().muscles.len()] };
    let stretch = |&n: &usize| place.lengths[n] / place.baseline_lengths[n];
    case.matched.numbers[..case.target().muscles.len()].iter().map(stretch).collect()
}
