//! A prepared batch: its jobs, and everything that a fit needs.

use std::collections::{BTreeMap, BTreeSet};

use miette::{IntoDiagnostic, bail};
use rayon::prelude::*;
use tongue_fit::inverse::alarms::THICKNESS_M;
use tongue_fit::inverse::batch;
use tongue_fit::measured::lengths::rest_distance;
use tongue_fit::measured::{Dataset, Target, TargetKind, reference_muscle};
use tongue_fit::posterior::PosteriorModel;
use tongue_fit::report::batch::journal::{Journal, JournalEntry};
use tongue_fit::report::batch::{
    self as outputs, Batch, BatchSummary, Digest, Fitted, MOST_FITS_ON_PAGE, RowPosterior, contrasts,
};
use tongue_fit::report::{OutputDir, Provenance, ReportError};
use tongue_fit::run::BatchRun;

use super::Arguments;
use crate::cli::{Global, Outcome, inputs, line_of, outcome, output, posterior, table};

const MOST_NOTES: usize = 10;

/// Jobs and inputs of a batch, shared by threads. They depend on the arguments and files only.
pub struct PreparedBatch {
    data: Dataset,
    unreadable: Vec<String>,
    pub run: BatchRun,
    kinds: Vec<TargetKind>,
    /// Options of the posterior, and the body under its priors if posteriors are asked for.
    posterior: (posterior::Arguments, Option<PosteriorModel>),
    /// With `--joint`, the posteriors of rows by the numbers of their jobs; made by [`PreparedBatch::sample`].
    sampled: BTreeMap<usize, Result<RowPosterior, String>>,
    pub provenance: Provenance,
    /// Hash of all inputs and of the command.
    pub key: String,
}

impl PreparedBatch {
    /// Prepares the batch of these arguments; `words` are the arguments without those that do not change
    /// results.
    pub fn new(arguments: &Arguments, words: &[String]) -> miette::Result<Self> {
        let selection = arguments.selection()?;
        let data = inputs::lengths(arguments.lengths.as_ref(), arguments.error_mm)?;
        let unreadable: Vec<String> = data.left_out();
        let plan = batch::plan(&data, &selection).into_diagnostic()?;
        if let (true, Some(first)) = (plan.jobs.is_empty(), plan.refusals.first()) {
            bail!(
                "none of the {} rows can be fitted; line {}, {} /{}/: {}",
                plan.refusals.len(),
                first.line,
                first.subject,
                first.vowel,
                first.message
            );
        }
        let (tongue, model) = (arguments.body.body()?, arguments.body.model());
        // An error that concerns all fits is reported before anything is written.
        let mut run =
            BatchRun::new(plan, batch::settings(arguments.method), &tongue, &model).into_diagnostic()?;
        run.muscles = outputs::columns(&data, &run.body.mesh);
        let posterior_model = arguments.posterior.posterior_model(&tongue, &model)?;
        let (mesh, settings) = (&run.body.mesh, &run.settings);

        let command = line_of(words.to_vec());
        let rows =
            data.rows().iter().map(|r| format!("{} {:?}", r.line, r.lengths)).collect::<Vec<_>>().join("\n");
        let mut inputs = vec![
            tongue_fit::VERSION.to_owned(),
            rows,
            format!("{unreadable:?}"),
            format!("{selection:?}"),
            format!("{mesh:?}"),
            format!("{model:?}"),
            format!("{settings:?}"),
        ];
        inputs.extend(posterior_model.as_ref().map(|g| format!("{:?} {:?}", arguments.posterior, g.priors)));
        let inputs_sha256 = outputs::sha256(&inputs.iter().map(String::as_str).collect::<Vec<_>>());
        let key = outputs::sha256(&[&inputs_sha256, &command]);
        let provenance = Provenance::new(command).with_inputs(&inputs_sha256);
        Ok(Self {
            data,
            unreadable,
            kinds: selection.kinds,
            run,
            posterior: (arguments.posterior.clone(), posterior_model),
            sampled: BTreeMap::new(),
            provenance,
            key,
        })
    }

    pub fn fit(&self, number: usize) -> Result<JournalEntry<Fitted>, ReportError> {
        let clock = std::time::Instant::now();
        let own = if self.has_posterior(number) && !self.posterior.0.joint {
            self.posteriors(&[number]).pop().map(|(_, posterior)| posterior)
        } else {
            None
        };
        let posterior = own.as_ref().or(self.sampled.get(&number));
        let result = self.run.fit(number, Some(number), posterior, &self.provenance)?;
        Ok(JournalEntry { job: number, wall_s: clock.elapsed().as_secs_f64(), result })
    }

    /// With `--joint`, samples the posteriors of the rows of these jobs before the fits, all rows of a subject together. They are not kept in
    /// the journal.
    pub fn sample(&mut self, jobs: &[usize]) {
        let (how, Some(_)) = &self.posterior else { return };
        if !how.joint {
            return;
        }
        let all = &self.run.plan.jobs;
        let mut speakers: Vec<Vec<usize>> = Vec::new();
        for number in (0..all.len()).filter(|&n| self.has_posterior(n)) {
            let same = speakers.iter_mut().find(|rows| {
                let [a, b] = [rows[0], number].map(|n| &all[n].target);
                a.subject == b.subject && a.baseline == b.baseline
            });
            match same {
                Some(rows) => rows.push(number),
                None => speakers.push(vec![number]),
            }
        }
        speakers.retain(|rows| rows.iter().any(|n| jobs.contains(n)));
        let found: Vec<_> = speakers.par_iter().map(|rows| self.posteriors(rows)).collect();
        self.sampled = found.into_iter().flatten().collect();
    }

    /// Whether the posterior of a job's row is reported with this job: with the last of the row's fits, since it does not depend on the
    /// quantity that is fitted.
    fn has_posterior(&self, number: usize) -> bool {
        let last = self.kinds.last().copied();
        self.posterior.1.is_some() && last == Some(self.run.plan.jobs[number].target.kind)
    }

    /// The posteriors of rows that are sampled together, by the numbers of their jobs.
    fn posteriors(&self, rows: &[usize]) -> Vec<(usize, Result<RowPosterior, String>)> {
        let (how, Some(posterior_model)) = &self.posterior else { return Vec::new() };
        let targets: Vec<&Target> = rows.iter().map(|&n| &self.run.plan.jobs[n].target).collect();
        let sampled = match how.sample(posterior_model, &targets, Vec::new()) {
            Ok(sampled) => sampled,
            // The caller adds the row to the message.
            Err(e) => return rows.iter().map(|&n| (n, Err(e.root_cause().to_string()))).collect(),
        };
        Vec::from_iter(rows.iter().enumerate().map(|(posture, &number)| {
            let ridges = (number < MOST_FITS_ON_PAGE).then(|| sampled.ridges(posture)).flatten();
            let vowel = &sampled.reports[posture].postures[posture];
            let contrasts = sampled.contrasts.iter().filter(|c| c.b == *vowel).cloned().collect();
            let report = sampled.reports[posture].clone();
            (number, Ok(RowPosterior { ridges: ridges.map(|svg| svg.to_string()), report, contrasts }))
        }))
    }

    pub fn finish(
        &self,
        out: &OutputDir,
        journal: &Journal,
        global: &Global,
        wall_s: f64,
    ) -> miette::Result<Outcome> {
        let plan = &self.run.plan;
        let (digests, not_begun) = outputs::digests(&plan.jobs, journal).into_diagnostic()?;
        let summary = self.summary(&digests);
        let contrasts = contrasts::all(&plan.jobs, &digests);
        let batch = Batch {
            provenance: &self.provenance,
            jobs: &plan.jobs,
            journal,
            digests: &digests,
            baselines: &plan.baselines,
            refusals: &[plan.refusals.clone(), not_begun].concat(),
            unreadable: &self.unreadable,
            summary: &summary,
            mesh: &self.run.body.mesh,
            muscles: &self.run.muscles,
            contrasts: &contrasts,
        };
        let written = outputs::write_files(out, &batch).into_diagnostic()?;
        if global.json {
            output::stream(|stdout| outputs::write_json(stdout, &batch, true))?;
        } else {
            let text = table::batch(&batch, wall_s)?;
            output::summary(&(text + &table::files(&written)), &written)?;
        }
        if summary.not_fitted + summary.unreadable_rows > 0 {
            return Ok(Outcome::SomeRowsRefused);
        }
        let untold = summary.posteriors_untold;
        let untold =
            (untold > 0).then(|| format!("{} cannot be reported", table::counted(untold, "posterior")));
        let fits = outcome::untrusted(&summary.statuses, &["converged"], "fits");
        let why: Vec<String> = fits.into_iter().chain(untold).collect();
        Ok(Outcome::judged(why.is_empty(), || why.join("; ")))
    }

    fn summary(&self, digests: &[(usize, Digest)]) -> BatchSummary {
        let rest: Vec<f64> = Vec::from_iter(self.run.muscles.iter().map(|name| {
            let chain = self.run.body.mesh.muscles.iter().find(|m| m.name.eq_ignore_ascii_case(name));
            chain.map_or(f64::NAN, |chain| self.run.body.mesh.distance(chain.ends()))
        }));
        let reference = &self.data.muscles()[reference_muscle(self.data.muscles())];
        let ratios =
            self.run.muscles.iter().filter(|m| *m != reference && self.data.muscles().contains(m)).count();
        let digests = digests.iter().map(|(_, digest)| digest);
        let statuses = outcome::counted(digests.clone().map(|digest| digest.status.clone()));
        let fits = digests.clone().count();
        let substitutes = self.run.plan.jobs.iter().filter(|job| job.substitute);
        let substitutes: BTreeSet<String> = substitutes.map(|job| job.target.subject.clone()).collect();
        BatchSummary {
            rows: self.data.rows().len(),
            fits,
            statuses,
            baselines: self.run.plan.baselines.len(),
            not_fitted: self.run.plan.refusals.len() + self.run.plan.jobs.len() - fits,
            unreadable_rows: self.unreadable.len(),
            posteriors_untold: digests.clone().filter(|d| d.posterior_untold).count(),
            substitute_baselines: substitutes.into_iter().collect(),
            rest_shape_measure: rest_distance::measure(ratios, reference),
            nearest_row_to_rest: rest_distance::nearest(&self.run.muscles, &rest, &self.data, reference),
            passive: outputs::passive_groups(digests),
            thickness_m: THICKNESS_M,
        }
    }

    /// Reports rows that are left out on stderr, before the work begins.
    pub fn tell_what_is_left_out(&self) {
        for message in self.unreadable.iter().take(MOST_NOTES) {
            output::complain(message);
        }
        for r in self.run.plan.refusals.iter().take(MOST_NOTES) {
            output::complain(&format!("line {}, {} /{}/: {}", r.line, r.subject, r.vowel, r.message));
        }
        let more = self.unreadable.len().saturating_sub(MOST_NOTES)
            + self.run.plan.refusals.len().saturating_sub(MOST_NOTES);
        if more > 0 {
            output::complain(&format!(
                "{more} more rows cannot be fitted; fits.csv and batch.json name them all"
            ));
        }
        let baselines = self.run.plan.baselines.iter().filter(|b| b.substitute);
        let subjects: Vec<String> = baselines.map(|b| b.subject.clone()).collect();
        if !subjects.is_empty() {
            output::note(&format!(
                "no /ɯ/ for {}: fitted against /{}/ and marked so; --baseline chooses another",
                table::listed(subjects, MOST_NOTES, ", "),
                batch::SUBSTITUTE_BASELINE
            ));
        }
    }
}
