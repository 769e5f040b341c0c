//! A prepared batch: its jobs, and everything that a fit needs.

use std::fmt::Write as _;

use anyhow::{Result, bail};
use tongue_fit::inner::inverse::batch;
use tongue_fit::inner::report::batch::journal::Journal;
use tongue_fit::inner::report::batch::{
    self as outputs, Batch, FinishedFits, MOST_FITS_ON_PAGE, PassiveGroup, SubjectContrast,
};
use tongue_fit::inner::report::{OutputDir, Provenance, joined, status_counts};
use tongue_fit::inner::run::{BatchRun, RowPosteriors};
use tongue_fit::measured::Dataset;

use super::Arguments;
use crate::cli::table::{align_left, count_of, most_agree, rows, wrap_sentence};
use crate::cli::{Global, Outcome, inputs, line_of, output, table};

const MOST_NOTES: usize = 10;

/// Jobs and inputs of a batch, which threads share. They depend only on the arguments and the files.
pub struct PreparedBatch {
    pub data: Dataset,
    unreadable: Vec<String>,
    pub run: BatchRun,
    pub provenance: Provenance,
    /// Hash of all inputs and of the command.
    pub key: String,
}

impl PreparedBatch {
    /// Prepares the batch of these arguments; `words` are the arguments without those that do not change results.
    pub fn new(arguments: &Arguments, words: &[String]) -> Result<Self> {
        let selection = arguments.selection()?;
        let (data, _) = inputs::lengths(arguments.lengths.as_ref(), arguments.error_mm)?;
        let unreadable: Vec<String> = data.left_out();
        let plan = batch::plan(&data, &selection)?;
        if let (true, Some(first)) = (plan.jobs.is_empty(), plan.refusals.first()) {
            bail!("none of the {} rows can be fitted; {first}", plan.refusals.len());
        }
        let (tongue, model) = (arguments.body.body()?, arguments.body.model());
        if arguments.lengths.is_some() {
            inputs::tell_lacking(&data, &tongue);
        }
        let (settings, how) = (batch::settings(arguments.method), &arguments.posterior);
        plan.jobs.iter().try_for_each(|job| how.check_baseline(&data, &job.target))?;
        let posterior_model = how.posterior_model(&tongue, &model)?;
        let command = line_of(words.to_vec());
        let rows = joined(data.rows.iter().map(|r| format!("{} {:?}", r.line, r.lengths)), "\n");
        let mut inputs = vec![
            tongue_fit::VERSION.to_owned(),
            rows,
            format!("{unreadable:?}"),
            format!("{selection:?}"),
            format!("{:?}", tongue.mesh),
            format!("{model:?}"),
            format!("{settings:?}"),
        ];
        inputs.extend(posterior_model.as_ref().map(|g| format!("{how:?} {:?}", g.priors)));
        let inputs_sha256 = outputs::sha256(&inputs.iter().map(String::as_str).collect::<Vec<_>>());
        let (sampling, joint) = (how.sampling(), how.joint);
        let posteriors = posterior_model.zip(selection.kinds.last());
        let posteriors = posteriors.map(|(model, &with)| RowPosteriors { model, sampling, joint, with });
        // A body and a model that make no system are reported before anything is written.
        let run = BatchRun::new((&data, plan), settings, (&tongue, &model), posteriors)?;
        let key = outputs::sha256(&[&inputs_sha256, &command]);
        let provenance = Provenance { inputs_sha256: Some(inputs_sha256), ..Provenance::new(command) };
        Ok(Self { data, unreadable, run, provenance, key })
    }

    pub fn finish(
        &self,
        out: &OutputDir,
        journal: &Journal,
        global: &Global,
        wall_s: f64,
    ) -> Result<Outcome> {
        let plan = &self.run.plan;
        let (digests, not_begun) = outputs::digests(&plan.jobs, journal)?;
        not_begun.iter().take(MOST_NOTES).for_each(|r| output::complain(&r.to_string()));
        let summary = self.run.summary(&self.data, self.unreadable.len(), &digests);
        let contrasts = outputs::subject_contrasts(&plan.jobs, &digests);
        let mut batch = Batch {
            provenance: &self.provenance,
            jobs: &plan.jobs,
            fits: FinishedFits { journal, digests: &digests, with_times: false },
            baselines: &plan.baselines,
            refusals: &[plan.refusals.clone(), not_begun].concat(),
            unreadable: &self.unreadable,
            summary: &summary,
            mesh: &self.run.body.mesh,
            muscles: &self.run.muscles,
            contrasts: &contrasts,
        };
        let written = outputs::write_files(out, &batch)?;
        if global.json {
            batch.fits.with_times = true;
            output::stream(|stdout| outputs::write_json(stdout, &batch))?;
        } else {
            let text = text(&batch, wall_s)?;
            output::summary(&(text + &table::files(&written)), &written)?;
        }
        if summary.not_fitted + summary.unreadable_rows > 0 {
            return Ok(Outcome::SomeRowsRefused);
        }
        let untold = summary.posteriors_untold;
        let untold = (untold > 0).then(|| format!("{} cannot be reported", count_of(untold, "posterior")));
        let number = summary.posteriors_contradicted;
        let contradicted = (number > 0).then(|| contradicted(number));
        let mut bad = summary.statuses.clone();
        bad.remove("converged");
        let fits = output::untrusted_sentence(&bad, summary.fits, "fits");
        Ok(Outcome::of_reasons(fits.into_iter().chain(untold).chain(contradicted)))
    }

    pub fn tell_what_is_left_out(&self) {
        let refusals = &self.run.plan.refusals;
        self.unreadable.iter().take(MOST_NOTES).for_each(|message| output::complain(message));
        refusals.iter().take(MOST_NOTES).for_each(|r| output::complain(&r.to_string()));
        let more =
            self.unreadable.len().saturating_sub(MOST_NOTES) + refusals.len().saturating_sub(MOST_NOTES);
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
                table::join_first(subjects, MOST_NOTES, ", "),
                batch::SUBSTITUTE_BASELINE
            ));
        }
    }
}

const MOST_LISTED: usize = 60;

fn text(batch: &Batch<'_>, wall_s: f64) -> Result<String> {
    let s = batch.summary;
    let mut text = String::new();
    if batch.jobs.len() <= MOST_LISTED {
        text += &fits(batch)?;
    }
    let _ = writeln!(
        text,
        "passive stretches, RMS (†: against a substitute baseline)\n{}\n\n{} in {wall_s:.1} s: {}\n{}, {} not fitted, {} unreadable",
        table::from_columns(&PassiveGroup::columns(), &s.passive),
        count_of(s.fits, "fit"),
        status_counts(&s.statuses),
        count_of(s.baselines, "baseline"),
        s.not_fitted,
        s.unreadable_rows
    );
    if !batch.contrasts.is_empty() {
        text += &decided_contrasts(batch.contrasts);
        text += &most_agree(&outputs::over_subjects(batch.contrasts));
    }
    if s.posteriors_untold > 0 {
        let _ = writeln!(
            text,
            "{} without results; the alarms of their fits in batch.json say why, and more draws usually help",
            count_of(s.posteriors_untold, "posterior")
        );
    }
    if s.posteriors_contradicted > 0 {
        let _ = writeln!(
            text,
            "{}; the alarms of their fits in batch.json say how far",
            contradicted(s.posteriors_contradicted)
        );
    }
    if let Some(n) = &s.nearest_row_to_rest {
        let _ = writeln!(
            text,
            "the model at rest is nearest to {} /{}/ by {:.3} ({})",
            n.subject, n.vowel, n.distance.rms_ratio, s.rest_shape_measure
        );
    }
    if s.fits > MOST_FITS_ON_PAGE {
        let _ = writeln!(
            text,
            "batch.html and tensions.svg show the first {MOST_FITS_ON_PAGE} fits; the other files have all"
        );
    }
    Ok(text)
}

fn decided_contrasts(all: &[SubjectContrast]) -> String {
    let sure: Vec<&SubjectContrast> = all.iter().filter(|c| c.contrast.is_decided()).collect();
    let mut text =
        format!("contrasts between vowels that are sure to 95 %: {} of {}\n", sure.len(), all.len());
    for same in sure.chunk_by(|a, b| contrast_name(a) == contrast_name(b)) {
        let words = same.iter().map(|SubjectContrast { contrast: c, .. }| {
            let mark = if c.sign_depends_on_prior == Some(true) { "‡" } else { "" };
            format!("{} {}{mark}", c.muscle, if c.probability_more > 0.5 { "harder" } else { "less" })
        });
        let _ = writeln!(text, "  {}: {}", contrast_name(same[0]), joined(words, ", "));
    }
    text
}

fn contrast_name(s: &SubjectContrast) -> String {
    format!("{} /{}/ against /{}/", s.subject, s.contrast.a, s.contrast.b)
}

fn fits(batch: &Batch<'_>) -> Result<String> {
    let (mut verdicts, mut lines) = (String::new(), Vec::new());
    for number in 0..batch.jobs.len() {
        if let Some((_, fit)) = batch.fits.read(number)? {
            verdicts.extend(fit.verdict.iter().map(|verdict| wrap_sentence(verdict)));
            lines.push(fit.line);
        }
    }
    let header =
        ["fit", "tensions, N/m", "posterior,\nmedian (95 %)", "misfit", "passive\nstretches", "alarms"];
    let has_posterior = lines.iter().any(|line| !line[2].is_empty());
    let columns: Vec<usize> = (0..header.len()).filter(|column| *column != 2 || has_posterior).collect();
    let mut t = rows(&columns.iter().map(|&c| header[c]).collect::<Vec<_>>(), &lines, |line| {
        columns.iter().map(|&c| line[c].as_str())
    });
    align_left(&mut t, 1..columns.len() - 3);
    let gap = if verdicts.is_empty() { "" } else { "\n" };
    Ok(format!("{verdicts}{gap}{t}\n\n"))
}

fn contradicted(rows: usize) -> String {
    format!("{} of lengths that the model contradicts", count_of(rows, "row"))
}
