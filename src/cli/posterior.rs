//! `--posterior N`: the posterior of one fit.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use tongue_fit::body::Body;
use tongue_fit::inner::posterior::{PosteriorModel, Priors, Quantiles, Sampling, StretchSummary, Summary};
use tongue_fit::inner::report::{probability, range, with_decimals};
use tongue_fit::inner::run::SampledPosterior;
use tongue_fit::measured::{Dataset, Target};
use tongue_fit::system::Model;

use super::table::{difference, rows};
use super::{Global, body, inputs, output};

pub const ACTIVE_BASELINE: &str = " (muscles pull there too: less sure than against /ɯ/)";

const SECONDS_A_DRAW: f64 = 3.5e-3;

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Posterior")]
pub struct Arguments {
    /// Number of draws from the posterior of the tensions. It uses all measured stretches, lets every muscle pull, and includes baseline
    /// posture, hyoid, anatomy, constants and the model's own error. Its assumptions are --priors, not those of the fit (--muscles,
    /// --poisson-ratio). An interval needs 400 effective draws: 1000 draws mostly have them, fewer than 500 seldom do; for a continuum take
    /// 2000
    #[arg(long, value_name = "N")]
    pub posterior: Option<usize>,
    /// Priors of the posterior (TOML) instead of the built-in ones, which `tongue-fit priors` prints
    #[arg(long, value_name = "FILE", requires = "posterior", hide_short_help = true)]
    priors: Option<PathBuf>,
    /// Seed of the posterior's draws
    #[arg(long, value_name = "N", default_value_t = 1, requires = "posterior", hide_short_help = true)]
    posterior_seed: u64,
    /// Sample the vowels of a subject in the table together, for contrasts between vowels: they share the baseline, the body and the
    /// hyoid's tilt. Takes half a minute a subject
    #[arg(long, requires = "posterior", hide_short_help = true)]
    pub joint: bool,
}

pub fn priors(global: &Global) -> Result<()> {
    if global.json {
        return output::print(&output::json(&Priors::default())?);
    }
    let text = toml::to_string(&Priors::default())?;
    let fixed = Priors::standard_deviations()
        .iter()
        .map(|e| format!("# {} = {} # {}\n", e.name.to_lowercase(), e.value, e.what));
    output::print(&format!(
        "{text}\n# Further numbers of the model, which this file does not change:\n{}",
        fixed.collect::<String>()
    ))
}

impl Arguments {
    pub fn posterior_model(&self, body: &Body<2>, model: &Model) -> Result<Option<PosteriorModel>> {
        if self.posterior.is_none() {
            return Ok(None);
        }
        self.sampling().check()?;
        let priors = match &self.priors {
            None => Priors::default(),
            Some(path) => {
                let origin = path.display().to_string();
                let text = inputs::text("--priors", path)?;
                let priors = Priors::from_toml(&text, &origin)?;
                priors.doubts().iter().for_each(|doubt| output::note(&format!("{origin}: {doubt}")));
                priors
            }
        };
        let (draws, growth) = (self.sampling().draws, body::growth(body.mesh.nodes.len()));
        let seconds = draws as f64 * SECONDS_A_DRAW * growth;
        output::tell_duration(&format!("--posterior {draws}"), seconds, "fewer draws are faster");
        let posterior_model = PosteriorModel::new(body, model, &priors);
        Ok(Some(match &self.priors {
            Some(path) => posterior_model.with_context(|| format!("--priors {}", path.display()))?,
            None => posterior_model?,
        }))
    }

    /// Refuses to sample several vowels together against one in which muscles pull where the table has /ɯ/: the answer would depend on which
    /// of the same rows is called the baseline.
    pub fn check_baseline(&self, data: &Dataset, target: &Target) -> Result<()> {
        ensure!(
            !self.joint || !target.has_active_baseline() || data.baseline(&target.subject).is_err(),
            "--joint samples the vowels of {} against /ɯ/, which the table has; leave out --baseline, and read the difference to /{}/ among the \
             contrasts",
            target.subject,
            target.baseline
        );
        Ok(())
    }

    pub fn sampling(&self) -> Sampling {
        Sampling { draws: self.posterior.unwrap_or_default(), seed: self.posterior_seed }
    }
}

/// A table of every tension of a posture with its intervals; with `-v` also one of every stretch.
pub fn text(sampled: &SampledPosterior<'_>, posture: usize) -> String {
    let report = &sampled.reports[posture];
    let seen = &sampled.posterior.problem.measurements;
    let others = seen.labels.iter().enumerate().filter(|(p, _)| *p != posture);
    let others: Vec<String> = others.map(|(_, label)| format!("/{label}/")).collect();
    let mut text = format!(
        "\nPOSTERIOR of {} against /{}/{}{}: all {}{}, every muscle may pull\n",
        sampled.what(posture),
        sampled.baseline,
        if sampled.posterior.problem.has_active_baseline() { ACTIVE_BASELINE } else { "" },
        if others.is_empty() { String::new() } else { format!(", with {}", others.join(", ")) },
        match seen.of_posture(posture).len() {
            1 => "that was measured, one stretch".to_owned(),
            n => format!("{n} measured stretches"),
        },
        match seen.auxiliary.len() {
            0 => String::new(),
            n => format!(" and {n} numbers of contours, coils or EMG"),
        }
    );
    match &report.summary {
        Some(summary) => {
            text += &changes(summary);
            if output::is_verbose() {
                text += &details(summary);
            }
        }
        None => {
            let _ = writeln!(text, "NOT MIXED: {}; no interval is printed", report.diagnostics.why);
        }
    }
    text += &contrasts(sampled, posture);
    let run = &report.diagnostics;
    if run.draws == 0 {
        return text;
    }
    let _ = writeln!(
        text,
        "{} draws of shapes that their tensions reach from rest; {:.0} % of the tried draws were accepted, {} had no equilibrium, {} trajectories diverged; \
         R-hat {:.3}, ESS {:.0}; {:.0} ms",
        run.draws,
        100.0 * run.accepted,
        run.folds,
        run.divergences,
        run.r_hat,
        run.ess.bulk.min(run.ess.tail),
        1e3 * sampled.wall_s
    );
    text
}

/// Sentences about muscles whose tension surely differs between a posture and others that were sampled with it.
fn contrasts(sampled: &SampledPosterior<'_>, posture: usize) -> String {
    let own = &sampled.posterior.problem.measurements.labels[posture];
    let sure = sampled.contrasts.iter().filter(|c| c.is_decided() && [&c.a, &c.b].contains(&own));
    sure.map(|c| difference(c) + "\n").collect()
}

fn changes(summary: &Summary) -> String {
    let header = ["muscle", "F - F0, N/m", "50 %", "95 %", "P(rises)", "F, 95 %", "F0, 95 %"];
    let t = rows(&header, summary.changes_n.0.iter().enumerate(), |(i, (muscle, change))| {
        let tension = &summary.tensions_n.0[i].1;
        [
            muscle.clone(),
            with_decimals(change.spread.median, 0),
            range(change.spread.interval_50, 0),
            format!("{}{}", interval(&change.spread), if change.depends_on_prior { "°" } else { "" }),
            change.probability_rises.map_or("fixed".to_owned(), |p| {
                probability(p) + if change.sign_depends_on_prior { "‡" } else { "" }
            }),
            format!("{}{}", interval(&tension.spread), if tension.depends_on_prior { "°" } else { "" }),
            interval(&summary.baseline_tensions_n.0[i].1),
        ]
    });
    let mut text = format!("\n{t}\n");
    let changes = || summary.changes_n.0.iter().map(|(_, c)| c);
    if summary.tensions_n.0.iter().any(|(_, t)| t.depends_on_prior) || changes().any(|c| c.depends_on_prior) {
        text += "° the prior of tensions decides how large it is, more than the data do\n";
    }
    if changes().any(|c| c.sign_depends_on_prior) {
        text += "‡ less sure under half or twice the scale of that prior\n";
    }
    text
}

fn interval(s: &Quantiles) -> String {
    if s.is_fixed() { with_decimals(s.median, 0) + " (fixed)" } else { range(s.interval_95, 0) }
}

fn details(summary: &Summary) -> String {
    let mut text = "Young's modulus scales all tensions and is not in these intervals\n".to_owned();
    let header = ["muscle", "stretch measured", "fitted, 95 %", "without its own, 95 %"];
    let t = rows(&header, &summary.stretches.0, |(muscle, s)| {
        let left_out = s.left_out.as_ref().map_or_else(
            || "-".to_owned(),
            |l| range(l.spread.interval_95, 2) + if l.spread.holds(s.measured) { "" } else { " !" },
        );
        [muscle.clone(), format!("{:.3}", s.measured), range(s.fitted.interval_95, 2), left_out]
    });
    let _ = writeln!(text, "\n{t}");
    let any = |is: &dyn Fn(&StretchSummary) -> bool| summary.stretches.0.iter().any(|(_, s)| is(s));
    if any(&|s| s.left_out.as_ref().is_some_and(|l| !l.spread.holds(s.measured))) {
        text += "! measured outside\n";
    }
    if any(&|s| s.left_out.is_none()) {
        text += "- no chain could begin without its own measurement\n";
    }
    text
}
