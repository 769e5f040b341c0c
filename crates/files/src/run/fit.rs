//! One fit of a target, with what there is to doubt in it.

use nalgebra::SVector;
use tongue_core::body::Body;
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::{self, FitError, FitSettings, Method, TargetOnBody, alarms};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;

use crate::report::{FitRecord, Provenance};
use crate::scene::effects::CONTACT_REACH_MM;

#[derive(Debug, Clone)]
pub struct FitRun {
    pub target: Target,
    pub settings: FitSettings,
    pub walls: bool,
}

impl FitRun {
    /// A fit by derivatives: what `tongue-fit --vowel` makes with `--method gauss-newton` and nothing else.
    pub fn quick(target: Target, walls: bool) -> Self {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        Self { target, settings, walls }
    }

    pub fn run(&self, body: &Body<2>, model: &Model, made_by: &Provenance) -> Result<FitRecord, FitError> {
        let Self { target, settings, .. } = self;
        let fit = match body.palate.as_ref().filter(|_| self.walls) {
            None => inverse::fit(&body.mesh, model, target, settings)?,
            Some(palate) => {
                let matched = TargetOnBody::new(&body.mesh, target)?;
                let system = walled(body, model, palate, &matched.contracting())?;
                inverse::fit_in(&system, &matched, settings)?
            }
        };
        let known = Muscles::built_in();
        let alarms = alarms::alarms(&body.mesh, &fit, &known, settings);
        Ok(FitRecord::new(fit, alarms, made_by))
    }
}

/// A body that its palate and teeth stop, as in a scene with `effects.contact`.
fn walled(
    body: &Body<2>,
    model: &Model,
    palate: &[SVector<f64, 2>],
    pulling: &[usize],
) -> Result<System<2>, SystemError> {
    let mut additions = Additions::default();
    let stiffness = system::coefficients(&body.mesh, model)?.tissue_stiffness;
    let nodes = body.mesh.surface_nodes();
    additions.add_contact(Contact::new(palate.to_vec(), &nodes, stiffness, CONTACT_REACH_MM * 1e-3));
    System::with(&body.mesh, model, pulling, additions)
}
