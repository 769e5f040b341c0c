//! A straight element between two nodes.

use nalgebra::{SMatrix, SVector};

use super::Tangent;
use super::barrier::{Barrier, THRESHOLD, barrier};
use crate::sparse::{BlockMatrix, Pattern, Slot};

#[derive(Debug, Clone)]
pub struct Spring {
    pub nodes: [usize; 2],
    /// Spring constant, N/m (2D: per metre of thickness).
    pub stiffness: f64,
    /// Length without tension, m.
    pub rest_length: f64,
    slots: [Slot; 3],
}

/// Distance between the nodes, and the unit vector from the first to the second, which is zero if they coincide.
#[inline(always)]
pub(crate) fn length_and_direction<const D: usize>(
    positions: &[SVector<f64, D>],
    nodes: [usize; 2],
) -> (f64, SVector<f64, D>) {
    direction_of(&(positions[nodes[1]] - positions[nodes[0]]))
}

/// Length and unit direction of a vector; the direction of a zero vector is zero.
#[inline(always)]
pub(crate) fn direction_of<const D: usize>(d: &SVector<f64, D>) -> (f64, SVector<f64, D>) {
    let length = d.norm();
    if length > 0.0 { (length, d / length) } else { (0.0, SVector::zeros()) }
}

impl Spring {
    pub fn new(nodes: [usize; 2], stiffness: f64, rest_length: f64) -> Self {
        Self { nodes, stiffness, rest_length, slots: [Slot::UNBOUND; 3] }
    }

    pub fn bind(&mut self, pattern: &Pattern) {
        let [a, b] = self.nodes;
        self.slots = [pattern.slot(a, a), pattern.slot(b, b), pattern.slot(a, b)];
    }

    /// The barrier, if the spring is short enough for it to act.
    #[inline(always)]
    fn barrier(&self, length: f64) -> Option<Barrier> {
        (length < THRESHOLD * self.rest_length).then(|| barrier(length / self.rest_length))
    }

    pub(crate) fn barrier_is_active<const D: usize>(&self, positions: &[SVector<f64, D>]) -> bool {
        let [a, b] = self.nodes;
        let least = THRESHOLD * self.rest_length;
        self.stiffness > 0.0 && (positions[b] - positions[a]).norm_squared() < least * least
    }

    /// Energy with an additional constant tension, J: `1/2 k (l - l0)² + F (l - l0)`, and below a tenth of the rest length `k l0²` times
    /// the [`barrier()`].
    #[inline(always)]
    pub fn energy<const D: usize>(&self, positions: &[SVector<f64, D>], tension: f64) -> f64 {
        let (length, _) = length_and_direction(positions, self.nodes);
        let e = length - self.rest_length;
        let energy = (0.5 * self.stiffness * e + tension) * e;
        match self.barrier(length) {
            Some(b) if self.stiffness > 0.0 => {
                energy + self.stiffness * self.rest_length * self.rest_length * b.value
            }
            _ => energy,
        }
    }

    /// Adds the force of the tension `k (l - l0) + F`, and of the barrier, on both ends, N.
    #[inline(always)]
    pub fn add_force<const D: usize>(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        force: &mut [SVector<f64, D>],
    ) {
        let (length, n) = length_and_direction(positions, self.nodes);
        let mut total_tension = self.stiffness * (length - self.rest_length) + tension;
        if let Some(b) = self.barrier(length) {
            total_tension += self.stiffness * self.rest_length * b.slope;
        }
        self.add_pull(n, total_tension, force);
    }

    /// Adds the force of a tension, N, along the direction `n` on both ends.
    #[inline(always)]
    pub(crate) fn add_pull<const D: usize>(
        &self,
        n: SVector<f64, D>,
        total_tension: f64,
        force: &mut [SVector<f64, D>],
    ) {
        let pull = n * total_tension;
        force[self.nodes[0]] += pull;
        force[self.nodes[1]] -= pull;
    }

    /// Adds `k n nᵀ + (T / l) (I - n nᵀ)` with the total tension `T`. The second part is negative in compression, where
    /// [`Tangent::Convex`] leaves it out.
    #[inline(always)]
    pub fn add_stiffness<const D: usize>(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        let (length, n) = length_and_direction(positions, self.nodes);
        let mut total_tension = self.stiffness * (length - self.rest_length) + tension;
        let mut slope = self.stiffness;
        if let Some(b) = self.barrier(length) {
            total_tension += self.stiffness * self.rest_length * b.slope;
            slope += self.stiffness * b.curvature;
        }
        self.add_line(length, n, slope, total_tension, tangent, stiffness);
    }

    /// Adds `slope n nᵀ + (T / l) (I - n nᵀ)` for an element of length `l`, direction `n` and tension `T`, whose derivative by the length
    /// is `slope`, N/m.
    #[inline(always)]
    pub(crate) fn add_line<const D: usize>(
        &self,
        length: f64,
        n: SVector<f64, D>,
        slope: f64,
        total_tension: f64,
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        let mut across = if length > 0.0 { total_tension / length } else { 0.0 };
        if tangent == Tangent::Convex {
            across = across.max(0.0);
        }
        let along = slope - across;
        let mut block = SMatrix::<f64, D, D>::zeros();
        for c in 0..D {
            let f = along * n[c];
            for r in 0..D {
                block[(r, c)] = n[r] * f;
            }
            block[(c, c)] += across;
        }
        let [aa, bb, ab] = self.slots;
        stiffness.add_symmetric(aa, &block);
        stiffness.add_symmetric(bb, &block);
        stiffness.add_symmetric(ab, &-block);
    }
}
