//! The fits of a table in one body.

use tongue_core::body::Body;
use tongue_core::system::{Model, System};
use tongue_infer::inverse::batch::{BatchPlan, PublishedFacts};
use tongue_infer::inverse::{FitError, FitSettings};

use super::fit::{FitRun, VerdictSource};
use crate::report::batch::record::AssessedRecord;
use crate::report::batch::{Fitted, RowPosterior, fitted};
use crate::report::{Provenance, ReportError};

#[derive(Debug, Clone)]
pub struct BatchRun {
    pub plan: BatchPlan,
    pub body: Body<2>,
    pub muscles: Vec<String>,
    pub model: Model,
    pub settings: FitSettings,
    known: PublishedFacts,
}

impl BatchRun {
    pub fn new(
        plan: BatchPlan,
        settings: FitSettings,
        body: &Body<2>,
        model: &Model,
    ) -> Result<Self, FitError> {
        System::new(&body.mesh, model, &[])?;
        let (known, muscles) = (PublishedFacts::built_in(), body.mesh.muscle_names());
        Ok(Self { plan, body: body.clone(), muscles, model: *model, settings, known })
    }

    /// Makes the fit of a job of the plan and its parts of the outputs, with the posterior of the row or why there is none, if one was asked
    /// for; or says why the fit cannot begin. The page shows the fit if it has a number there that is not too large.
    pub fn fit(
        &self,
        number: usize,
        on_page: Option<usize>,
        posterior: Option<&Result<RowPosterior, String>>,
        provenance: &Provenance,
    ) -> Result<Result<Fitted, String>, ReportError> {
        let Self { body, muscles, model, settings, .. } = self;
        let job = &self.plan.jobs[number];
        let verdict = posterior.map_or(VerdictSource::None, |posterior| {
            VerdictSource::Posterior(posterior.as_ref().map(|p| &p.report).map_err(String::as_str))
        });
        let asked = FitRun { target: &job.target, settings: *settings, walls: false, verdict };
        let record = match asked.run(body, model, &Provenance::new(provenance.command.clone())) {
            Ok(record) => AssessedRecord::new(job, record, &self.known),
            Err(e) => return Ok(Err(e.to_string())),
        };
        let posterior = posterior.and_then(|p| p.as_ref().ok());
        fitted(on_page, &record, (&body.mesh, muscles), posterior, provenance).map(Ok)
    }
}
