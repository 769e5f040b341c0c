//! One fit of a target, with what there is to doubt in it.
//! The fits of a table in one body.

use nalgebra::SVector;

use crate::report::batch::{Fitted, RowPosterior, fitted};
use crate::report::{FitRecord, Provenance, ReportError};
use crate::scene::effects::CONTACT_REACH_MM;
use tongue_core::body::{Body, Mesh};
use tongue_core::effect::Contact;
use tongue_core::system::{self, Additions, Model, System, SystemError};
use tongue_infer::inverse::batch::{self, BatchPlan, PublishedFacts};
use tongue_infer::inverse::{self, FitError, FitSettings, Method, TargetOnBody, alarms};
use tongue_input::measured::Target;
use tongue_input::measured::muscles::Muscles;
use tongue_input::measured::thesis::Thesis;

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

#[derive(Debug, Clone)]
pub struct BatchRun {
    pub plan: BatchPlan,
    pub mesh: Mesh<2>,
    pub muscles: Vec<String>,
    pub model: Model,
    pub settings: FitSettings,
    known: PublishedFacts,
    thesis: Option<Thesis>,
}

impl BatchRun {
    pub fn new(
        plan: BatchPlan,
        settings: FitSettings,
        body: &Body<2>,
        model: &Model,
    ) -> Result<Self, FitError> {
        System::new(&body.mesh, model, &[])?;
        let (known, thesis) = (PublishedFacts::built_in(), Thesis::reference().ok());
        let (mesh, muscles) = (body.mesh.clone(), body.mesh.muscle_names());
        Ok(Self { plan, mesh, muscles, model: *model, settings, known, thesis })
    }

    /// Makes the fit of a job of the plan and its parts of the outputs, with the posterior of the row or why
    /// there is none, if one was asked for; or says why the fit cannot begin. The page shows the fit if its
    /// number there is below [`MOST_FITS_ON_PAGE`](crate::report::batch::MOST_FITS_ON_PAGE).
    pub fn fit(
        &self,
        number: usize,
        on_page: usize,
        posterior: Option<&Result<RowPosterior, String>>,
        provenance: &Provenance,
    ) -> Result<Result<Fitted, String>, ReportError> {
        let job = &self.plan.jobs[number];
        match batch::assess(&self.mesh, &self.model, &job.target, &self.known, &self.settings) {
            Ok(assessment) => {
                let beside = (self.thesis.as_ref(), posterior);
                fitted(on_page, job, assessment, (&self.mesh, &self.muscles), beside, provenance).map(Ok)
            }
            Err(e) => Ok(Err(e.to_string())),
        }
    }
}
