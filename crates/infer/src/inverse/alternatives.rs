//! Other answers: local optima from other starts.

use serde::Serialize;
use tongue_input::measured::ByMuscle;

use super::Fit;

/// Answers whose tensions all differ by less than this are the same, N.
const SAME_ANSWER: f64 = 0.5;

/// A local optimum other than the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Optimum {
    /// Tensions of the active muscles, N.
    pub tensions_n: ByMuscle<f64>,
    /// Objective; the answer's is smaller.
    pub cost: f64,
    /// Number of starts that ended there.
    pub starts: usize,
}

/// Ends of converged starts other than the answer, best first.
pub fn optima<const D: usize>(fit: &Fit<D>) -> Vec<Optimum> {
    let answer = fit.active_tensions();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_ANSWER);
    let mut found: Vec<(&[f64], Optimum)> = Vec::new();
    for start in fit.starts.iter().filter(|s| s.converged && !same(&s.x, &answer)) {
        match found.iter_mut().find(|(x, _)| same(x, &start.x)) {
            Some((_, o)) => o.starts += 1,
            None => {
                let tensions_n = ByMuscle::new(&fit.active_names(), start.x.iter().copied());
                found.push((&start.x, Optimum { tensions_n, cost: start.cost, starts: 1 }));
            }
        }
    }
    found.sort_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
    found.into_iter().map(|(_, optimum)| optimum).collect()
}
