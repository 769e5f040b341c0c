//! Intervals of draws.

use serde::{Deserialize, Serialize};

use super::ornstein_uhlenbeck::Softplus;
use tongue_core::statistics::mean_and_variance;

const TAILS: [f64; 3] = [0.025, 0.5, 0.975];

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    pub median: f64,
    pub low: f64,
    pub high: f64,
    pub variance: f64,
}

impl Interval {
    /// From draws; all values are NaN without draws.
    pub fn of(draws: impl Iterator<Item = f64>) -> Self {
        let mut all: Vec<f64> = draws.collect();
        let count = all.len() as f64;
        let (_, variance) = mean_and_variance(all.iter().copied());
        let mut quantiles = [f64::NAN; 3];
        // The first `done` draws are the smallest ones, in ascending order where a quantile needs it. A full sort takes several times as long.
        let mut done = 0;
        for (quantile, part) in quantiles.iter_mut().zip(TAILS) {
            let at = (part * count - 0.5).clamp(0.0, (count - 1.0).max(0.0));
            let below = at as usize;
            for place in [below, (below + 1).min(all.len().saturating_sub(1))] {
                if place >= done && place < all.len() {
                    all[done..].select_nth_unstable_by(place - done, |a, b| a.total_cmp(b));
                    done = place + 1;
                }
            }
            let (a, b) = (all.get(below), all.get(below + 1).or(all.get(below)));
            *quantile = a.zip(b).map_or(f64::NAN, |(a, b)| a + (at - below as f64) * (b - a));
        }
        let [low, median, high] = quantiles;
        Self { median, low, high, variance }
    }

    /// Extends the interval of a tension that begins below [`Softplus::slack_n`] to 0, because a slack muscle cannot be distinguished there
    /// from one that pulls weakly.
    pub(super) fn or_slack(mut self, link: &Softplus) -> Self {
        if self.low < link.slack_n() {
            self.low = 0.0;
        }
        self
    }

    pub fn width(&self) -> f64 {
        self.high - self.low
    }

    pub fn holds(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

pub(super) fn interval(draws: &[f32]) -> Interval {
    Interval::of(draws.iter().map(|d| f64::from(*d)))
}
