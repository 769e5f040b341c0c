//! One fit of a target, with what there is to doubt in it.

use nalgebra::SVector;
use tongue_core::body::Body;
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::{self, Fit, FitError, FitSettings, Matched, Method};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;

use crate::report::{self, FitRecord, Provenance, ReportError, SectionPicture, Svg};
use crate::scene::effects::CONTACT_REACH_MM;

#[derive(Debug, Clone)]
pub struct FitRun {
    pub target: Target,
    pub settings: FitSettings,
    pub walls: bool,
}

#[derive(Debug, Clone)]
pub struct FitFound {
    pub fit: Fit,
    pub alarms: Vec<Alarm>,
}

impl FitRun {
    /// A fit by derivatives: what `tongue-fit --vowel` makes with `--method gauss-newton` and nothing else.
    pub fn quick(target: Target, walls: bool) -> Self {
        let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
        Self { target, settings, walls }
    }

    pub fn run(&self, body: &Body<2>, model: &Model) -> Result<FitFound, FitError> {
        let Self { target, settings, .. } = self;
        let fit = match body.palate.as_ref().filter(|_| self.walls) {
            None => inverse::fit(&body.mesh, model, target, settings)?,
            Some(palate) => {
                let matched = Matched::new(&body.mesh, target)?;
                let system = walled(body, model, palate, &matched.contracting())?;
                inverse::fit_in(&system, &matched, settings)?
            }
        };
        let known = Muscles::built_in();
        let alarms = alarms::alarms(&body.mesh, &fit, &known, settings);
        Ok(FitFound { fit, alarms })
    }
}

impl FitFound {
    /// Its record, with the time that it took, s, if that is wanted.
    pub fn record(self, made_by: Provenance, wall_s: Option<f64>) -> FitRecord {
        let Self { fit, alarms } = self;
        let (verdict, conclusion, posterior) = (None, None, None);
        FitRecord { made_by, verdict, conclusion, fit, alarms, posterior, contrasts: Vec::new(), wall_s }
    }

    pub fn picture(&self, body: &Body<2>) -> Result<Svg, ReportError> {
        let target = &self.fit.target;
        let title =
            format!("{} /{}/: at rest (grey) and at the tensions found", target.subject, target.vowel);
        let palate = body.palate.as_deref().unwrap_or_default();
        let tensions = self.fit.shown_tensions();
        report::tongue(&SectionPicture::new(&body.mesh, &self.fit.positions, &tensions, palate, &title))
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
