//! One fit of a target, with what there is to doubt in it.

use nalgebra::SVector;
use tongue_core::body::{Body, Mesh};
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::{self, Fit, FitError, FitSettings, Matched, Method, Premises, Said, Setup};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;

use crate::report::{self, FitRecord, Provenance, ReportError, SectionPicture, Svg};
use crate::scene::effects::CONTACT_REACH_MM;

/// What is asked of a fit.
#[derive(Debug, Clone)]
pub struct FitRun {
    pub target: Target,
    pub settings: FitSettings,
    pub said: Said,
    /// Whether the palate and teeth of the body stop the tongue, in the baseline too.
    pub walls: bool,
}

/// A fit that was made.
#[derive(Debug, Clone)]
pub struct FitFound {
    pub fit: Fit,
    pub alarms: Vec<Alarm>,
}

impl FitRun {
    /// A fit by derivatives under the usual premises or the thesis's: what `tongue-fit --vowel` makes with
    /// `--method gauss-newton` and nothing else.
    pub fn quick(target: Target, thesis: bool, walls: bool) -> Self {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        let said = Said { thesis, ..Said::default() };
        Self { target, settings, said, walls }
    }

    pub fn run(&self, body: &Body<2>, model: &Model) -> Result<FitFound, FitError> {
        let Self { target, settings, .. } = self;
        let premises = Premises::of(target.kind, body, &self.said)?;
        let fit = match body.palate.as_ref().filter(|_| self.walls) {
            None => inverse::fit_under(body, model, target, premises, settings)?,
            Some(palate) => {
                let matched = Matched::new(&body.mesh, target)?;
                let all = (0..body.mesh.muscles.len()).collect();
                let pulling = if premises.is_thesis() { matched.contracting() } else { all };
                let system = walled(body, model, palate, &pulling)?;
                let names: Vec<&str> = body.mesh.muscles.iter().map(|m| m.name.as_str()).collect();
                let bones = Setup::new(body, model, premises.clone())?.bones;
                let setup = Setup { bones, ..Setup::in_system(system, &names, premises)? };
                inverse::fit_in(&setup, &matched, settings)?
            }
        };
        let known = Muscles::built_in();
        let alarms = alarms::alarms(&body.mesh, &fit, &known, None, settings);
        Ok(FitFound { fit, alarms })
    }
}

impl FitFound {
    /// Its record, with the time that it took, s, if that is wanted.
    pub fn record(&self, made_by: Provenance, wall_s: Option<f64>) -> FitRecord {
        FitRecord { wall_s, ..FitRecord::new(&self.fit, &self.alarms, made_by, 0.0) }
    }

    /// The shape at the tensions found over the one that changes are counted from.
    pub fn picture(&self, body: &Body<2>) -> Result<Svg, ReportError> {
        let Fit { target, tone, .. } = &self.fit;
        let posture = tone.posture();
        let title =
            format!("{} /{}/: {posture} (grey) and at the tensions found", target.subject, target.vowel);
        let grey = Mesh { nodes: self.fit.baseline_positions.clone(), ..body.mesh.clone() };
        let palate = body.palate.as_deref().unwrap_or_default();
        let tensions = self.fit.shown_tensions();
        let section = SectionPicture::new(&grey, &self.fit.positions, &tensions, palate, &title);
        let grey = if tone.is_none() { "rest" } else { "baseline" };
        report::tongue(&SectionPicture { grey, ..section })
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
