//! Energy, force and stiffness in one or more lanes, by one loop over triangles and one over edges.
//!
//! With `perp(v) = (-v_y, v_x)` the gradient of a triangle's area at a corner is half of `perp` of the opposite side, which is minus half
//! of the sum of `perp` of the two sides that meet there. So an edge `a -> b` with triangles left and right of it pushes each of its ends
//! by `(h_left - h_right) perp(b - a)`, `h = kappa (S - S0) / (2 S0²)`, and the block of the stiffness that couples its ends is
//!
//! ```text
//! -(spring) + sum over both  kappa/(4 S0²) perp(c - b) perp(a - c)ᵀ  + (h_left - h_right) [0 1; -1 0],   c the third corner.
//! ```
//! Each block is written once. The blocks of a row add up to zero, because a translation of the whole body causes no force, so that the
//! diagonal block is minus the sum of the others.

use super::{ElementNumbers, Elements};
use crate::effect::barrier::THRESHOLD;
use crate::sparse::flat::{Lower, MatrixBlock, largest_diagonal};
use crate::sparse::simd::{Simd, SimdPair, difference};

#[derive(Debug, Clone, Copy)]
pub(crate) struct Local<const L: usize> {
    pub energy: Simd<L>,
    /// Square of the largest force on an unknown, N².
    pub residual_squared: Simd<L>,
    /// Whether every triangle and every spring is larger than the part of its rest measure below which the barrier acts.
    pub upright: [bool; L],
}

/// Twice the area of a triangle.
#[inline(always)]
fn twice_area<const L: usize>(a: SimdPair<L>, b: SimdPair<L>, c: SimdPair<L>) -> Simd<L> {
    let (p, q) = (difference(a, b), difference(a, c));
    p[0] * q[1] - p[1] * q[0]
}

/// Computes energy and forces at `x` with the tension of every edge, and `h` of every triangle.
#[inline(always)]
pub(crate) fn evaluate<const L: usize>(
    elements: &Elements,
    numbers: &ElementNumbers<L>,
    tension: &[Simd<L>],
    x: &[SimdPair<L>],
    h: &mut [Simd<L>],
    force: &mut [SimdPair<L>],
) -> Local<L> {
    let half = Simd::splat(0.5);
    let mut cell_energy = Simd::ZERO;
    let mut least = Simd::ONE;
    for (i, corners) in elements.cells.iter().enumerate() {
        let [a, b, c] = corners.map(|n| x[n as usize]);
        let (kappa, inverse) = (numbers.kappa[i], numbers.inverse_area[i]);
        let ratio = half * twice_area(a, b, c) * inverse;
        let strain = ratio - Simd::ONE;
        cell_energy += kappa * (strain * strain);
        h[i] = half * kappa * inverse * strain;
        least = ratio.min(least);
    }
    force.fill([Simd::ZERO; 2]);
    let (mut energy, mut slack) = (Simd::ZERO, Simd::ONE);
    for (i, edge) in elements.edges.iter().enumerate() {
        let [a, b] = edge.nodes.map(|n| n as usize);
        let d = difference(x[a], x[b]);
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let (k, rest, pull) = (numbers.stiffness[i], numbers.rest[i], tension[i]);
        let e = length - rest;
        energy += (half * k * e + pull) * e;
        // Positive while the spring is longer than the length at which the barrier begins.
        slack = (length - rest * Simd::splat(THRESHOLD)).min(slack);
        let along = (k * e + pull) * length.inverse();
        let push = h[edge.cells[0] as usize] - h[edge.cells[1] as usize];
        let f = [along * d[0], along * d[1]];
        let g = [push * d[1], push * d[0]];
        force[a][0] += f[0] - g[0];
        force[a][1] += f[1] + g[1];
        force[b][0] -= f[0] + g[0];
        force[b][1] -= f[1] - g[1];
    }
    let mut residual_squared = Simd::ZERO;
    for f in &force[..elements.unknowns] {
        residual_squared = (f[0] * f[0] + f[1] * f[1]).max(residual_squared);
    }
    let (cells, lines) = (least.above(Simd::splat(THRESHOLD)), slack.above(Simd::ZERO));
    let upright = std::array::from_fn(|lane| cells[lane] && lines[lane]);
    Local { energy: energy + half * cell_energy, residual_squared, upright }
}

/// Computes the `h` of every triangle that the linear response to the step from `from` predicts: `h` at `x` without the term of second
/// order, the area of the triangle that the steps of its corners form.
#[inline(always)]
pub(crate) fn predict_pressure<const L: usize>(
    elements: &Elements,
    numbers: &ElementNumbers<L>,
    from: &[SimdPair<L>],
    x: &[SimdPair<L>],
    h: &[Simd<L>],
    linear_h: &mut [Simd<L>],
) {
    let quarter = Simd::splat(0.25);
    for (i, corners) in elements.cells.iter().enumerate() {
        let [a, b, c] = corners.map(|n| difference(from[n as usize], x[n as usize]));
        let inverse = numbers.inverse_area[i];
        let scale = quarter * numbers.kappa[i] * (inverse * inverse);
        linear_h[i] = h[i] - scale * twice_area(a, b, c);
    }
}

/// Computes the stiffness at the positions of the last [`evaluate`], the exact one or, in the lanes of `convex`, the convex one. Returns
/// its largest diagonal entry.
#[inline(always)]
pub(crate) fn assemble_stiffness<const L: usize>(
    elements: &Elements,
    numbers: &ElementNumbers<L>,
    tension: &[Simd<L>],
    x: &[SimdPair<L>],
    h: &[Simd<L>],
    convex: [bool; L],
    (blocks, diagonal): (&mut [MatrixBlock<L>], &mut [Lower<L>]),
) -> Simd<L> {
    // The convex stiffness leaves out the lateral part of compressed springs and the part by the pressure of triangles.
    let keep = Simd(convex.map(|c| if c { 0.0 } else { 1.0 }));
    let least_across = Simd(convex.map(|c| if c { 0.0 } else { f64::NEG_INFINITY }));
    let quarter = Simd::splat(0.25);
    diagonal.fill([Simd::ZERO; 3]);
    for (i, edge) in elements.edges.iter().enumerate() {
        let [a, b] = edge.nodes.map(|n| n as usize);
        let [left, right] = edge.cells.map(|c| c as usize);
        let (xa, xb) = (x[a], x[b]);
        let d = difference(xa, xb);
        let inverse = (d[0] * d[0] + d[1] * d[1]).sqrt().inverse();
        let n = [d[0] * inverse, d[1] * inverse];
        let k = numbers.stiffness[i];
        let across = (k - (k * numbers.rest[i] - tension[i]) * inverse).max(least_across);
        let along = k - across;
        let mixed = -(along * n[0] * n[1]);
        let turn = keep * (h[left] - h[right]);
        let mut block =
            [-(along * n[0] * n[0] + across), mixed + turn, mixed - turn, -(along * n[1] * n[1] + across)];
        for (cell, third) in [left, right].into_iter().zip(edge.opposite) {
            let c = x[third as usize];
            let (p, q) = (difference(xb, c), difference(c, xa));
            let inverse = numbers.inverse_area[cell];
            let scale = quarter * numbers.kappa[cell] * (inverse * inverse);
            let (up, across) = (scale * p[1], scale * p[0]);
            block[0] += up * q[1];
            block[1] -= up * q[0];
            block[2] -= across * q[1];
            block[3] += across * q[0];
        }
        blocks[i] = block;
        diagonal[a][0] -= block[0];
        diagonal[a][1] -= block[2];
        diagonal[a][2] -= block[3];
        diagonal[b][0] -= block[0];
        diagonal[b][1] -= block[1];
        diagonal[b][2] -= block[3];
    }
    largest_diagonal(&diagonal[..elements.unknowns])
}
