//! `tongue-fit --vowel a`: one fit.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use tongue_fit::inner::choice::name_of;
use tongue_fit::inner::posterior::AuxiliaryData;
use tongue_fit::inner::report::{self, Files, Series, SolutionCurveRecord};
use tongue_fit::inner::run::{FitRun, PosteriorRun, Published, VerdictSource, sampled_together};
use tongue_fit::inverse::{Fit, FitSettings, Method};
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
use tongue_fit::system::TissueModel;

use super::fit_table::ShownFit;
use super::inputs::choice;
use super::{Global, Outcome, auxiliary, body, inputs, output, posterior, space_track};

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Fit")]
pub struct Arguments {
    /// Vowel to fit: any label of the table; of the built-in one i, e, a, o or ɯ (u is taken for ɯ)
    #[arg(long, value_name = "V")]
    pub vowel: Option<String>,
    /// Subject whose lengths are fitted
    #[arg(long, value_name = "NAME", default_value = "S2")]
    subject: String,
    /// Quantity to fit: ratio (to GGa, as in the thesis) or stretch (to the subject's own /ɯ/)
    #[arg(long, value_name = "KIND", default_value = "ratio")]
    target: String,
    /// Contracting muscles instead of the rule "shorter than in /ɯ/", such as GGa,SGm,HGa
    #[arg(long, value_name = "LIST", value_delimiter = ',', hide_short_help = true)]
    muscles: Option<Vec<String>>,
    /// Vowel taken as rest instead of ɯ
    #[arg(long, value_name = "V", hide_short_help = true)]
    baseline: Option<String>,
    /// Measured lengths (CSV) instead of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// Search method: the simplex of the thesis, or the derivatives of the equilibrium, which find the same tensions faster (and are the
    /// default of batch)
    #[arg(long, value_parser = choice::<Method>(), default_value = "nelder-mead", hide_short_help = true)]
    method: Method,
    /// Half width of the rounding of every length, mm [default: from the table or its digits, 0.5 for whole millimetres]
    #[arg(long, value_name = "MM", hide_short_help = true)]
    error_mm: Option<f64>,
    #[command(flatten)]
    pub posterior: posterior::Arguments,
    #[command(flatten)]
    pub auxiliary: auxiliary::Arguments,
    #[command(flatten)]
    body: body::Arguments,
}

impl Arguments {
    fn target(&self, data: &Dataset, kind: TargetKind) -> Result<Target> {
        let vowel: Vowel = self.vowel.as_deref().unwrap_or_default().parse()?;
        let baseline = self.baseline.as_deref().map(str::parse::<Vowel>).transpose()?;
        let options = TargetOptions { muscles: self.muscles.clone(), baseline };
        Ok(Target::new(data, &self.subject, &vowel, kind, &options)?)
    }

    /// Reports the subject's rows that are left out, and cells of the two rows of a target that are no lengths. True if
    /// there are none.
    fn tell_left_out(&self, data: &Dataset, target: &Target) -> Result<bool> {
        let rows = data.broken.iter().filter(|row| row.subject.as_ref() == Some(&target.subject));
        let mut left_out = Vec::from_iter(rows.map(|row| format!("{} (this row is left out)", row.fault)));
        for vowel in [&target.vowel, &target.baseline] {
            let cells = data.bad_cells_of(data.row(&self.subject, vowel)?);
            left_out.extend(cells.map(|fault| format!("{fault} (this cell is left out)")));
        }
        left_out.iter().for_each(|what| output::complain(what));
        Ok(left_out.is_empty())
    }

    /// The targets that the posterior samples (with `--joint` all vowels of the subject in the table), and the index of the fitted one.
    fn posterior_targets(&self, data: &Dataset, target: &Target) -> Result<(Vec<Target>, usize)> {
        if !self.posterior.joint {
            return Ok((vec![target.clone()], 0));
        }
        self.posterior.check_baseline(data, target)?;
        let all = sampled_together(data, target, &mut |note| output::note(&note))?;
        if all.len() == 1 {
            output::note("--joint: the table has no other vowel of this subject, so there are no contrasts");
        }
        let own = all.iter().position(|t| t.vowel == target.vowel);
        let own = own.with_context(|| format!("--joint: /{}/ is not in the table", target.vowel))?;
        Ok((all, own))
    }
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    let clock = Instant::now();
    let (data, _) = inputs::lengths(arguments.lengths.as_ref(), arguments.error_mm)?;
    let target = arguments.target(&data, arguments.target.parse()?)?;
    let is_whole = arguments.tell_left_out(&data, &target)?;
    let ended =
        |outcome| if is_whole || outcome != Outcome::Good { outcome } else { Outcome::SomeRowsRefused };
    if let Some(source) = arguments.body.space() {
        return space_track::fit(source, &target, global).map(ended);
    }
    let settings = FitSettings { method: arguments.method, ..FitSettings::default() };
    let tongue = arguments.body.body()?;
    body::tell_duration("a fit with its verdict", tongue.mesh.nodes.len(), body::FIT_WITH_VERDICT_S);
    let out = global.folder("results")?;
    let model = arguments.body.model();
    let posterior_model = arguments.posterior.posterior_model(&tongue, &model)?;
    let (seen, posture) = arguments.posterior_targets(&data, &target)?;
    let auxiliary = match &posterior_model {
        Some(posterior_model) => arguments.auxiliary.read(posterior_model, &seen, posture)?,
        None => AuxiliaryData::default(),
    };
    output::step(|| {
        format!(
            "{} from {} starts for {} /{}/, {}; contracting: {}",
            name_of(&arguments.method),
            settings.starts,
            target.subject,
            target.vowel,
            target.kind,
            target.active_names().join(", ")
        )
    });
    let (targets, sampling) = (seen.iter().collect::<Vec<_>>(), arguments.posterior.sampling());
    let sampled = posterior_model
        .as_ref()
        .map(|model| PosteriorRun { model, targets: &targets, auxiliary, sampling }.run(&output::tell_step));
    let sampled = sampled.transpose().context("--posterior")?;
    let verdict = match &sampled {
        Some(sampled) => VerdictSource::Posterior(Ok(&sampled.reports[posture])),
        None => VerdictSource::ShortRun,
    };
    let by = super::provenance().with_tissue(TissueModel::of(&tongue.mesh));
    let fit_run = FitRun { target: &target, settings, walls: false, verdict };
    let mut record = fit_run.run(&tongue, &model, &by)?;
    if arguments.lengths.is_some() {
        inputs::tell_lacking(&data, &tongue);
    }
    let Fit { matched, answer, .. } = &record.fit;
    output::step(|| {
        format!("{:?}: misfit {:.1e}, {} equilibria", answer.status, answer.misfit, answer.counts.evaluations)
    });
    output::step(|| match &record.no_verdict {
        None => "verdict made".to_owned(),
        Some(why) => format!("no verdict: {why}"),
    });
    let published = match arguments.lengths {
        None => Published::of(&tongue, &model, &matched.target)?,
        Some(_) => None,
    };

    // With -v the table has a row for a second fit, of the stretches.
    let has_second = target.kind == TargetKind::Ratio && output::is_verbose();
    let stretches = has_second.then(|| arguments.target(&data, TargetKind::Stretch).ok()).flatten();
    let from_stretches = stretches.and_then(|target| FitRun::quick(&target).run(&tongue, &model, &by).ok());

    record.wall_s = Some(clock.elapsed().as_secs_f64());
    record.contrasts = sampled.as_ref().map(|s| s.contrasts.clone()).unwrap_or_default();
    let conclusion = record.conclude().clone();
    let json = record.to_json()?;
    let published_stretches = published
        .as_ref()
        .map(|p| Series { name: "published tensions (Kato 2014)".to_owned(), values: p.stretches.clone() });
    let title = format!(
        "{} /{}/: change of every muscle relative to /{}/",
        target.subject, target.vowel, target.baseline
    );
    let chart = record.changes(&title, &format!("measured ({})", target.subject), published_stretches)?;
    let mut files: Files<'_> = vec![
        ("fit.json", Box::new(json.clone())),
        ("fit.csv", Box::new(record.to_csv()?)),
        ("tongue.svg", Box::new(record.picture(&tongue)?)),
        ("changes.svg", Box::new(chart)),
    ];
    if let Some(curve) = SolutionCurveRecord::of(&record.fit) {
        let of_fit = &record.fit.matched.target;
        let drawing = report::solution_curve(&curve, &of_fit.muscles[of_fit.reference]);
        files.push(("valley.csv", Box::new(curve.table())));
        files.push(("valley.svg", Box::new(drawing)));
    }
    files.extend(sampled.iter().flat_map(|s| s.files(posture)));
    let written = out.export(&files, &by)?;
    if global.json {
        output::print(&json)?;
    } else {
        let fit_summary = ShownFit {
            record: &record,
            conclusion: &conclusion,
            from_stretches: from_stretches.as_ref().map(|second| &second.fit),
            published: published.as_ref(),
            posterior: sampled.as_ref().map(|s| (s, posture)),
            written: &written,
        };
        output::summary(&fit_summary.text(), &written)?;
    }
    Ok(ended(Outcome::of_reasons((!conclusion.trusted).then_some(conclusion.text))))
}
