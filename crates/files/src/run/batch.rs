//! The fits of a table in one body.

use tongue_core::body::{Body, Mesh};
use tongue_core::system::{Model, System};
use tongue_infer::inverse::batch::{self, BatchPlan, PublishedFacts};
use tongue_infer::inverse::{FitError, FitSettings};
use tongue_input::measured::thesis::Thesis;

use crate::report::batch::{Fitted, RowPosterior, fitted};
use crate::report::{Provenance, ReportError};

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
