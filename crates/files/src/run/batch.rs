//! The fits of a table in one body.

use std::collections::{BTreeMap, BTreeSet};

use tongue_core::body::{Body, Mesh};
use tongue_core::parallel;
use tongue_core::statistics::grouped;
use tongue_core::system::{Model, System};
use tongue_infer::inverse::alarms::THICKNESS_M;
use tongue_infer::inverse::batch::BatchPlan;
use tongue_infer::inverse::{FitError, FitSettings};
use tongue_infer::posterior::{AuxiliaryData, PosteriorModel, Sampling};
use tongue_input::measured::lengths::rest_distance;
use tongue_input::measured::{Dataset, Target, TargetKind, reference_muscle};

use super::fit::{FitRun, PosteriorRun, VerdictSource, sampled_together};
use crate::report::batch::record::AssessedRecord;
use crate::report::batch::{
    BatchSummary, Digest, Fitted, MOST_FITS_ON_PAGE, RowPosterior, fit_outputs, passive_groups,
};
use crate::report::{Provenance, ReportError, tally};

#[derive(Debug)]
pub struct BatchRun {
    pub plan: BatchPlan,
    pub body: Body<2>,
    /// Names of the body's muscles in the order of columns: those that the table has, in its order, then the others.
    pub muscles: Vec<String>,
    pub model: Model,
    pub settings: FitSettings,
    /// `None` if no posteriors are asked for.
    pub posteriors: Option<RowPosteriors>,
    /// With [`RowPosteriors::joint`], the posterior of each row by the index of its job.
    sampled: BTreeMap<usize, SampledRow>,
}

/// The posterior of a row, or why it has none.
type SampledRow = Result<RowPosterior, String>;

#[derive(Debug)]
pub struct RowPosteriors {
    pub model: PosteriorModel,
    pub sampling: Sampling,
    /// Whether the rows of a subject are sampled together.
    pub joint: bool,
    /// Whether it is reported with the fit of ratios or with that of stretches; it depends on neither.
    pub with: TargetKind,
}

impl BatchRun {
    /// Refuses a body and a model of which no system can be made.
    pub fn new(
        (data, plan): (&Dataset, BatchPlan),
        settings: FitSettings,
        (body, model): (&Body<2>, &Model),
        posteriors: Option<RowPosteriors>,
    ) -> Result<Self, FitError> {
        System::new(&body.mesh, model, &[])?;
        let muscles = in_order(data, &body.mesh);
        let (body, model, sampled) = (body.clone(), *model, BTreeMap::new());
        Ok(Self { plan, body, muscles, model, settings, posteriors, sampled })
    }

    /// Makes the fit of a job and its parts of the outputs, with the posterior of the row, or the reason why it has none, if one was asked
    /// for. `Ok(Err)` says why the fit cannot begin. The page shows the fit if `on_page` is set and its number is not too large.
    pub fn fit(
        &self,
        number: usize,
        on_page: bool,
        provenance: &Provenance,
        tell: &dyn Fn(&str),
    ) -> Result<Result<Fitted, String>, ReportError> {
        let Self { body, muscles, model, settings, .. } = self;
        let job = &self.plan.jobs[number];
        let own = self.posteriors_with(number).filter(|how| !how.joint);
        let own = own.and_then(|how| self.posteriors(how, &[&job.target], &[number], tell).pop());
        let posterior = own.as_ref().map(|(_, posterior)| posterior).or(self.sampled.get(&number));
        let verdict = posterior.map_or(VerdictSource::None, |posterior| {
            VerdictSource::Posterior(posterior.as_ref().map(|p| &p.report).map_err(String::as_str))
        });
        let fit_run = FitRun { target: &job.target, settings: *settings, walls: false, verdict };
        let record = match fit_run.run(body, model, &Provenance::new(provenance.command.clone())) {
            Ok(record) => AssessedRecord::new(job, record),
            Err(e) => return Ok(Err(e.to_string())),
        };
        let posterior = posterior.and_then(|p| p.as_ref().ok());
        fit_outputs(on_page.then_some(number), &record, (&body.mesh, muscles), posterior, provenance).map(Ok)
    }

    /// If subjects are sampled jointly, samples those in `jobs` with all their vowels in the table; [`Self::fit`] takes their posteriors from
    /// there. `note` gets which vowels are left out and why, `tell` what is sampled.
    pub fn sample(&mut self, data: &Dataset, jobs: &[usize], [note, tell]: [&(dyn Fn(&str) + Sync); 2]) {
        let Some(how) = self.posteriors.as_ref().filter(|how| how.joint) else { return };
        let all = &self.plan.jobs;
        let sampled = (0..all.len()).filter(|&n| self.posteriors_with(n).is_some());
        let mut speakers = grouped(sampled, |&n| (&all[n].target.subject, &all[n].target.baseline));
        speakers.retain(|rows| rows.iter().any(|n| jobs.contains(n)));
        let results = parallel::map(&speakers, |rows| {
            let first = &all[rows[0]].target;
            match sampled_together(data, first, &mut |why| note(&format!("{}: {why}", first.subject))) {
                Ok(together) => self.posteriors(how, &together.iter().collect::<Vec<_>>(), rows, tell),
                Err(e) => rows.iter().map(|&n| (n, Err(e.to_string()))).collect(),
            }
        });
        self.sampled = results.into_iter().flatten().collect();
    }

    /// The settings of the posterior that is reported with a job; `None` if the job has none.
    fn posteriors_with(&self, number: usize) -> Option<&RowPosteriors> {
        self.posteriors.as_ref().filter(|how| how.with == self.plan.jobs[number].target.kind)
    }

    /// The posteriors of jobs, by their indices, whose vowels are among the `targets` that are sampled together.
    fn posteriors(
        &self,
        how: &RowPosteriors,
        targets: &[&Target],
        rows: &[usize],
        tell: &dyn Fn(&str),
    ) -> Vec<(usize, SampledRow)> {
        let RowPosteriors { model, sampling, .. } = how;
        let posterior_run =
            PosteriorRun { model, targets, auxiliary: AuxiliaryData::default(), sampling: *sampling };
        let sampled = match posterior_run.run(tell) {
            Ok(sampled) => sampled,
            // The caller names the row.
            Err(e) => return rows.iter().map(|&n| (n, Err(e.to_string()))).collect(),
        };
        let postures = rows.iter().filter_map(|&number| {
            let vowel = &self.plan.jobs[number].target.vowel;
            Some((number, targets.iter().position(|target| target.vowel == *vowel)?))
        });
        Vec::from_iter(postures.map(|(number, posture)| {
            let ridges = (number < MOST_FITS_ON_PAGE).then(|| sampled.ridges(posture)).flatten();
            let report = sampled.reports[posture].clone();
            let vowel = &report.postures[posture];
            let contrasts = sampled.contrasts.iter().filter(|c| c.b == *vowel).cloned().collect();
            (number, Ok(RowPosterior { ridges: ridges.map(|svg| svg.to_string()), report, contrasts }))
        }))
    }

    /// The summary of the fits of a table in which `unreadable` rows could not be read.
    pub fn summary(&self, data: &Dataset, unreadable: usize, digests: &[(usize, Digest)]) -> BatchSummary {
        let (muscles, mesh, plan) = (&self.muscles, &self.body.mesh, &self.plan);
        let rest: Vec<f64> = Vec::from_iter(muscles.iter().map(|name| {
            let chain = mesh.muscles.iter().find(|m| m.name.eq_ignore_ascii_case(name));
            chain.map_or(f64::NAN, |chain| mesh.distance(chain.ends()))
        }));
        let reference = &data.muscles[reference_muscle(&data.muscles)];
        let ratios = muscles.iter().filter(|m| *m != reference && data.muscles.contains(m)).count();
        let count = |is: fn(&Digest) -> bool| digests.iter().filter(|(_, digest)| is(digest)).count();
        let substitutes = plan.jobs.iter().filter(|job| job.substitute);
        let substitutes: BTreeSet<String> = substitutes.map(|job| job.target.subject.clone()).collect();
        BatchSummary {
            rows: data.rows.len(),
            fits: digests.len(),
            statuses: tally(digests.iter().map(|(_, digest)| digest.status.clone())),
            baselines: plan.baselines.len(),
            not_fitted: plan.refusals.len() + plan.jobs.len() - digests.len(),
            unreadable_rows: unreadable,
            posteriors_untold: count(|d| d.posterior_untold),
            posteriors_contradicted: count(|d| d.contradicted),
            substitute_baselines: substitutes.into_iter().collect(),
            rest_shape_measure: rest_distance::measure(ratios, reference),
            nearest_row_to_rest: rest_distance::nearest(muscles, &rest, data, reference),
            passive: passive_groups(&plan.jobs, digests),
            thickness_m: THICKNESS_M,
        }
    }
}

/// The names of a mesh's muscles: those that the table has, in its order, then the others.
fn in_order(data: &Dataset, mesh: &Mesh<2>) -> Vec<String> {
    let known =
        data.muscles.iter().filter(|name| mesh.muscles.iter().any(|m| m.name.eq_ignore_ascii_case(name)));
    let mut names: Vec<String> = known.cloned().collect();
    for chain in &mesh.muscles {
        if !names.iter().any(|n| n.eq_ignore_ascii_case(&chain.name)) {
            names.push(chain.name.clone());
        }
    }
    names
}
