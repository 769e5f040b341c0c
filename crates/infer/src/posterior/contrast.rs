//! By how much more a muscle pulls in one posture of a speaker than in another.

use serde::{Deserialize, Serialize};

use super::run::{Posterior, Status};
use super::sensitivity::Scaled;
use super::summary::Change;

/// A contrast is decided where the probability of its sign is beyond this.
pub const DECIDED: f64 = 0.95;

/// The difference of a muscle's tensions in two postures that were sampled together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contrast {
    /// The posture in which the tension counts.
    pub posture: String,
    /// The posture whose tension is taken away.
    pub other: String,
    /// The muscle.
    pub muscle: String,
    /// Median difference, N per metre of thickness.
    pub median: f64,
    /// Lower and upper end of its middle 95 %.
    pub interval_95: [f64; 2],
    /// Probability that the muscle pulls harder in the first posture than in the other one.
    pub probability_more: f64,
    /// Whether the prior rather than the data says how large the difference is.
    pub depends_on_prior: bool,
    /// Whether the sign would be told with much less probability under another scale of the prior.
    pub sign_depends_on_prior: bool,
}

impl Contrast {
    /// Every muscle in every pair of postures; none of chains that have not mixed.
    pub fn all(posterior: &Posterior<'_>) -> Vec<Self> {
        if posterior.status != Status::Mixed {
            return Vec::new();
        }
        let density = &posterior.density;
        let scaled = Scaled::new(density, &posterior.draws);
        let (labels, muscles) = (&density.seen.labels, &density.ground.muscles);
        let one = |first: usize, second: usize, m: usize| {
            let values: Vec<f64> =
                posterior.draws.iter().map(|d| d.tension(first, m) - d.tension(second, m)).collect();
            let change = Change::new(&values, &scaled);
            Self {
                posture: labels[first].clone(),
                other: labels[second].clone(),
                muscle: muscles[m].clone(),
                median: change.spread.median,
                interval_95: change.spread.interval_95,
                probability_more: change.probability_rises,
                depends_on_prior: change.depends_on_prior,
                sign_depends_on_prior: change.sign_depends_on_prior,
            }
        };
        let pairs = (0..labels.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        pairs
            .flat_map(|(a, b)| (0..muscles.len()).map(move |m| (a, b, m)))
            .map(|(a, b, m)| one(a, b, m))
            .collect()
    }

    /// Whether it is surely more or surely less.
    pub fn is_decided(&self) -> bool {
        self.probability_more.max(1.0 - self.probability_more) > DECIDED
    }
}
