//! A barrier that prevents inverted quadratic elements.

use nalgebra::{SMatrix, SVector};

use crate::geometry::quadratic::{self, MAX_NODES};
use crate::geometry::simplex;
use crate::sparse::pattern::pairs;
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::barrier::barrier;
use super::barrier_simplices::{BarrierSimplex, BarrierSimplices, barrier_is_inactive, step_is_free};
use super::quadratic_element::gather;
use super::{Configuration, Effect, Tangent};

/// A [`barrier()`] at the corners of a quadratic element and in the linear parts into which its nodes divide it.
///
/// The law is evaluated at a few interior points only, so that at loads far beyond those of muscles an element can be inverted at a corner
/// while all of these points are valid. So each corner and each part has a measure `m`, that of the simplex of its edges: from a corner
/// `i` along the edge to `j` with the middle `k` the tangent `4 x_k - 3 x_i - x_j`, in a part the vector from one of its nodes to another.
/// Where `m` is below a tenth of `M`, that at rest, there is the energy `λ V b(m/M)`, with an equal share `V` of the element's measure for
/// each; above a tenth there is none.
#[derive(Debug, Clone)]
pub struct OrientationBarrier<const D: usize> {
    /// Lamé's first constant λ, Pa (2D: per metre of thickness).
    lambda: f64,
    elements: Vec<BarrierElement>,
    simplices: BarrierSimplices<D>,
}

#[derive(Debug, Clone)]
struct BarrierElement {
    nodes: [usize; MAX_NODES],
    /// Area, m², or volume, m³, at rest.
    measure: f64,
    /// A slot for each pair of nodes, with those of a node with itself.
    slots: Vec<Slot>,
}

impl<const D: usize> OrientationBarrier<D> {
    const NODES: usize = quadratic::nodes::<D>();

    /// The barrier for elements of these nodes (corners, then the middles of [`quadratic::edges`]) with these positions at rest, m, in
    /// tissue with Lamé's constant `lambda`, Pa.
    pub fn new<'a>(
        lambda: f64,
        elements: impl Iterator<Item = &'a [usize]>,
        rest_positions: &[SVector<f64, D>],
    ) -> Self {
        let elements = elements.map(|given| {
            let mut nodes = [0; MAX_NODES];
            nodes[..Self::NODES].copy_from_slice(given);
            let measure = simplex::measure(&simplex::corners(rest_positions, &given[..=D]));
            BarrierElement { nodes, measure, slots: Vec::new() }
        });
        Self { lambda, elements: elements.collect(), simplices: BarrierSimplices::default() }
    }

    /// Calls `act` for every simplex in which the barrier acts, with its ratio and the energy that scales the barrier, J.
    fn for_each_active(
        &self,
        positions: &[SVector<f64, D>],
        mut act: impl FnMut(&BarrierElement, &BarrierSimplex<'_, D>, f64, f64),
    ) {
        for e in &self.elements {
            let x = gather(&e.nodes, |node| positions[node]);
            if barrier_is_inactive(e.measure, &x) {
                continue;
            }
            for guarded in self.simplices.of(e.measure, &x) {
                if let Some(ratio) = guarded.ratio() {
                    act(e, &guarded, ratio, self.lambda * e.measure / self.simplices.count() as f64);
                }
            }
        }
    }
}

impl<const D: usize> Effect<D> for OrientationBarrier<D> {
    fn name(&self) -> &'static str {
        "barrier"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.elements.iter().for_each(|e| couple(&e.nodes[..Self::NODES]));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for e in &mut self.elements {
            e.slots = pattern.pair_slots(&e.nodes[..Self::NODES]).collect();
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let mut energy = 0.0;
        self.for_each_active(at.positions, |_, _, ratio, scale| energy += scale * barrier(ratio).value);
        energy
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        self.for_each_active(at.positions, |e, guarded, ratio, scale| {
            let push = scale * barrier(ratio).slope;
            let slopes = guarded.slopes(&guarded.counts());
            for (&node, slope) in e.nodes[..Self::NODES].iter().zip(&slopes) {
                force[node] -= slope * push;
            }
        });
    }

    /// `λ V (b'' g gᵀ + b' d²(m/M)/dx²)`; [`Tangent::Convex`] keeps the first part, which is positive semidefinite.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        self.for_each_active(at.positions, |e, guarded, ratio, scale| {
            let b = barrier(ratio);
            let counts = guarded.counts();
            let slopes = guarded.slopes(&counts);
            let bend = if tangent == Tangent::Exact { scale * b.slope / guarded.rest } else { 0.0 };
            for (slot, (i, j)) in e.slots.iter().zip(pairs(Self::NODES)) {
                let mut block: SMatrix<f64, D, D> = slopes[i] * slopes[j].transpose() * (scale * b.curvature);
                for (p, q) in (0..D).flat_map(|p| (0..D).map(move |q| (p, q))) {
                    let count = counts[i][p] * counts[j][q] * bend;
                    if count != 0.0 && p != q {
                        block += simplex::hessian(&guarded.corners, p + 1, q + 1) * count;
                    }
                }
                stiffness.add(*slot, &block);
            }
        });
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        let mut limit: f64 = 1.0;
        for e in &self.elements {
            let (x, p) = (gather(&e.nodes, |node| at.positions[node]), gather(&e.nodes, |node| step[node]));
            if limit == 1.0 && step_is_free(&x, &p) {
                continue;
            }
            for (here, way) in self.simplices.of(e.measure, &x).zip(self.simplices.of(e.measure, &p)) {
                limit *= simplex::safe_part(&here.corners, &way.corners.map(|p| p * limit));
            }
        }
        limit
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn barrier_active(&self, at: Configuration<'_, D>) -> usize {
        let guarded = self.elements.iter().filter(|e| {
            let x = gather(&e.nodes, |node| at.positions[node]);
            !barrier_is_inactive(e.measure, &x)
                && self.simplices.of(e.measure, &x).any(|g| g.ratio().is_some())
        });
        guarded.count()
    }
}
