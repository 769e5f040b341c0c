//! Muscles as fibres embedded in a continuum, which need not follow its edges.

use nalgebra::{SMatrix, SVector};

use super::barrier::{THRESHOLD, barrier};
use super::spring::direction_of;
use super::{Configuration, Effect, Internal, Tangent};
use crate::body::Strand;
use crate::geometry::quadratic::MAX_NODES;
use crate::sparse::simd::vectorised;
use crate::sparse::{BlockMatrix, Pattern, Slot};

const MAX_PAIRS: usize = MAX_NODES * (MAX_NODES + 1) / 2;

/// A contracting muscle: the tension times `sum w (|y| - |Y|)` over its [`Strand`]s, each with a weight `w` and a vector `y = sum c_a x_a`
/// of the positions, which is `Y` at rest.
///
/// For a point of a fibre in the tissue, `y` is `F f0`, the deformed direction of the fibre at rest. The energy is that of a tension that
/// does not depend on the stretch, and is convex. For a part outside the tissue, `y` is the vector from the bone to the place where the
/// muscle pulls. The passive stiffness of the muscle is that of the tissue around it.
///
/// Such a tension would shorten a part outside the tissue to a point. So below a tenth of its length at rest a strand has the energy
/// `w B |Y| b(|y|/|Y|)` of a [`barrier()`] too, with a tension `B` that belongs to the tissue.
///
/// In motion the tension follows the given one with the time constant of the thesis's contractile element at constant length, `b_cc/k2`;
/// the series spring has no counterpart.
#[derive(Debug, Clone)]
pub struct Fibres<const D: usize> {
    muscle: usize,
    groups: Vec<StrandGroup<D>>,
    /// b_cc/k2, s.
    contraction_time: f64,
    barrier_tension: f64,
}

/// Strands with the same nodes, those of one element.
#[derive(Debug, Clone)]
struct StrandGroup<const D: usize> {
    nodes: Vec<usize>,
    /// Positions of the nodes at rest, m.
    rest: Vec<SVector<f64, D>>,
    strands: Vec<FibresAtRest<D>>,
    /// The coefficients of all strands, one after another.
    coefficients: Vec<f64>,
    /// A slot for each pair of nodes, with those of a node with itself.
    slots: Vec<Slot>,
}

#[derive(Debug, Clone)]
struct FibresAtRest<const D: usize> {
    weight: f64,
    vector: SVector<f64, D>,
    length: f64,
}

impl<const D: usize> FibresAtRest<D> {
    /// The tension with that of the barrier, N, and its derivative by the length, N/m.
    #[inline(always)]
    fn pull(&self, length: f64, tension: f64, barrier_tension: f64) -> (f64, f64) {
        if barrier_tension > 0.0 && length < THRESHOLD * self.length {
            let b = barrier(length / self.length);
            return (tension + barrier_tension * b.slope, barrier_tension * b.curvature / self.length);
        }
        (tension, 0.0)
    }
}

impl<const D: usize> Fibres<D> {
    /// Muscle number `muscle` of the mesh, of these strands between nodes with these positions at rest, m. Its tension follows with the
    /// time constant `contraction_time`, s; `barrier_tension`, N, scales the barrier.
    pub fn new(
        muscle: usize,
        strands: &[Strand],
        rest_positions: &[SVector<f64, D>],
        contraction_time: f64,
        barrier_tension: f64,
    ) -> Self {
        let mut groups: Vec<StrandGroup<D>> = Vec::new();
        for strand in strands {
            let number = groups.iter().position(|g| g.nodes == strand.nodes).unwrap_or_else(|| {
                groups.push(StrandGroup {
                    nodes: strand.nodes.clone(),
                    rest: strand.nodes.iter().map(|&node| rest_positions[node]).collect(),
                    strands: Vec::new(),
                    coefficients: Vec::new(),
                    slots: Vec::new(),
                });
                groups.len() - 1
            });
            let group = &mut groups[number];
            let vectors = group.rest.iter().zip(&strand.coefficients).map(|(x, c)| x * *c);
            let vector: SVector<f64, D> = vectors.sum();
            group.strands.push(FibresAtRest { weight: strand.weight, vector, length: vector.norm() });
            group.coefficients.extend(&strand.coefficients);
        }
        Self { muscle, groups, contraction_time, barrier_tension }
    }

    /// Derivative of the energy by the tension, m.
    fn lengthening(&self, positions: &[SVector<f64, D>]) -> f64 {
        let strands = self.groups.iter().flat_map(|g| g.strands(positions));
        // This is |Y + d| - |Y| without cancellation for small d.
        let changes = strands.map(|(rest, _, by)| {
            let both = (rest.vector + by).norm() + rest.length;
            if both > 0.0 { rest.weight * by.dot(&(rest.vector * 2.0 + by)) / both } else { 0.0 }
        });
        changes.sum()
    }

    /// The strands in which the barrier acts, with their lengths.
    fn below_threshold<'a>(
        &'a self,
        positions: &'a [SVector<f64, D>],
    ) -> impl Iterator<Item = (&'a FibresAtRest<D>, f64)> {
        let strands = self.groups.iter().flat_map(|g| g.strands(positions));
        let lengths = strands.map(|(rest, _, by)| (rest, (rest.vector + by).norm()));
        lengths.filter(|(rest, length)| *length < THRESHOLD * rest.length)
    }

    /// Adds `w c_a c_b ((T / |y|) (I - n nᵀ) + dT/d|y| n nᵀ)`, which is positive semidefinite without a barrier. [`Tangent::Convex`]
    /// leaves out the first part where T is negative.
    #[inline(always)]
    fn add_blocks(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        barrier_tension: f64,
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        if tension == 0.0 && barrier_tension == 0.0 {
            return;
        }
        for g in &self.groups {
            // A group with more nodes than an element has one strand, so that its blocks need no sum.
            let mut blocks = [SMatrix::<f64, D, D>::zeros(); MAX_PAIRS];
            let few = g.slots.len() <= MAX_PAIRS;
            for (rest, coefficients, by) in g.strands(positions) {
                let (length, n) = direction_of(&(rest.vector + by));
                if length == 0.0 {
                    continue;
                }
                let (tension, slope) = rest.pull(length, tension, barrier_tension);
                let taut = if tangent == Tangent::Convex { tension.max(0.0) } else { tension } / length;
                let along = n * n.transpose();
                let across =
                    ((SMatrix::<f64, D, D>::identity() - along) * taut + along * slope) * rest.weight;
                let mut pair = 0;
                for (a, ca) in coefficients.iter().enumerate() {
                    let row = across * *ca;
                    for cb in &coefficients[a..] {
                        let block = row * *cb;
                        if few {
                            blocks[pair] += block;
                        } else {
                            stiffness.add_symmetric(g.slots[pair], &block);
                        }
                        pair += 1;
                    }
                }
            }
            if few {
                for (slot, block) in g.slots.iter().zip(&blocks) {
                    stiffness.add_symmetric(*slot, block);
                }
            }
        }
    }
}

impl<const D: usize> StrandGroup<D> {
    /// The strands, their coefficients, and the change of their vectors from rest.
    #[inline(always)]
    fn strands<'a>(
        &'a self,
        positions: &'a [SVector<f64, D>],
    ) -> impl Iterator<Item = (&'a FibresAtRest<D>, &'a [f64], SVector<f64, D>)> {
        self.strands.iter().zip(self.coefficients.chunks_exact(self.nodes.len())).map(
            |(strand, coefficients)| {
                let mut by = SVector::zeros();
                for ((&node, at_rest), c) in self.nodes.iter().zip(&self.rest).zip(coefficients) {
                    by += (positions[node] - at_rest) * *c;
                }
                (strand, coefficients, by)
            },
        )
    }

    /// Adds the force of a tension and of the barrier, both N.
    #[inline(always)]
    fn add_force(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        barrier_tension: f64,
        force: &mut [SVector<f64, D>],
    ) {
        for (rest, coefficients, by) in self.strands(positions) {
            let (length, n) = direction_of(&(rest.vector + by));
            let (total_tension, _) = rest.pull(length, tension, barrier_tension);
            let pull = n * (total_tension * rest.weight);
            for (&node, c) in self.nodes.iter().zip(coefficients) {
                force[node] -= pull * *c;
            }
        }
    }
}

impl<const D: usize> Effect<D> for Fibres<D> {
    fn name(&self) -> &'static str {
        "fibres"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.groups.iter().for_each(|g| couple(&g.nodes));
    }

    fn elements(&self) -> usize {
        self.groups.iter().map(|g| g.strands.len()).sum()
    }

    fn bind(&mut self, pattern: &Pattern) {
        for g in &mut self.groups {
            g.slots = pattern.pair_slots(&g.nodes).collect();
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let barriers = self.below_threshold(at.positions).map(|(rest, length)| {
            rest.weight * self.barrier_tension * rest.length * barrier(length / rest.length).value
        });
        at.tensions[self.muscle] * self.lengthening(at.positions) + barriers.sum::<f64>()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        let tension = at.tensions[self.muscle];
        self.groups.iter().for_each(|g| g.add_force(at.positions, tension, self.barrier_tension, force));
    }

    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        let (tension, barrier) = (at.tensions[self.muscle], self.barrier_tension);
        vectorised(
            #[inline(always)]
            || self.add_blocks(at.positions, tension, barrier, tangent, stiffness),
        );
    }

    fn add_force_per_tension(&self, at: Configuration<'_, D>, muscle: usize, rate: &mut [SVector<f64, D>]) {
        if muscle == self.muscle {
            self.groups.iter().for_each(|g| g.add_force(at.positions, 1.0, 0.0, rate));
        }
    }

    fn barrier_active(&self, at: Configuration<'_, D>) -> usize {
        self.below_threshold(at.positions).count()
    }

    fn internal(&self) -> Option<&dyn Internal<D>> {
        Some(self)
    }
}

/// The internal state is the tension of the muscle, N, which is 0 at first and follows the given tension.
impl<const D: usize> Internal<D> for Fibres<D> {
    fn count(&self) -> usize {
        1
    }

    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64 {
        states[0] * self.lengthening(positions)
    }

    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]) {
        self.groups.iter().for_each(|g| g.add_force(at.positions, states[0], 0.0, force));
    }

    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]) {
        rates[0] = (at.tensions[self.muscle] - states[0]) / self.contraction_time;
    }

    fn update_internal_state(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]) {
        let a = step / self.contraction_time;
        states[0] = (states[0] + a * at.tensions[self.muscle]) / (1.0 + a);
    }

    fn add_stiffness(
        &self,
        at: Configuration<'_, D>,
        _step: f64,
        states: &[f64],
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        vectorised(
            #[inline(always)]
            || self.add_blocks(at.positions, states[0], 0.0, tangent, stiffness),
        );
    }
}
