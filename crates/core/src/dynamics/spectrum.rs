//! The largest eigenvalues of a body in motion.

use nalgebra::SVector;

use crate::effect::Tangent;
use crate::sparse::{BlockMatrix, Pattern};

use super::{Motion, State};

/// The power iteration ends when a round of it changes the estimate by less than this part of it.
const SETTLED: f64 = 1e-7;
/// Steps of the power iteration in a round, and the largest number of rounds.
const ROUND: usize = 20;
const MOST_ROUNDS: usize = 200;

/// The fastest modes, by power iteration on `K/m` and `C/m` at a state (internal states held fixed). The
/// tangent is the convex one, so that both matrices are positive semidefinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// Largest eigenvalue of `K/m`, 1/s²: the square of the largest angular frequency.
    pub stiffness: f64,
    /// Largest eigenvalue of `C/m`, 1/s: the largest rate at which dampers stop a motion.
    pub damping: f64,
}

impl Spectrum {
    pub fn of<const D: usize>(motion: &Motion<'_, D>, state: &State<D>) -> Self {
        let pattern = motion.system().pattern();
        let mut matrix = BlockMatrix::zeros(pattern);
        motion.add_stiffness(state, 0.0, Tangent::Convex, &mut matrix);
        let stiffness = largest_eigenvalue(pattern, &matrix) / motion.mass();
        matrix.clear();
        motion.add_damping(state, 1.0, &mut matrix);
        Self { stiffness, damping: largest_eigenvalue(pattern, &matrix) / motion.mass() }
    }
}

/// Largest eigenvalue of a positive semidefinite matrix, from a start without symmetry, so that no mode is
/// orthogonal to it.
fn largest_eigenvalue<const D: usize>(pattern: &Pattern, matrix: &BlockMatrix<D>) -> f64 {
    let n = pattern.unknowns();
    let mut v: Vec<SVector<f64, D>> =
        (0..n).map(|i| SVector::from_fn(|d, _| (1.0 + (i * D + d) as f64 * 2.4).sin())).collect();
    let mut image = v.clone();
    let mut estimate = 0.0;
    for _ in 0..MOST_ROUNDS {
        let before = estimate;
        for _ in 0..ROUND {
            matrix.multiply(pattern, &v, &mut image);
            let norm = image.iter().map(SVector::norm_squared).sum::<f64>().sqrt();
            if !(norm > 0.0 && norm.is_finite()) {
                return 0.0;
            }
            // |A v| of a unit v: a lower bound, as the Rayleigh quotient is, and never below it.
            estimate = norm;
            v.iter_mut().zip(&image).for_each(|(v, i)| *v = i / norm);
        }
        if (estimate - before).abs() <= SETTLED * estimate {
            break;
        }
    }
    estimate
}
