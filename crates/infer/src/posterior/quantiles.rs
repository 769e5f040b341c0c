//! Summary statistics of draws.

use serde::Serialize;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantiles {
    pub mean: f64,
    pub median: f64,
    pub interval_50: [f64; 2],
    pub interval_95: [f64; 2],
}

/// Part of the values that are above zero; a zero counts as half.
pub(super) fn part_above_zero(values: &[f64]) -> f64 {
    let parts = values.iter().map(|&v| 0.5 * (f64::from(v > 0.0) + f64::from(v >= 0.0)));
    parts.sum::<f64>() / values.len().max(1) as f64
}

impl Quantiles {
    /// Of draws with equal weights, so many that their number need not widen intervals; not finite without draws.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        Self::of_few(values, f64::INFINITY)
    }

    /// [`Self::of`] of draws that are worth `effective` independent ones.
    pub fn of_few(values: impl IntoIterator<Item = f64>, effective: f64) -> Self {
        Self::weighted(values.into_iter().map(|v| (v, 1.0)).collect(), effective)
    }

    /// Of pairs of a value and its weight, which are worth `effective` independent draws. Below the quantile of `p` lies on average `p` of
    /// the distribution (Weibull 1939; the sixth definition of Hyndman and Fan, The American Statistician 50, 1996): of few draws an
    /// interval is wider than the one that contains 95 % of them.
    pub fn weighted(mut draws: Vec<(f64, f64)>, effective: f64) -> Self {
        draws.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = draws.iter().map(|d| d.1).sum();
        let mean = draws.iter().map(|d| d.0 * d.1).sum::<f64>() / total;
        // Half of a draw's weight lies on either side of it; quantiles between draws are interpolated linearly.
        let mut reached = 0.0;
        let places: Vec<f64> = draws
            .iter()
            .map(|d| {
                reached += d.1;
                (reached - 0.5 * d.1) / total
            })
            .collect();
        let at = |p: f64| -> f64 {
            let p = p + (p - 0.5) / effective;
            let above = places.partition_point(|q| *q < p);
            match (above, draws.get(above)) {
                (_, None) => draws.last().map_or(f64::NAN, |d| d.0),
                (0, Some(first)) => first.0,
                (i, Some(next)) => {
                    let (before, q) = (draws[i - 1].0, places[i - 1]);
                    before + (next.0 - before) * (p - q) / (places[i] - q).max(f64::MIN_POSITIVE)
                }
            }
        };
        Self { mean, median: at(0.5), interval_50: [at(0.25), at(0.75)], interval_95: [at(0.025), at(0.975)] }
    }

    /// Whether the draws are all the same, because the priors fix the number.
    pub fn is_fixed(&self) -> bool {
        self.interval_95[0] == self.interval_95[1]
    }

    pub fn holds(&self, value: f64) -> bool {
        (self.interval_95[0]..=self.interval_95[1]).contains(&value)
    }

    pub fn holds_in_half(&self, value: f64) -> bool {
        (self.interval_50[0]..=self.interval_50[1]).contains(&value)
    }
}

/// Shares that add up to one, from logarithms, and the logarithm of the sum.
pub(super) fn shares(logs: impl Iterator<Item = f64> + Clone) -> (Vec<f64>, f64) {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.clone().map(|l| (l - most).exp()).sum();
    (logs.map(|l| (l - most).exp() / sum).collect(), most + sum.ln())
}

/// Effective number of weighted draws (Kish 1965).
pub fn effective(weights: &[f64]) -> f64 {
    let (sum, squares) = weights.iter().fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
    if squares > 0.0 { sum * sum / squares } else { 0.0 }
}
