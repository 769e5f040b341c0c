//! A tone for each muscle: logarithms of tones, fitted to the unseen muscles, near one tone for all.

use nalgebra::{DMatrix, DVector};

use tongue_core::parallel;
use tongue_infer::inverse::{FitError, Setup, Tone};

use super::cases::{Case, subjects};
use super::levers::{Bench, Levers, NestedChain};

/// Candidate standard deviations of the logarithm of a tone.
pub const SPREADS: [f64; 4] = [0.125, 0.25, 0.5, 1.0];
/// Standard deviation of a predicted stretch, against which the spread is weighed.
const PREDICTION_SD: f64 = 0.06;
/// Step of the finite differences of the logarithms.
const STEP: f64 = 0.05;
const MOST: f64 = 2.0;
const MOST_STEPS: usize = 12;
/// Convergence: largest relative change of a tone in the last step.
const STILL: f64 = 2e-3;

fn with(levers: &Levers, names: &[String], logs: &DVector<f64>) -> Levers {
    let centre = match &levers.tone {
        Tone::Uniform(tone) => *tone,
        Tone::ByMuscle(_) => tongue_infer::inverse::TONE,
    };
    let tones = names.iter().zip(logs.iter()).map(|(m, log)| (m.clone(), centre * log.exp())).collect();
    Levers { tone: Tone::ByMuscle(tones), ..levers.clone() }
}

/// Residuals of the unseen muscles of a case in standard deviations. Each case has the weight of half its
/// muscles.
fn residuals(case: &Case, predicted: &[f64]) -> Vec<f64> {
    let half = 0.5 * case.target().muscles.len() as f64;
    let weight = (half / case.unseen.len() as f64).sqrt() / PREDICTION_SD;
    case.unseen.iter().map(|&m| weight * (predicted[m] - case.target().values[m])).collect()
}

/// Residuals for each of the setups, and the chain after the first of them.
fn ask<'a>(chains: &[NestedChain<'a>], setups: &[Setup]) -> Vec<(Vec<Vec<f64>>, NestedChain<'a>)> {
    parallel::map(chains, |chain| {
        let mut first = chain.clone();
        let mut all = vec![residuals(first.case, &first.predict(&setups[0]))];
        for setup in &setups[1..] {
            all.push(residuals(first.case, &first.clone().predict(setup)));
        }
        (all, first)
    })
}

/// Finds levers with a tone for each muscle that predict the training cases best. Its logarithm has the prior
/// mean of the one tone of `levers` and the standard deviation `spread`. Gauss-Newton with finite
/// differences.
pub fn tune(bench: &Bench, training: &[&Case], levers: &Levers, spread: f64) -> Result<Levers, FitError> {
    let names = &bench.setup.muscles;
    let n = names.len();
    let mut chains: Vec<NestedChain<'_>> = parallel::map(training, |case| NestedChain::new(bench, case));
    let mut logs = DVector::zeros(n);
    let cost = |rows: &[(Vec<Vec<f64>>, NestedChain<'_>)], logs: &DVector<f64>| -> f64 {
        let squares: f64 = rows.iter().flat_map(|(all, _)| &all[0]).map(|r| r * r).sum();
        squares + logs.norm_squared() / spread.powi(2)
    };
    for _ in 0..MOST_STEPS {
        let mut setups = vec![bench.setup(&with(levers, names, &logs))?];
        for m in 0..n {
            let mut other = logs.clone();
            other[m] += STEP;
            setups.push(bench.setup(&with(levers, names, &other))?);
        }
        let rows = ask(&chains, &setups);
        let here = cost(&rows, &logs);
        let count: usize = rows.iter().map(|(all, _)| all[0].len()).sum();
        let flat = |k: usize| rows.iter().flat_map(move |(all, _)| all[k].iter().copied());
        let base = DVector::from_iterator(count, flat(0));
        let mut jacobian = DMatrix::zeros(count, n);
        for m in 0..n {
            let column = (DVector::from_iterator(count, flat(m + 1)) - &base) / STEP;
            jacobian.set_column(m, &column);
        }
        let stiff = jacobian.tr_mul(&jacobian) + DMatrix::identity(n, n) / spread.powi(2);
        let pull = jacobian.tr_mul(&base) + &logs / spread.powi(2);
        let Some(step) = stiff.cholesky().map(|c| -c.solve(&pull)) else { break };
        chains = rows.into_iter().map(|(_, chain)| chain).collect();
        let better = (0..6).find_map(|halvings| {
            let next = (&logs + &step * 0.5f64.powi(halvings)).map(|x| x.clamp(-MOST, MOST));
            let setup = bench.setup(&with(levers, names, &next)).ok()?;
            let rows = ask(&chains, std::slice::from_ref(&setup));
            (cost(&rows, &next) < here).then_some(next)
        });
        let Some(next) = better else { break };
        let moved = (&next - &logs).amax();
        logs = next;
        if moved < STILL {
            break;
        }
    }
    Ok(with(levers, names, &logs))
}

/// The spread with which each training subject is predicted best from the others; the middle one if there is
/// one subject.
pub fn best_spread(bench: &Bench, training: &[&Case], levers: &Levers) -> Result<f64, FitError> {
    let owned: Vec<Case> = training.iter().map(|c| (*c).clone()).collect();
    let names = subjects(&owned);
    if names.len() < 2 {
        return Ok(SPREADS[1]);
    }
    let mut best = (f64::INFINITY, SPREADS[0]);
    for spread in SPREADS {
        let mut error = 0.0;
        for name in &names {
            let (inner, judged): (Vec<&Case>, Vec<&Case>) = training.iter().partition(|c| c.subject != *name);
            let setup = bench.setup(&tune(bench, &inner, levers, spread)?)?;
            error +=
                parallel::map(&judged, |case| case.error(&NestedChain::new(bench, case).predict(&setup)))
                    .iter()
                    .sum::<f64>();
        }
        if error < best.0 {
            best = (error, spread);
        }
    }
    Ok(best.1)
}
