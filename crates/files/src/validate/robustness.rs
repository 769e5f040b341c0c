//! Robustness: permuted names of muscles.

use tongue_core::body::Mesh;
use tongue_core::parallel;
use tongue_infer::inverse::{FitError, Setup};
use tongue_input::measured::{Dataset, Lengths, Vowel};

use super::cases::{Case, cases, of_rows};
use super::levers::{Bench, Levers, best_column, errors};
use super::statistics::root_mean;
use super::{Permuted, Progress, ValidationError};

/// Mean square error of each case, at the tone that is best for the other subjects.
fn tuned_outside(cases: &[Case], errors: &[Vec<f64>]) -> Vec<f64> {
    let judged = |row: usize| {
        let column = best_column(errors, |other| cases[other].subject != cases[row].subject);
        errors[row][column]
    };
    (0..cases.len()).map(judged).collect()
}

/// `count` permutations of the muscles, without the identity.
pub fn orders(muscles: usize, count: u64, seed: u64) -> Vec<Vec<usize>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut orders = Vec::new();
    while muscles > 2 && (orders.len() as u64) < count {
        let mut order: Vec<usize> = (0..muscles).collect();
        random.shuffle(&mut order);
        if order.iter().enumerate().any(|(i, o)| i != *o) {
            orders.push(order);
        }
    }
    orders
}

/// Lengths under permuted names of muscles.
pub fn renamed(lengths: &Lengths, order: &[usize]) -> Lengths {
    Lengths {
        length_mm: order.iter().map(|&o| lengths.length_mm[o]).collect(),
        half_width_mm: order.iter().map(|&o| lengths.half_width_mm[o]).collect(),
        ..lengths.clone()
    }
}

/// Errors with permuted names of muscles; the tone is tuned for every permutation without the subject.
pub fn permuted(
    bench: &Bench,
    data: &Dataset,
    mesh: &Mesh<2>,
    baseline: &Vowel,
    [count, seed]: [u64; 2],
    progress: &Progress<'_>,
) -> Result<Permuted, ValidationError> {
    let setups: Vec<Setup> =
        Levers::tones().iter().map(|l| bench.setup(l)).collect::<Result<_, FitError>>()?;
    let rms = |cases: &[Case]| root_mean(&tuned_outside(cases, &errors(bench, cases, &setups, || {})));
    let orders = orders(data.muscles().len(), count, seed);
    let truth = rms(&cases(data, mesh, baseline));
    let all = parallel::map(&orders, |order| {
        let cases = of_rows(data, mesh, baseline, |lengths| renamed(lengths, order));
        let found = if cases.is_empty() { f64::NAN } else { rms(&cases) };
        progress.add(1, "permuted names");
        found
    });
    let all: Vec<f64> = all.into_iter().filter(|r| r.is_finite()).collect();
    Ok(Permuted {
        lowest: all.iter().copied().fold(f64::INFINITY, f64::min),
        mean: all.iter().sum::<f64>() / all.len() as f64,
        permuted_rms: all,
        true_rms: truth,
    })
}

/// Predicted stretches of all cases by complete fits.
pub fn judged(bench: &Bench, setup: &Setup, cases: &[Case]) -> Vec<Vec<f64>> {
    parallel::map(cases, |case| bench.judge(setup, case))
}
