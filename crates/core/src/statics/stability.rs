//! Stability of an equilibrium.

use nalgebra::SVector;

use crate::effect::Tangent;
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::system::System;

use super::state::State;
use super::{Stability, Workspace};

/// Eigenvalues nearer to zero than this part of the largest diagonal entry count as zero: a slack chain's
/// are not exactly so.
const ZERO: f64 = 1e-9;

/// Smallest eigenvalue, N/m, of the exact stiffness of the free nodes at the positions and tensions of the
/// last solve: by inverse iteration on the stiffness plus the smallest shift found that makes it positive
/// definite. `None` where there is no unknown or the stiffness is not finite.
#[inline(never)]
pub fn smallest_eigenvalue<const D: usize>(system: &System<D>, workspace: &mut Workspace<D>) -> Option<f64> {
    const ITERATIONS: usize = 300;
    let pattern = system.pattern();
    let mut state = State::new(system, workspace);
    state.assemble(Tangent::Exact);
    let largest = state.w.stiffness.largest_diagonal(pattern);
    let mut shift = 0.0;
    let mut next = 1e-12 * largest;
    while state.try_factor().is_err() {
        if !(next.is_finite() && next < 1e6 * largest) {
            return None;
        }
        state.w.stiffness.shift(pattern, next - shift);
        shift = next;
        next *= 4.0;
    }
    let w = state.w;
    w.factor_ready = false;
    let mut quotient = f64::INFINITY;
    // A start without symmetry, so that it is not orthogonal to a symmetric mode of a symmetric mesh.
    for (i, v) in w.unknowns.iter_mut().enumerate() {
        *v = SVector::from_fn(|d, _| ((i * D + d + 1) as f64 * 0.618_033_988_75).fract() - 0.5);
    }
    let mut image = vec![SVector::zeros(); w.unknowns.len()];
    for _ in 0..ITERATIONS {
        w.factor.solve(pattern, &mut w.unknowns);
        let norm = w.unknowns.iter().map(SVector::norm_squared).sum::<f64>().sqrt();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        w.unknowns.iter_mut().for_each(|v| *v /= norm);
        w.stiffness.multiply(pattern, &w.unknowns, &mut image);
        let before = quotient;
        quotient = w.unknowns.iter().zip(&image).map(|(v, k)| v.dot(k)).sum();
        if (before - quotient).abs() <= 1e-13 * quotient.abs() {
            break;
        }
    }
    Some(quotient - shift)
}

impl<const D: usize> State<'_, D> {
    /// Stability by the exact stiffness at the present positions, and where its factorisation failed if it
    /// did.
    pub(super) fn classify(&mut self) -> (Stability, Option<NotPositiveDefinite>) {
        self.assemble(Tangent::Exact);
        let Err(_) = self.try_factor() else { return (Stability::Stable, None) };
        let pattern = self.system.pattern();
        let shift = ZERO * self.w.stiffness.largest_diagonal(pattern);
        self.w.stiffness.shift(pattern, shift);
        let shifted = self.try_factor();
        self.w.factor_ready = false;
        match shifted {
            Ok(()) => (Stability::Neutral, None),
            Err(failure) => (Stability::Unstable, Some(failure)),
        }
    }
}
