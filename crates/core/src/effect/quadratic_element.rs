//! Tissue as a continuum that hardly locks: quadratic finite elements of a [`NeoHookean`] solid.

use nalgebra::{SMatrix, SVector};

use crate::geometry::quadratic::{self, MAX_NODES};
use crate::geometry::simplex::{self, MAX_CORNERS};
use crate::material::law::{Deformed, contract};
use crate::material::{NeoHookean, Stress};
use crate::sparse::pattern::pairs;
use crate::sparse::simd::vectorised;
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::{Configuration, Effect, Tangent};

const MAX_PAIRS: usize = MAX_NODES * (MAX_NODES + 1) / 2;

/// The energy density of the law integrated over simplices with a node at each corner and in the middle of each edge, at three interior
/// points of a triangle and four of a tetrahedron. The pressure follows from the law at each point and is no unknown.
///
/// With three points a large mesh of six-node triangles has one constraint of incompressibility for every two unknowns. So it does not
/// lock up to ν = 0.499, where linear elements lock at 0.49 (Zienkiewicz and Taylor, The Finite Element Method, 6th ed., vol. 1, 12.4).
/// The error of displacements is of third order in the element size where the solution is smooth.
#[derive(Debug, Clone)]
pub struct QuadraticElements<const D: usize> {
    law: NeoHookean,
    /// N s/m².
    viscosity: f64,
    /// Positions of all nodes at rest, m.
    rest: Vec<SVector<f64, D>>,
    elements: Vec<Element<D>>,
}

#[derive(Debug, Clone)]
struct Element<const D: usize> {
    nodes: [usize; MAX_NODES],
    /// Area, m², or volume, m³, at rest of each point.
    share: f64,
    /// Gradients of the shape functions at rest at each point, 1/m.
    shapes: [Shapes<D>; MAX_CORNERS],
    /// For each pair of nodes the product of their gradients, summed over all points, 1/m².
    products: [f64; MAX_PAIRS],
    slots: [Slot; MAX_PAIRS],
}

type Shapes<const D: usize> = [SVector<f64, D>; MAX_NODES];

impl<const D: usize> QuadraticElements<D> {
    const NODES: usize = quadratic::nodes::<D>();

    /// Elements of a law and a viscosity (N s/m²) with these nodes (corners, then the middles of [`quadratic::edges`]) and positions at
    /// rest, m. Sides are straight at rest, so that only the positions of corners are used.
    pub fn new<'a>(
        law: NeoHookean,
        viscosity: f64,
        elements: impl Iterator<Item = &'a [usize]>,
        rest_positions: &[SVector<f64, D>],
    ) -> Self {
        let elements = elements.map(|given| {
            let mut nodes = [0; MAX_NODES];
            nodes[..Self::NODES].copy_from_slice(given);
            let corners = simplex::corners(rest_positions, &given[..=D]);
            let measure = simplex::measure(&corners);
            let of_coordinates = simplex::gradient(&corners).map(|g| g / measure);
            let points = quadratic::points::<D>();
            let mut shapes = [[SVector::zeros(); MAX_NODES]; MAX_CORNERS];
            for (shape, at) in shapes.iter_mut().zip(points) {
                *shape = quadratic::gradients(at, &of_coordinates);
            }
            let share = measure / points.len() as f64;
            Element { nodes, share, shapes, products: [0.0; MAX_PAIRS], slots: [Slot::UNBOUND; MAX_PAIRS] }
        });
        Self { law, viscosity, rest: rest_positions.to_vec(), elements: elements.collect() }
    }

    #[inline(always)]
    fn displaced(&self, e: &Element<D>, positions: &[SVector<f64, D>]) -> Shapes<D> {
        gather(&e.nodes, |node| positions[node] - self.rest[node])
    }

    /// Adds the convex stiffness of an element by the eigenvalues of the moduli at each point.
    fn add_convex(&self, e: &Element<D>, displaced: &Shapes<D>, stiffness: &mut BlockMatrix<D>) {
        let mut blocks = [SMatrix::<f64, D, D>::zeros(); MAX_PAIRS];
        e.at_points(self.law, displaced, |shape, deformed, law| {
            let convex = law.nearest_convex_moduli();
            for (block, (a, b)) in blocks.iter_mut().zip(pairs(Self::NODES)) {
                *block += match &convex {
                    Some(moduli) => contract(moduli, &shape[a], &shape[b]),
                    None => law.tangent([&shape[a], &shape[b]], [&deformed[a], &deformed[b]]),
                };
            }
        });
        for ((slot, block), _) in e.slots.iter().zip(&blocks).zip(pairs(Self::NODES)) {
            stiffness.add(*slot, &(block * e.share));
        }
    }

    /// Adds the stiffness of every element. The part that does not depend on the shape was computed once (`products`); the rest is summed
    /// over the integration points.
    #[inline(always)]
    fn add_blocks(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        let NeoHookean { lambda, mu } = self.law;
        let convex = tangent == Tangent::Convex;
        let count = quadratic::points::<D>().len();
        for e in &self.elements {
            let displaced = self.displaced(e, at.positions);
            let none = [[SVector::<f64, D>::zeros(); MAX_NODES]; MAX_CORNERS];
            let (mut points, mut untwisted, mut turns) = (none, none, [0.0; MAX_CORNERS]);
            let (mut point, mut is_simple) = (0, true);
            e.at_points(self.law, &displaced, |shape, deformed, law| {
                points[point] = *deformed;
                turns[point] = law.transpose_modulus() * e.share;
                if convex {
                    let untwisting = law.untwisting();
                    is_simple &= untwisting.is_some();
                    let untwisting = untwisting.unwrap_or_else(SMatrix::zeros) * e.share.sqrt();
                    untwisted[point] = shape.map(|g| untwisting * g);
                }
                point += 1;
            });
            if !is_simple {
                self.add_convex(e, &displaced, stiffness);
                continue;
            }
            let (lambda, mu) = (lambda * e.share, mu * e.share);
            let mut pair = 0;
            for a in 0..Self::NODES {
                for b in a..Self::NODES {
                    let mut block = SMatrix::<f64, D, D>::identity() * (mu * e.products[pair]);
                    for (deformed, turn) in points[..count].iter().zip(turns) {
                        let (ga, gb) = (deformed[a], deformed[b]);
                        let (stretched, turned) = (ga * lambda, ga * turn);
                        for c in 0..D {
                            for r in 0..D {
                                block[(r, c)] += stretched[r] * gb[c] + turned[c] * gb[r];
                            }
                        }
                    }
                    if convex {
                        untwisted[..count].iter().for_each(|g| block += g[a] * g[b].transpose());
                    }
                    stiffness.add(e.slots[pair], &block);
                    pair += 1;
                }
            }
        }
    }
}

impl<const D: usize> Element<D> {
    const NODES: usize = quadratic::nodes::<D>();

    #[inline(always)]
    fn nodes(&self) -> &[usize] {
        &self.nodes[..Self::NODES]
    }

    #[inline(always)]
    fn shapes(&self) -> &[Shapes<D>] {
        &self.shapes[..quadratic::points::<D>().len()]
    }

    /// Calls `point` for every integration point with the gradients of the shape functions at rest and in the deformed shape (`F⁻ᵀ` times
    /// those at rest), and the state of the law.
    #[inline(always)]
    fn at_points(
        &self,
        law: NeoHookean,
        displaced: &Shapes<D>,
        mut point: impl FnMut(&Shapes<D>, &Shapes<D>, Deformed<D>),
    ) {
        for shape in self.shapes() {
            let by = gradient(shape, displaced);
            let here = law.displaced(&by);
            let inverse_transpose = cofactors(&(SMatrix::identity() + by)) * (1.0 / here.volume_ratio);
            let mut deformed = [SVector::zeros(); MAX_NODES];
            for (deformed, shape) in deformed[..Self::NODES].iter_mut().zip(shape) {
                *deformed = inverse_transpose * shape;
            }
            point(shape, &deformed, here);
        }
    }
}

/// A vector of each of an element's nodes.
#[inline(always)]
pub(super) fn gather<const D: usize>(
    nodes: &[usize; MAX_NODES],
    of_node: impl Fn(usize) -> SVector<f64, D>,
) -> Shapes<D> {
    let mut own = [SVector::zeros(); MAX_NODES];
    for (own, &node) in own.iter_mut().zip(&nodes[..quadratic::nodes::<D>()]) {
        *own = of_node(node);
    }
    own
}

/// The gradient of a field with these values at the nodes, from the gradients of the shape functions.
#[inline(always)]
fn gradient<const D: usize>(shape: &Shapes<D>, of_nodes: &Shapes<D>) -> SMatrix<f64, D, D> {
    let mut gradient = SMatrix::zeros();
    for (of_node, shape) in of_nodes[..quadratic::nodes::<D>()].iter().zip(shape) {
        gradient += of_node * shape.transpose();
    }
    gradient
}

/// `det F F⁻ᵀ`.
#[inline(always)]
fn cofactors<const D: usize>(f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let slopes = simplex::gradient(&simplex::of_columns(f));
    let mut out = SMatrix::<f64, D, D>::zeros();
    for d in 0..D {
        out.set_column(d, &(slopes[d + 1] * simplex::factorial::<D>()));
    }
    out
}

impl<const D: usize> Effect<D> for QuadraticElements<D> {
    fn name(&self) -> &'static str {
        "quadratic elements"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.elements.iter().for_each(|e| couple(e.nodes()));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for e in &mut self.elements {
            // In the reverse order of elimination no block has to be transposed to be stored.
            let mut order: Vec<usize> = (0..Self::NODES).collect();
            order.sort_by_key(|&a| std::cmp::Reverse(pattern.unknown(e.nodes[a])));
            let old = e.clone();
            for (new, &a) in order.iter().enumerate() {
                e.nodes[new] = old.nodes[a];
                e.shapes.iter_mut().zip(&old.shapes).for_each(|(shape, old)| shape[new] = old[a]);
            }
            let points = &e.shapes[..quadratic::points::<D>().len()];
            for ((slot, product), (a, b)) in e.slots.iter_mut().zip(&mut e.products).zip(pairs(Self::NODES)) {
                *slot = pattern.slot(e.nodes[a], e.nodes[b]);
                *product = points.iter().map(|shape| shape[a].dot(&shape[b])).sum();
            }
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let mut energy = 0.0;
        for e in &self.elements {
            let displaced = self.displaced(e, at.positions);
            for shape in e.shapes() {
                energy += e.share * self.law.displaced_energy(&gradient(shape, &displaced));
            }
        }
        energy
    }

    /// `-V0 P G` on each node for each point, with the first Piola-Kirchhoff stress `P` and the shape function's gradient `G`.
    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for e in &self.elements {
            let displaced = self.displaced(e, at.positions);
            let mut pull = [SVector::<f64, D>::zeros(); MAX_NODES];
            for shape in e.shapes() {
                let by = gradient(shape, &displaced);
                let law = self.law.displaced(&by);
                let inverse_transpose = cofactors(&(SMatrix::identity() + by)) * (1.0 / law.volume_ratio);
                let stress = law.piola(&inverse_transpose);
                for (pull, shape) in pull[..Self::NODES].iter_mut().zip(shape) {
                    *pull += stress * shape;
                }
            }
            for (&node, pull) in e.nodes().iter().zip(&pull) {
                force[node] -= pull * e.share;
            }
        }
    }

    /// `V0` times the block of `dP/dF` between the gradients of two shape functions for each point; [`Tangent::Convex`] leaves out the
    /// negative eigenvalues of `dP/dF`.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        vectorised(
            #[inline(always)]
            || self.add_blocks(at, tangent, stiffness),
        );
    }

    /// `-V 2 η d g` on each node for each point, with the deformed measure `V`, the rate of deformation `d` and the shape function's
    /// gradient `g`.
    fn add_viscous_force(
        &self,
        at: Configuration<'_, D>,
        velocities: &[SVector<f64, D>],
        force: &mut [SVector<f64, D>],
    ) {
        for e in &self.elements {
            let moving = gather(&e.nodes, |node| velocities[node]);
            e.at_points(self.law, &self.displaced(e, at.positions), |_, deformed, law| {
                let gradient = gradient(deformed, &moving);
                let stress =
                    (gradient + gradient.transpose()) * (self.viscosity * e.share * law.volume_ratio);
                for (&node, shape) in e.nodes().iter().zip(deformed) {
                    force[node] -= stress * shape;
                }
            });
        }
    }

    /// `V η (ga·gb I + gb gaᵀ)` between two nodes for each point.
    fn add_damping(&self, at: Configuration<'_, D>, weight: f64, damping: &mut BlockMatrix<D>) {
        for e in &self.elements {
            e.at_points(self.law, &self.displaced(e, at.positions), |_, deformed, law| {
                let scale = weight * self.viscosity * e.share * law.volume_ratio;
                for (slot, (a, b)) in e.slots.iter().zip(pairs(Self::NODES)) {
                    let [ga, gb] = [&deformed[a], &deformed[b]];
                    let both = SMatrix::identity() * ga.dot(gb) + gb * ga.transpose();
                    damping.add(*slot, &(both * scale));
                }
            });
        }
    }

    /// The state in the middle of each linear part of each element; the parts are the cells of the mesh.
    fn stresses(&self, at: Configuration<'_, D>) -> Vec<Stress<D>> {
        let points = quadratic::points::<D>();
        // Gradients are linear within an element, so that the gradient in the middle of a part is a weighted sum of those at the points.
        let weights = quadratic::parts::<D>().iter().map(|part| {
            let middle = quadratic::middle::<D>(part);
            let (near, far) = (points[0][0], points[0][1]);
            middle.map(|l| (l - far) / (near - far))
        });
        let weights: Vec<[f64; MAX_CORNERS]> = weights.collect();
        Vec::from_iter(self.elements.iter().flat_map(|e| {
            let displaced = self.displaced(e, at.positions);
            let gradients: Vec<_> = e.shapes().iter().map(|shape| gradient(shape, &displaced)).collect();
            Vec::from_iter(weights.iter().map(|weights| {
                let parts = gradients.iter().zip(weights).map(|(g, w)| g * *w);
                self.law.displaced(&parts.fold(SMatrix::zeros(), |a, b| a + b)).state()
            }))
        }))
    }

    /// Largest part of `step` for which the tissue keeps a tenth of its area or volume at every point.
    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        let mut limit: f64 = 1.0;
        for e in &self.elements {
            let (x, p) = (gather(&e.nodes, |node| at.positions[node]), gather(&e.nodes, |node| step[node]));
            for shape in e.shapes() {
                let x = simplex::of_columns(&gradient(shape, &x));
                let p = simplex::of_columns(&(gradient(shape, &p) * limit));
                limit *= simplex::safe_part(&x, &p);
            }
        }
        limit
    }
}
