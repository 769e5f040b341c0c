//! Results of a validation, as they are written to files.

#[cfg(test)]
use serde::Deserialize;
use serde::Serialize;

use tongue_input::measured::Vowel;

use super::posterior::PosteriorStudy;
use crate::report::ByMuscle;

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct ScoredOpponent {
    pub name: String,
    pub what: String,
    pub tuned_parameters: usize,
    pub rms: f64,
    /// Lower end of the 95 % interval by bootstraps over fits.
    pub low: f64,
    pub high: f64,
    pub worse_than_no_change: usize,
    /// Part of the bootstraps in which it is better than the constant.
    pub better_than_constant: f64,
    /// Pearson's correlation of predicted and measured stretches; null if the predictions do not vary.
    pub correlation: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct Prediction {
    pub subject: String,
    pub vowel: Vowel,
    pub muscle: String,
    pub measured: f64,
    #[serde(flatten)]
    #[cfg_attr(test, serde(deserialize_with = "in_order"))]
    pub predicted: ByMuscle<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub struct ValidationStudy {
    pub data: String,
    pub baseline: Vowel,
    pub poisson_ratio: f64,
    pub subjects: Vec<String>,
    pub fits: usize,
    pub seed: u64,
    pub opponents: Vec<ScoredOpponent>,
    pub predictions: Vec<Prediction>,
    /// Validation of the posterior, with every muscle predicted as a distribution from all others; null if it
    /// was not asked for or the body has no posterior.
    pub posterior: Option<PosteriorStudy>,
}

#[cfg(test)]
fn in_order<'de, D: serde::Deserializer<'de>>(from: D) -> Result<ByMuscle<f64>, D::Error> {
    let all = serde_json::Map::deserialize(from)?;
    Ok(ByMuscle(all.into_iter().filter_map(|(name, value)| Some((name, value.as_f64()?))).collect()))
}
