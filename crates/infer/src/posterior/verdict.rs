//! The first lines of a report: which muscles pull harder than in the baseline, with what probability, and how hard.

use serde::{Deserialize, Serialize};

use crate::inverse::TargetOnBody;
use tongue_core::body::{Body, HYOID};
use tongue_core::choice::name_of;
use tongue_core::system::Model;
use tongue_input::measured::Target;

use super::PosteriorError;
use super::diagnostics::mixing;
use super::measurements::Measurements;
use super::model::PosteriorModel;
use super::parameters::Draw;
use super::priors::Priors;
use super::problem::PosteriorProblem;
use super::quantiles::{Quantiles, part_above_zero};
use super::run::short_run;
use super::sensitivity::Scaled;
use super::summary::{Report, is_of_prior, moved_by_prior};

/// Probability from which a muscle "surely" pulls harder, or not harder.
pub const DECIDED: f64 = 0.95;
/// Probability from which a muscle "probably" pulls harder, or not harder.
pub const PROBABLE: f64 = 0.8;

/// Certainty that a muscle pulls harder than in the baseline, by its probability P.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Certainty {
    /// P is at least .95.
    #[serde(rename = "surely harder")]
    SurelyHarder,
    /// P is at least .8.
    #[serde(rename = "probably harder")]
    ProbablyHarder,
    /// P is between .2 and .8.
    #[serde(rename = "not known")]
    NotKnown,
    /// P is at most .2.
    #[serde(rename = "probably not harder")]
    ProbablyNotHarder,
    /// P is at most .05.
    #[serde(rename = "surely not harder")]
    SurelyNotHarder,
    /// The priors fix both tensions.
    #[serde(rename = "fixed")]
    Fixed,
}

impl Certainty {
    pub fn of(p_rises: f64) -> Self {
        match p_rises {
            p if p >= DECIDED => Self::SurelyHarder,
            p if p >= PROBABLE => Self::ProbablyHarder,
            p if 1.0 - p >= DECIDED => Self::SurelyNotHarder,
            p if 1.0 - p >= PROBABLE => Self::ProbablyNotHarder,
            _ => Self::NotKnown,
        }
    }

    pub fn text(self) -> &'static str {
        name_of(&self)
    }

    /// Whether the muscle pulls harder, and whether that is sure; `None` where neither is probable.
    pub(super) fn decision(self) -> Option<(bool, bool)> {
        match self {
            Self::SurelyHarder => Some((true, true)),
            Self::ProbablyHarder => Some((true, false)),
            Self::NotKnown | Self::Fixed => None,
            Self::ProbablyNotHarder => Some((false, false)),
            Self::SurelyNotHarder => Some((false, true)),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MuscleVerdict {
    pub muscle: String,
    /// Probability of pulling harder than in the baseline; `None` (null) where the priors fix both tensions.
    pub p_rises: Option<f64>,
    #[serde(rename = "word")]
    pub certainty: Certainty,
    pub tension_n_per_m: [f64; 2],
    /// Whether the size of the tension depends on the prior more than on the data.
    pub mostly_prior: bool,
}

impl MuscleVerdict {
    fn new(muscle: &str, p_rises: Option<f64>, tension_n_per_m: [f64; 2], mostly_prior: bool) -> Self {
        let (muscle, certainty) = (muscle.to_owned(), p_rises.map_or(Certainty::Fixed, Certainty::of));
        Self { muscle, p_rises, certainty, tension_n_per_m, mostly_prior }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictFrom {
    /// A short run of the sampler: 240 draws, probabilities to about 0.05.
    ShortRun,
    Draws,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    #[serde(rename = "verdict_from")]
    pub from: VerdictFrom,
    /// 95 % intervals of the hyoid's displacement, mm: to the back and up. `None` where it is fixed.
    #[serde(rename = "verdict_hyoid_mm", default, skip_serializing_if = "Option::is_none")]
    pub hyoid_mm: Option<[[f64; 2]; 2]>,
    /// In the order of the body's muscles.
    #[serde(rename = "verdict")]
    pub muscles: Vec<MuscleVerdict>,
}

/// The short run of a verdict, under the default priors. Its groups of chains may be run in different places, with the same bits.
#[derive(Debug)]
pub struct ShortRun {
    posterior_model: PosteriorModel,
    measurements: Measurements,
}

impl ShortRun {
    pub fn new(body: &Body<2>, model: &Model, target: &Target) -> Result<Self, PosteriorError> {
        if body.mesh.continuum.is_some() {
            let why = "in a continuum it takes minutes; --posterior 2000 computes it";
            return Err(PosteriorError::Refused(why.to_owned()));
        }
        let matched = TargetOnBody::new(&body.mesh, target);
        let matched = matched.map_err(|e| PosteriorError::Refused(e.to_string()))?;
        let mut priors = Priors::default();
        priors.hyoid.off = body.bone(HYOID).is_empty();
        let posterior_model = PosteriorModel::new(body, model, &priors)?;
        Ok(Self { posterior_model, measurements: Measurements::of_vowel(&matched) })
    }

    /// The draws of group 0 or 1 of the chains, or of both; none if the chains cannot begin. An error if the lengths contradict the model.
    pub fn draws(&self, group: Option<usize>) -> Result<Vec<Draw>, PosteriorError> {
        let mut problem = PosteriorProblem::new(&self.posterior_model, self.measurements.clone())?;
        let map_estimate = problem.map()?;
        map_estimate.check_data(&problem)?;
        short_run(&problem, &map_estimate, group)
    }

    pub fn verdict(&self, draws: &[Draw]) -> Result<Verdict, PosteriorError> {
        if draws.is_empty() {
            return Err(PosteriorError::NoMode);
        }
        let posterior_model = &self.posterior_model;
        let scaled = Scaled::new(&PosteriorProblem::new(posterior_model, self.measurements.clone())?, draws);
        let verdicts = posterior_model.muscles.iter().enumerate().map(|(m, muscle)| {
            let tensions: Vec<f64> = draws.iter().map(|d| d.tension(0, m)).collect();
            let interval = short_run_interval(draws, |d| d.tension(0, m));
            let moved = moved_by_prior(posterior_model, m, &tensions, interval[1]);
            let changes: Vec<f64> = draws.iter().map(|d| d.change(0, m)).collect();
            let p_rises = Some(part_above_zero(&changes));
            MuscleVerdict::new(muscle, p_rises, interval, is_of_prior(moved, &scaled.evaluate(&tensions)))
        });
        let hyoid_mm = posterior_model.moves_hyoid().then(|| {
            [0, 1].map(|axis| short_run_interval(draws, |d| 1e3 * d.values.postures[0].hyoid[axis]))
        });
        Ok(Verdict { from: VerdictFrom::ShortRun, hyoid_mm, muscles: verdicts.collect() })
    }
}

impl Verdict {
    /// The verdict from a short run under the default priors.
    pub fn of_target(body: &Body<2>, model: &Model, target: &Target) -> Result<Self, PosteriorError> {
        let run = ShortRun::new(body, model, target)?;
        run.draws(None).and_then(|draws| run.verdict(&draws))
    }

    /// The verdict of a posterior; `None` if its chains have not mixed.
    pub fn of(report: &Report) -> Option<Self> {
        let summary = report.summary.as_ref()?;
        let each = summary.changes_n.0.iter().zip(&summary.tensions_n.0);
        let verdicts = each.map(|((muscle, change), (_, t))| {
            MuscleVerdict::new(muscle, change.probability_rises, t.spread.interval_95, t.depends_on_prior)
        });
        let hyoid_mm = (!report.priors.hyoid.off && report.priors.hyoid.fixed_mm.is_none())
            .then(|| summary.hyoid_mm.map(|s| s.interval_95));
        Some(Self { from: VerdictFrom::Draws, hyoid_mm, muscles: verdicts.collect() })
    }

    pub fn named(&self, certainty: Certainty) -> Vec<&str> {
        self.muscles.iter().filter(|m| m.certainty == certainty).map(|m| m.muscle.as_str()).collect()
    }

    /// Three sentences: which muscles pull harder than in the baseline or not, for which that is unknown, and how hard the former pull.
    pub fn sentences(&self, baseline: &str) -> [String; 3] {
        let two = |surely: Certainty, probably: Certainty| {
            let parts = [("surely", surely), ("probably", probably)]
                .map(|(how, certainty)| (how, self.named(certainty)));
            let named = parts.iter().filter(|(_, names)| !names.is_empty());
            named.map(|(how, names)| format!("{how}: {}", names.join(", "))).collect::<Vec<_>>().join("; ")
        };
        let harder = match two(Certainty::SurelyHarder, Certainty::ProbablyHarder) {
            none if none.is_empty() => format!("No muscle is known to pull harder than in /{baseline}/."),
            names => format!("Harder than in /{baseline}/, {names}."),
        };
        let not = match two(Certainty::SurelyNotHarder, Certainty::ProbablyNotHarder) {
            none if none.is_empty() => String::new(),
            names => format!(" Not harder, {names}."),
        };
        let open = match self.named(Certainty::NotKnown) {
            none if none.is_empty() => "Every muscle is decided.".to_owned(),
            names => format!("Not known: {}.", names.join(", ")),
        };
        let fixed = self.named(Certainty::Fixed).join(", ");
        let fixed = if fixed.is_empty() { fixed } else { format!(" Fixed by the priors: {fixed}.") };
        [harder + &not, open + &fixed, self.how_hard()]
    }

    fn how_hard(&self) -> String {
        let harder: Vec<&MuscleVerdict> =
            self.muscles.iter().filter(|m| matches!(m.certainty.decision(), Some((true, _)))).collect();
        let notes = [(false, ""), (true, " (more from prior than data)")];
        let parts = Vec::from_iter(notes.into_iter().filter_map(|(of_prior, note)| {
            let own = harder.iter().filter(|m| m.mostly_prior == of_prior);
            let ranges: Vec<String> = own
                .map(|m| match m.tension_n_per_m {
                    [low, high] if low == high => format!("{} {low:.0} (fixed)", m.muscle),
                    [low, high] => format!("{} {low:.0} to {high:.0}", m.muscle),
                })
                .collect();
            (!ranges.is_empty()).then(|| format!("{} N/m{note}", ranges.join(", ")))
        }));
        if parts.is_empty() {
            "No muscle is known to pull harder, so no tension is listed.".into()
        } else {
            format!("How hard: {}.", parts.join("; "))
        }
    }
}

/// 95 % interval of a number from the draws of a short run, widened because they are worth few independent draws.
pub fn short_run_interval(draws: &[Draw], value: impl Fn(&Draw) -> f64) -> [f64; 2] {
    let chains = draws.chunk_by(|a, b| a.chain == b.chain);
    let chains: Vec<Vec<f64>> = chains.map(|chain| chain.iter().map(&value).collect()).collect();
    let found = mixing(&chains);
    Quantiles::of_few(draws.iter().map(value), found.bulk.min(found.tail)).interval_95
}
