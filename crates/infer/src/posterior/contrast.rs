//! Differences of a muscle's tension between two postures of a speaker.

use serde::{Deserialize, Serialize};

use super::run::{Posterior, Status};
use super::sensitivity::Scaled;
use super::summary::Change;

/// A contrast is decided where the probability of its sign is larger than this.
pub const DECIDED: f64 = 0.95;

/// The difference of a muscle's tensions in two postures that were sampled together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contrast {
    pub posture: String,
    pub other: String,
    pub muscle: String,
    /// Median difference, N per metre of thickness.
    pub median: f64,
    /// Lower and upper end of the middle 95 % of the difference, N per metre of thickness.
    pub interval_95: [f64; 2],
    /// Probability that the muscle pulls harder in the first posture than in the other one.
    pub probability_more: f64,
    /// Whether the size of the difference depends on the prior more than on the data.
    pub depends_on_prior: bool,
    /// Whether the probability of the sign would be much smaller under another scale of the prior.
    pub sign_depends_on_prior: bool,
}

impl Contrast {
    /// The contrasts of every muscle between every two postures; none if the chains have not mixed.
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

    pub fn is_decided(&self) -> bool {
        self.probability_more.max(1.0 - self.probability_more) > DECIDED
    }
}
