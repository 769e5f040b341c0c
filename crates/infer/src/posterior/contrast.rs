//! Differences of a muscle's tension between two postures or labels of a speaker.

use serde::{Deserialize, Serialize};

use super::quantiles::{Quantiles, part_above_zero};
use super::run::Posterior;
use super::sensitivity::Scaled;
use super::summary::Change;
use super::verdict::Certainty;

/// Difference of a muscle's tension between two postures sampled together, or between its means over two labels of recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contrast {
    pub muscle: String,
    pub a: String,
    pub b: String,
    /// Median of the difference, `a` less `b`, N per metre of thickness.
    pub median: f64,
    /// Interval of the difference, N per metre of thickness.
    pub interval_95: [f64; 2],
    pub probability_more: f64,
    #[serde(rename = "word")]
    pub certainty: Certainty,
    /// Repetitions of each label; `None` for postures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repetitions: Option<[usize; 2]>,
    /// Whether the size of the difference depends on the prior more than on the data; `None` where that is not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depends_on_prior: Option<bool>,
    /// Whether the sign would be much less probable under another scale of the prior; `None` where that is not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sign_depends_on_prior: Option<bool>,
}

impl Contrast {
    pub fn of(muscle: &str, [a, b]: [&str; 2], draws: &[f64]) -> Self {
        let (spread, probability_more) = (Quantiles::of(draws.iter().copied()), part_above_zero(draws));
        Self {
            muscle: muscle.to_owned(),
            a: a.to_owned(),
            b: b.to_owned(),
            median: spread.median,
            interval_95: spread.interval_95,
            probability_more,
            certainty: Certainty::of(probability_more),
            repetitions: None,
            depends_on_prior: None,
            sign_depends_on_prior: None,
        }
    }

    /// Contrasts of every muscle whose tension is not fixed between every two postures; none if the chains have not mixed.
    pub fn all(posterior: &Posterior<'_>) -> Vec<Self> {
        if !posterior.is_mixed() {
            return Vec::new();
        }
        let problem = &posterior.problem;
        let scaled = Scaled::new(problem, &posterior.draws);
        let (labels, muscles) = (&problem.measurements.labels, &problem.posterior_model.muscles);
        let pairs = (0..labels.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        let each = pairs.flat_map(|(a, b)| (0..muscles.len()).map(move |m| (a, b, m)));
        let priors = &problem.posterior_model.priors;
        let free = each.filter(|(_, _, m)| priors.fixed_tension(&muscles[*m]).is_none());
        Vec::from_iter(free.map(|(first, second, m)| {
            let values: Vec<f64> =
                posterior.draws.iter().map(|d| d.tension(first, m) - d.tension(second, m)).collect();
            let change = Change::new(&values, &scaled);
            Self {
                depends_on_prior: Some(change.depends_on_prior),
                sign_depends_on_prior: Some(change.sign_depends_on_prior),
                ..Self::of(&muscles[m], [&labels[first], &labels[second]], &values)
            }
        }))
    }

    /// Median and interval, N per metre of thickness, with the sign that makes the median positive.
    pub fn size(&self) -> [f64; 3] {
        let [low, high] = self.interval_95;
        if self.median < 0.0 { [-self.median, -high, -low] } else { [self.median, low, high] }
    }

    /// Such as "HGa: surely harder in /a/ than in /u/"; `None` where neither is probable.
    pub fn sentence(&self) -> Option<String> {
        let (is_harder_in_a, is_sure) = self.certainty.decision()?;
        let how = if is_sure { "surely" } else { "probably" };
        let labels = if is_harder_in_a { [&self.a, &self.b] } else { [&self.b, &self.a] };
        let [more, less] = labels.map(|label| quoted(label));
        Some(format!("{}: {how} harder in {more} than in {less}", self.muscle))
    }

    pub fn is_decided(&self) -> bool {
        matches!(self.certainty.decision(), Some((_, true)))
    }
}

/// A label in a sentence: a sound of one or two letters between slashes, a longer label, such as a word, in quotes.
pub(super) fn quoted(label: &str) -> String {
    if label.chars().count() <= 2 { format!("/{label}/") } else { format!("“{label}”") }
}
