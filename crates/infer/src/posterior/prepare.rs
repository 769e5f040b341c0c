//! A body prepared for posteriors.

use std::sync::Arc;

use tongue_core::body::{Body, HYOID};
use tongue_core::material::Constants;
use tongue_core::system::{Model, System};

use super::PosteriorError;
use super::finite_differences::beside_in_kappa;
use super::model::{PosteriorModel, ends, laid_anew, outline, turn};
use super::perturbed::PerturbedBodies;
use super::priors::Priors;

impl PosteriorModel {
    pub fn new(body: &Body<2>, model: &Model, priors: &Priors) -> Result<Self, PosteriorError> {
        priors.check()?;
        let muscles = body.mesh.muscle_names();
        if let Some(name) = priors.unknown_muscle(&muscles) {
            return Err(PosteriorError::Priors(format!(
                "the priors fix {name}, a muscle that this body does not have; it has {}",
                muscles.join(", ")
            )));
        }
        let mut model = *model;
        if !priors.compressibility.off {
            let poisson_ratio = priors.compressibility.poisson_ratio;
            model.constants = Constants { poisson_ratio, ..model.constants };
        }
        let body = match &body.mesh.continuum {
            Some(continuum) => laid_anew(body, &priors.continuum(&continuum.settings))?,
            None => body.clone(),
        };
        let all: Vec<usize> = (0..muscles.len()).collect();
        let system = Arc::new(System::new(&body.mesh, &model, &all)?);
        let hyoid = body.bone(HYOID).to_vec();
        let (ends, outline) = (ends(&body, priors), outline(&body, priors));
        let priors = priors.clone();
        let turn = turn(system.rest(), &hyoid);
        let mut posterior_model = Self {
            priors,
            body,
            system,
            model,
            muscles,
            hyoid,
            ends,
            outline,
            turn,
            kappa: None,
            sides: None,
        };
        posterior_model.kappa = beside_in_kappa(&posterior_model)?;
        if posterior_model.body.mesh.continuum.is_some() {
            posterior_model.sides = Some(PerturbedBodies::new(&posterior_model)?);
        }
        Ok(posterior_model)
    }
}
