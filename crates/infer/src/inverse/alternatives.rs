//! Other answers: local optima from other starts.

use super::Fit;

/// Answers whose tensions all differ by less than this are the same, N.
const SAME_ANSWER: f64 = 0.5;

/// A local optimum other than the answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// Tensions of the active muscles, N.
    pub tensions: Vec<f64>,
    /// Objective; the answer's is smaller.
    pub cost: f64,
    /// Number of starts that ended there.
    pub starts: usize,
}

/// Ends of converged starts other than the answer, best first.
pub fn optima<const D: usize>(fit: &Fit<D>) -> Vec<Optimum> {
    let answer = fit.active_tensions();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_ANSWER);
    let mut found: Vec<Optimum> = Vec::new();
    for start in fit.starts.iter().filter(|s| s.converged && !same(&s.x, &answer)) {
        match found.iter_mut().find(|o| same(&o.tensions, &start.x)) {
            Some(o) => o.starts += 1,
            None => {
                let tensions = start.x[..answer.len()].to_vec();
                found.push(Optimum { tensions, cost: start.cost, starts: 1 });
            }
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found
}
