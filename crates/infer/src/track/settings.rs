//! How a recording is tracked.

use super::chain::Prior;
use super::scores;

/// How the scores of a recording are found.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// What is assumed of the tensions.
    pub prior: Prior,
    /// Upper bound of every tension, N per metre of thickness: more than this is told as a bound.
    pub upper_n: f64,
    /// Whether every frame is checked to lie on the branch of equilibria that begins at rest.
    pub branch: bool,
    /// Most rounds of the smoother.
    pub rounds: usize,
}

impl Settings {
    /// With this prior, and everything else as is usual.
    pub fn new(prior: Prior) -> Self {
        let upper_n = prior.scale_n * scores::tension(scores::HIGHEST).0 * 0.9;
        Self { prior, upper_n, branch: true, rounds: 12 }
    }
}
