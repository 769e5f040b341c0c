//! Predictors without mechanics, and statistics of all predictors.

use nalgebra::{DMatrix, DVector};

use super::cases::Case;
use tongue_core::statistics::{distinct, least_by};

/// Estimator of a normal distribution from few rows: its mean and its regularised covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shrunk {
    /// Whether the mean is one (no change) in place of the mean of the rows.
    about_no_change: bool,
    /// Whether the mean variance is added to the diagonal (a ridge) in place of shrinking towards the diagonal.
    ridge: bool,
    by: f64,
}

impl Shrunk {
    fn all() -> impl Iterator<Item = Self> {
        let shares = [0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 1.0].map(|by| (false, by));
        let ridges = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0].map(|by| (true, by));
        let both = [false, true].into_iter();
        both.flat_map(move |about_no_change| {
            shares.into_iter().chain(ridges).map(move |(ridge, by)| Self { about_no_change, ridge, by })
        })
    }
}

const MIDDLE: Shrunk = Shrunk { about_no_change: true, ridge: false, by: 0.5 };
const LEAST_VARIANCE: f64 = 1e-6;

/// Mean measured stretch of the muscles that cases predict; 1 if there are none.
pub fn constant<'a>(training: impl IntoIterator<Item = &'a Case>) -> f64 {
    let all: Vec<f64> =
        training.into_iter().flat_map(|c| c.unseen.iter().map(|&m| c.target().values[m])).collect();
    if all.is_empty() { 1.0 } else { all.iter().sum::<f64>() / all.len() as f64 }
}

/// Mean and variance of each stretch given the seen ones, under a normal distribution fitted to other subjects; seen stretches have zero
/// variance. `None` with fewer than two rows to learn from.
pub fn conditional_normal(training: &[&Case], case: &Case, how: Shrunk) -> Option<Vec<(f64, f64)>> {
    let muscles = &case.target().muscles;
    let row = |c: &&Case| muscles.iter().map(|m| c.stretch_of(m)).collect::<Option<Vec<f64>>>();
    let rows: Vec<DVector<f64>> = training.iter().filter_map(row).map(DVector::from_vec).collect();
    if rows.len() < 2 {
        return None;
    }
    let mean = if how.about_no_change {
        DVector::from_element(muscles.len(), 1.0)
    } else {
        rows.iter().sum::<DVector<f64>>() / rows.len() as f64
    };
    // A mean that is computed from the rows takes one degree of freedom.
    let degrees = rows.len() - usize::from(!how.about_no_change);
    let mut covariance = DMatrix::zeros(muscles.len(), muscles.len());
    for row in &rows {
        let off = row - &mean;
        covariance += &off * off.transpose() / degrees as f64;
    }
    let ridge = covariance.trace() / muscles.len() as f64;
    let shrunk = DMatrix::from_fn(muscles.len(), muscles.len(), |i, j| {
        let value = covariance[(i, j)];
        match (i == j, how.ridge) {
            (true, true) => f64::max(value + how.by * ridge, LEAST_VARIANCE),
            (false, true) => value,
            (true, false) => f64::max(value, LEAST_VARIANCE),
            (false, false) => (1.0 - how.by) * value,
        }
    });
    let seen: Vec<usize> = (0..muscles.len()).filter(|m| !case.unseen.contains(m)).collect();
    let off = DVector::from_iterator(seen.len(), seen.iter().map(|&m| case.target().values[m] - mean[m]));
    let factor = shrunk.select_rows(&seen).select_columns(&seen).cholesky()?;
    let weights = factor.solve(&off);
    let mut expected: Vec<(f64, f64)> = case.target().values.iter().map(|v| (*v, 0.0)).collect();
    for &m in &case.unseen {
        let row = DVector::from_iterator(seen.len(), seen.iter().map(|&s| shrunk[(m, s)]));
        let across: f64 = row.iter().zip(weights.iter()).map(|(r, w)| r * w).sum();
        expected[m] = (mean[m] + across, shrunk[(m, m)] - row.dot(&factor.solve(&row)));
    }
    Some(expected)
}

/// The estimator that predicts each muscle of each training subject best, from its other muscles and the other subjects.
pub fn best_shrunk(training: &[&Case]) -> Shrunk {
    let names = distinct(training.iter().map(|c| c.target().subject.as_str()));
    if names.len() < 2 {
        return MIDDLE;
    }
    let errors = Shrunk::all().map(|how| {
        let errors = names.iter().map(|name: &&str| -> f64 {
            let (inner, left): (Vec<&Case>, Vec<&Case>) =
                training.iter().partition(|c| c.target().subject != *name);
            left.into_iter()
                .flat_map(Case::each_left_out)
                .map(|case| match conditional_normal(&inner, &case, how) {
                    Some(normal) => case.error(&normal.into_iter().map(|(mean, _)| mean).collect::<Vec<_>>()),
                    None => case.error(&vec![1.0; case.target().muscles.len()]),
                })
                .sum()
        });
        (errors.sum::<f64>(), how)
    });
    least_by(errors, |e| e.0).map_or(MIDDLE, |(_, how)| how)
}

pub fn root_mean(squares: &[f64]) -> f64 {
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Bootstrap samples: `draws` lists of `count` indices below `count`, with repetition.
pub fn bootstraps(count: usize, draws: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..draws).map(|_| (0..count).map(|_| random.usize(0..count)).collect()).collect()
}

/// The range of the middle 95 % of the values.
pub fn middle(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|part| values[((values.len() - 1) as f64 * part).round() as usize])
}

/// Pearson's correlation; `None` if one of the two does not vary.
pub fn correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = pairs.len() as f64;
    let (a, b) = pairs.iter().fold((0.0, 0.0), |(a, b), p| (a + p.0 / n, b + p.1 / n));
    let sum = |of: fn(f64, f64) -> f64| pairs.iter().map(|p| of(p.0 - a, p.1 - b)).sum::<f64>();
    let spread = (sum(|x, _| x * x) * sum(|_, y| y * y)).sqrt();
    (spread > 1e-12).then(|| sum(|x, y| x * y) / spread)
}
