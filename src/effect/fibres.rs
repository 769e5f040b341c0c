//! Muscles as fibres embedded in a continuum, which need not follow its edges.

use nalgebra::{SMatrix, SVector};

use crate::body::Strand;
use crate::geometry::quadratic::MAX_NODES;
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::{Configuration, Effect, Internal, Tangent};

/// Pairs of nodes of an element, each node with itself among them.
const MAX_PAIRS: usize = MAX_NODES * (MAX_NODES + 1) / 2;

/// A contracting muscle: the tension times `sum w (|y| - L)` over its [`Strand`]s, each with a vector `y = sum c_a x_a` of the
/// positions, its length `L` at rest and its weight `w`.
///
/// Of a point of a fibre in the tissue `y` is `F f0`, the fibre's direction at rest carried along, and the energy is that of a tension
/// which does not depend on the stretch: convex. Of a part outside the tissue `y` is the way from the bone to where it pulls.
/// What is passive in the muscle is tissue like all other.
///
/// In time the tension follows the one asked for with the time constant of the thesis's contractile element at constant length,
/// `b_cc/k2`; the series spring itself, which belongs to connections, has no counterpart here.
#[derive(Debug, Clone)]
pub struct Fibres {
    muscle: usize,
    groups: Vec<Group>,
    /// b_cc/k2, s.
    contraction_time: f64,
}

/// Strands on the same nodes: those of one element.
#[derive(Debug, Clone)]
struct Group {
    nodes: Vec<usize>,
    /// Weight and length at rest of each strand.
    strands: Vec<(f64, f64)>,
    /// The coefficients of all strands, one after another.
    coefficients: Vec<f64>,
    /// Of each pair of nodes, each with itself among them.
    slots: Vec<Slot>,
}

impl Fibres {
    /// Muscle number `muscle` of the mesh, made of these strands; its tension follows with the time constant `contraction_time`, s.
    pub fn new(muscle: usize, strands: &[Strand], contraction_time: f64) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        for strand in strands {
            let number = groups.iter().position(|g| g.nodes == strand.nodes).unwrap_or_else(|| {
                groups.push(Group {
                    nodes: strand.nodes.clone(),
                    strands: Vec::new(),
                    coefficients: Vec::new(),
                    slots: Vec::new(),
                });
                groups.len() - 1
            });
            groups[number].strands.push((strand.weight, strand.rest));
            groups[number].coefficients.extend(&strand.coefficients);
        }
        Self { muscle, groups, contraction_time }
    }

    /// What a unit of tension adds to the energy, m.
    fn lengthening<const D: usize>(&self, positions: &[SVector<f64, D>]) -> f64 {
        let strands = self.groups.iter().flat_map(|g| g.strands(positions));
        strands.map(|(weight, rest, _, y)| weight * (y.norm() - rest)).sum()
    }

    /// `F w c_a c_b (I - n nᵀ) / |y|`: never negative.
    fn add_stiffness_of<const D: usize>(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        stiffness: &mut BlockMatrix<D>,
    ) {
        if tension == 0.0 {
            return;
        }
        for g in &self.groups {
            // What pulls at many nodes at once has one strand, whose blocks need no adding up.
            let mut blocks = [SMatrix::<f64, D, D>::zeros(); MAX_PAIRS];
            let few = g.slots.len() <= MAX_PAIRS;
            for (weight, _, coefficients, y) in g.strands(positions) {
                let (length, n) = length_and_direction(&y);
                if length == 0.0 {
                    continue;
                }
                let across =
                    (SMatrix::<f64, D, D>::identity() - n * n.transpose()) * (tension * weight / length);
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

/// The length and the unit direction of a vector; of none the zero vector, so that nothing is divided by zero.
#[inline(always)]
fn length_and_direction<const D: usize>(y: &SVector<f64, D>) -> (f64, SVector<f64, D>) {
    let length = y.norm();
    if length > 0.0 { (length, y / length) } else { (0.0, SVector::zeros()) }
}

impl Group {
    /// The strands with their weight, length at rest, coefficients and vector.
    #[inline(always)]
    fn strands<'a, const D: usize>(
        &'a self,
        positions: &'a [SVector<f64, D>],
    ) -> impl Iterator<Item = (f64, f64, &'a [f64], SVector<f64, D>)> {
        self.strands.iter().zip(self.coefficients.chunks_exact(self.nodes.len())).map(
            |(&(weight, rest), coefficients)| {
                let mut y = SVector::zeros();
                for (&node, c) in self.nodes.iter().zip(coefficients) {
                    y += positions[node] * *c;
                }
                (weight, rest, coefficients, y)
            },
        )
    }

    /// Adds the force of a tension, N.
    #[inline(always)]
    fn add_force<const D: usize>(
        &self,
        positions: &[SVector<f64, D>],
        tension: f64,
        force: &mut [SVector<f64, D>],
    ) {
        for (weight, _, coefficients, y) in self.strands(positions) {
            let pull = length_and_direction(&y).1 * (tension * weight);
            for (&node, c) in self.nodes.iter().zip(coefficients) {
                force[node] -= pull * *c;
            }
        }
    }
}

impl<const D: usize> Effect<D> for Fibres {
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
            let nodes = &g.nodes;
            let pairs = nodes.iter().enumerate().flat_map(|(i, &a)| nodes[i..].iter().map(move |&b| (a, b)));
            g.slots = pairs.map(|(a, b)| pattern.slot(a, b)).collect();
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        at.tensions[self.muscle] * self.lengthening(at.positions)
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        let tension = at.tensions[self.muscle];
        self.groups.iter().for_each(|g| g.add_force(at.positions, tension, force));
    }

    fn add_stiffness(&self, at: Configuration<'_, D>, _tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        self.add_stiffness_of(at.positions, at.tensions[self.muscle], stiffness);
    }

    fn add_force_per_tension(
        &self,
        at: Configuration<'_, D>,
        muscle: usize,
        derivative: &mut [SVector<f64, D>],
    ) {
        if muscle == self.muscle {
            self.groups.iter().for_each(|g| g.add_force(at.positions, 1.0, derivative));
        }
    }

    fn internal(&self) -> Option<&dyn Internal<D>> {
        Some(self)
    }
}

/// One state: the tension of the muscle, N (0 at first), which follows the one asked for.
impl<const D: usize> Internal<D> for Fibres {
    fn count(&self) -> usize {
        1
    }

    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64 {
        states[0] * self.lengthening(positions)
    }

    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]) {
        self.groups.iter().for_each(|g| g.add_force(at.positions, states[0], force));
    }

    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]) {
        rates[0] = (at.tensions[self.muscle] - states[0]) / self.contraction_time;
    }

    fn settle(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]) {
        let a = step / self.contraction_time;
        states[0] = (states[0] + a * at.tensions[self.muscle]) / (1.0 + a);
    }

    fn add_stiffness(
        &self,
        at: Configuration<'_, D>,
        _step: f64,
        states: &[f64],
        _tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        self.add_stiffness_of(at.positions, states[0], stiffness);
    }
}
