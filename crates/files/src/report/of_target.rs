//! A fit with the usual settings, as the page makes it.

use nalgebra::SVector;
use tongue_core::body::Body;
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::{self, FitError, FitSettings, Matched, Method, Premises, Said, Setup, alarms};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;

use super::export::Provenance;
use super::record::FitRecord;
use crate::scene::effects::CONTACT_REACH_MM;

impl FitRecord {
    /// Fits a target by its derivatives under the usual premises ([`Premises::of`]), and says what to doubt:
    /// what `tongue-fit --vowel` with `--method gauss-newton` and nothing else finds, without the time that
    /// it took. With `walls` the palate and teeth of the body stop the tongue, in the baseline too.
    ///
    /// # Errors
    /// As [`inverse::fit`] and [`Setup::new`].
    pub fn of_target(
        body: &Body<2>,
        model: &Model,
        target: &Target,
        thesis: bool,
        walls: bool,
        made_by: Provenance,
    ) -> Result<Self, FitError> {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        let premises = Premises::of(target.kind, body, &Said { thesis, ..Said::default() })?;
        let matched = Matched::new(&body.mesh, target)?;
        let fit = match (premises.is_thesis(), body.palate.as_ref().filter(|_| walls)) {
            (true, None) => inverse::fit(&body.mesh, model, target, &settings)?,
            (false, None) => inverse::fit_in(&Setup::new(body, model, premises)?, &matched, &settings)?,
            (thesis, Some(palate)) => {
                let all = (0..body.mesh.muscles.len()).collect();
                let pulling = if thesis { matched.contracting() } else { all };
                let system = walled(body, model, palate, &pulling)?;
                let names: Vec<&str> = body.mesh.muscles.iter().map(|m| m.name.as_str()).collect();
                let bones = Setup::new(body, model, premises.clone())?.bones;
                let setup = Setup { bones, ..Setup::in_system(system, &names, premises)? };
                inverse::fit_in(&setup, &matched, &settings)?
            }
        };
        let known = Muscles::built_in();
        let alarms = alarms::alarms(&body.mesh, &fit, &known, None, &settings, alarms::DEFAULT_THICKNESS_M);
        Ok(Self { wall_s: None, ..Self::new(&fit, &alarms, made_by, 0.0) })
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
