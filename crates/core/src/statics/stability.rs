//! Stability of an equilibrium, and descent along negative curvature of the energy.

use nalgebra::SVector;

use super::state::SolveState;
use super::{Stability, Workspace};
use crate::effect::Tangent;
use crate::geometry;
use crate::system::System;

/// Eigenvalues whose magnitude is below this part of the largest diagonal entry count as zero, since rounding changes those of a slack
/// chain.
const ZERO_EIGENVALUE: f64 = 1e-9;

/// First step along a direction of negative curvature, over the size of the body, and the largest number of doublings.
const FIRST_CURVATURE_STEP: f64 = 1e-7;
const MOST_DOUBLINGS: usize = 24;

/// Smallest eigenvalue, N/m, of the exact stiffness of the free nodes at the positions and tensions of the last solve, by inverse
/// iteration on the stiffness plus a shift that makes it positive definite. `None` without unknowns, or if the stiffness is not finite.
#[inline(never)]
pub fn smallest_eigenvalue<const D: usize>(system: &System<D>, workspace: &mut Workspace<D>) -> Option<f64> {
    const ITERATIONS: usize = 300;
    let pattern = system.pattern();
    let mut state = SolveState::new(system, workspace);
    state.assemble(Tangent::Exact);
    let largest = state.w.stiffness.largest_diagonal(pattern);
    let mut shift = 0.0;
    let mut next = 1e-12 * largest;
    while !state.try_factor() {
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
    // The start has no symmetry, so that it is not orthogonal to a symmetric mode of a symmetric mesh.
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

impl<const D: usize> SolveState<'_, D> {
    /// Stability by the exact stiffness at the present positions; if it is unstable, `find_curvature` continues from the failed
    /// factorisation.
    pub(super) fn classify(&mut self) -> Stability {
        self.assemble(Tangent::Exact);
        if self.try_factor() {
            return Stability::Stable;
        }
        let pattern = self.system.pattern();
        let shift = ZERO_EIGENVALUE * self.w.stiffness.largest_diagonal(pattern);
        self.w.stiffness.shift(pattern, shift);
        let is_neutral = self.try_factor();
        self.w.factor_ready = false;
        if is_neutral { Stability::Neutral } else { Stability::Unstable }
    }

    /// Stores the direction of negative curvature of the stiffness whose factorisation failed.
    pub(super) fn find_curvature(&mut self) {
        let w = &mut *self.w;
        w.factor.negative_curvature(self.system.pattern(), &w.stiffness, &mut w.curvature);
    }

    /// Moves along the stored direction of negative curvature, to the side to which the force points, as far as doubling the step lowers
    /// the energy. Returns false if not even the shortest step does.
    pub(super) fn follow_curvature(&mut self) -> bool {
        let pattern = self.system.pattern();
        let w = &mut *self.w;
        let (mut uphill, mut longest) = (0.0, 0.0f64);
        w.step.fill(SVector::zeros());
        for (d, &node) in w.curvature.iter().zip(pattern.nodes()) {
            uphill -= d.dot(&w.force[node]);
            longest = longest.max(d.norm());
        }
        let size = geometry::extent(self.system.rest());
        let scale = FIRST_CURVATURE_STEP * size * if uphill > 0.0 { -1.0 } else { 1.0 } / longest;
        if !scale.is_finite() {
            return false;
        }
        for (d, &node) in w.curvature.iter().zip(pattern.nodes()) {
            w.step[node] = *d * scale;
        }
        w.trial.copy_from_slice(&w.positions);
        let (start, mut lowest) = (self.done.energy, self.done.energy);
        let (mut way, mut best) = (1.0, 0.0);
        // The limit is that of the whole step, so it is computed at the start.
        for _ in 0..MOST_DOUBLINGS {
            self.place_along(0.0);
            if self.step_limit() < 1.0 {
                break;
            }
            self.place_along(1.0);
            let energy = self.energy();
            if energy.is_nan() || energy >= lowest {
                break;
            }
            (lowest, best) = (energy, way);
            way *= 2.0;
            self.w.step.iter_mut().for_each(|s| *s *= 2.0);
        }
        self.place_along(best / way);
        self.done.energy = lowest;
        self.update_force();
        lowest < start
    }

    /// Places the nodes at the start plus a part of the step.
    pub(super) fn place_along(&mut self, part: f64) {
        let w = &mut *self.w;
        for &node in self.system.pattern().nodes() {
            w.positions[node] = w.trial[node] + w.step[node] * part;
        }
    }
}
