//! Tissue as a continuum: linear finite elements of a compressible neo-Hookean solid, in place of springs and area terms.

use nalgebra::{SMatrix, SVector};

use crate::body::Cells;
use crate::geometry::simplex::{self, Corners, MAX_CORNERS};
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::{Configuration, Effect, Tangent};

/// A step may take at most this part of what is left of a cell's measure.
const LARGEST_LOSS: f64 = 0.9;
/// Components of a deformation gradient in space; in the plane the first four are used.
const COMPONENTS: usize = 9;

#[derive(Debug, Clone)]
struct Element<const D: usize> {
    nodes: [usize; MAX_CORNERS],
    /// Area, m², or volume, m³, at rest.
    rest: f64,
    /// Gradients of the shape functions at rest, 1/m.
    shape: Corners<D>,
    /// Diagonal blocks of the corners, then the blocks of the pairs (0,1) (0,2) .. in order.
    diagonal: [Slot; MAX_CORNERS],
    pairs: [Slot; 6],
}

/// What a deformation makes of an element.
struct Deformed<const D: usize> {
    /// Deformation gradient `F`.
    gradient: SMatrix<f64, D, D>,
    /// `J = det F`: the measure over that at rest.
    ratio: f64,
    /// Gradients of the shape functions in the deformed shape, `F⁻ᵀ` times those at rest, 1/m.
    shape: Corners<D>,
}

/// Energy of a cell: its rest measure times `W = μ/2 (tr FᵀF - D) - μ ln J + λ/2 (ln J)²`
/// (Bonet and Wood, Nonlinear Continuum Mechanics, 2nd ed., eq. 6.27).
///
/// At small strain it is the linear element `K_CST` of the same E and ν (thesis eqs. 3.38-3.42), which the springs are
/// matched to. In the plane it is plane strain: the third principal stretch is 1. Needs `J > 0`: the energy of an inverted cell is
/// `+∞`, so that a line search refuses it, and its force is not a number.
///
/// Linear simplices are too stiff in bending when nearly incompressible (volumetric locking at ν = 0.49); so are the
/// springs with one area term a triangle that are matched to them.
#[derive(Debug, Clone)]
pub struct FiniteElements<const D: usize> {
    /// Lamé's first constant λ, Pa.
    lambda: f64,
    /// Shear modulus μ, Pa.
    mu: f64,
    elements: Vec<Element<D>>,
}

impl<const D: usize> FiniteElements<D> {
    /// Elements with their shape at the given rest positions, m; `lame` is (λ, μ), Pa (2D: per metre of thickness).
    pub fn new(lame: (f64, f64), cells: &Cells<D>, rest_positions: &[SVector<f64, D>]) -> Self {
        let bin = Pattern::new(0, &[], []).bin();
        let elements = cells
            .iter()
            .map(|cell| {
                let mut nodes = [0; MAX_CORNERS];
                nodes[..=D].copy_from_slice(cell);
                let x = simplex::corners(rest_positions, cell);
                let rest = simplex::measure(&x);
                let shape = simplex::gradient(&x).map(|g| g / rest);
                Element { nodes, rest, shape, diagonal: [bin; MAX_CORNERS], pairs: [bin; 6] }
            })
            .collect();
        Self { lambda: lame.0, mu: lame.1, elements }
    }
}

impl<const D: usize> Element<D> {
    fn deformed(&self, positions: &[SVector<f64, D>]) -> Deformed<D> {
        let x = simplex::corners(positions, &self.nodes[..=D]);
        let measure = simplex::measure(&x);
        let mut gradient = SMatrix::zeros();
        for (x, shape) in x.iter().zip(&self.shape) {
            gradient += x * shape.transpose();
        }
        let shape = simplex::gradient(&x).map(|g| g / measure);
        Deformed { gradient, ratio: measure / self.rest, shape }
    }
}

impl<const D: usize> Effect<D> for FiniteElements<D> {
    fn name(&self) -> &'static str {
        "finite elements"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.elements.iter().for_each(|e| couple(&e.nodes[..=D]));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for e in &mut self.elements {
            let mut pair = 0;
            for a in 0..=D {
                e.diagonal[a] = pattern.slot(e.nodes[a], e.nodes[a]);
                for b in a + 1..=D {
                    e.pairs[pair] = pattern.slot(e.nodes[a], e.nodes[b]);
                    pair += 1;
                }
            }
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.elements
            .iter()
            .map(|e| {
                let d = e.deformed(at.positions);
                // Written so that a measure that is not a number counts as inverted too.
                if !(d.ratio > 0.0 && d.ratio.is_finite()) {
                    return f64::INFINITY;
                }
                let log = d.ratio.ln();
                let shear = 0.5 * self.mu * (d.gradient.norm_squared() - D as f64);
                e.rest * (shear + (0.5 * self.lambda * log - self.mu) * log)
            })
            .sum()
    }

    /// `-V0 P G` on each corner, with the first Piola-Kirchhoff stress `P = μ F + (λ ln J - μ) F⁻ᵀ` and the shape function's
    /// gradient `G`.
    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for e in &self.elements {
            let d = e.deformed(at.positions);
            let pressure = self.lambda * d.ratio.ln() - self.mu;
            for a in 0..=D {
                let stress = d.gradient * e.shape[a] * self.mu + d.shape[a] * pressure;
                force[e.nodes[a]] -= stress * e.rest;
            }
        }
    }

    /// `V0 (μ Ga·Gb I + λ ga gbᵀ + (μ - λ ln J) gb gaᵀ)`, `G` and `g` the shape functions' gradients at rest and deformed.
    ///
    /// [`Tangent::Convex`] leaves out the negative eigenvalues of `dP/dF` (Teran, Sifakis, Irving and Fedkiw 2005, section 5).
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for e in &self.elements {
            let d = e.deformed(at.positions);
            let turn = self.mu - self.lambda * d.ratio.ln();
            let convex = (tangent == Tangent::Convex).then(|| self.convex_moduli(&d));
            let block = |a: usize, b: usize| -> SMatrix<f64, D, D> {
                let block = match &convex {
                    Some(moduli) => contract(moduli, &e.shape[a], &e.shape[b]),
                    None => {
                        let (ga, gb) = (d.shape[a], d.shape[b]);
                        SMatrix::identity() * (self.mu * e.shape[a].dot(&e.shape[b]))
                            + ga * gb.transpose() * self.lambda
                            + gb * ga.transpose() * turn
                    }
                };
                block * e.rest
            };
            let mut pair = 0;
            for a in 0..=D {
                stiffness.add_symmetric(e.diagonal[a], &block(a, a));
                for b in a + 1..=D {
                    stiffness.add(e.pairs[pair], &block(a, b));
                    pair += 1;
                }
            }
        }
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        let mut limit: f64 = 1.0;
        for e in &self.elements {
            let x = simplex::corners(at.positions, &e.nodes[..=D]);
            let p = simplex::corners(step, &e.nodes[..=D]).map(|p| p * limit);
            let floor = (1.0 - LARGEST_LOSS) * simplex::measure(&x);
            limit *= simplex::way_above(&x, &p, floor);
        }
        limit
    }
}

type Moduli = SMatrix<f64, COMPONENTS, COMPONENTS>;

impl<const D: usize> FiniteElements<D> {
    /// `dP/dF` without its negative eigenvalues; component `(i, j)` of `F` has number `i + D j`.
    fn convex_moduli(&self, d: &Deformed<D>) -> Moduli {
        let mut moduli = Moduli::zeros();
        // An inverse that does not exist belongs to a cell without measure, where the energy is infinite already.
        let inverse = d.gradient.try_inverse().unwrap_or_else(SMatrix::zeros);
        let turn = self.mu - self.lambda * d.ratio.ln();
        for (i, j) in indices::<D>() {
            for (k, l) in indices::<D>() {
                let mut entry = self.lambda * inverse[(j, i)] * inverse[(l, k)]
                    + turn * inverse[(j, k)] * inverse[(l, i)];
                if (i, j) == (k, l) {
                    entry += self.mu;
                }
                moduli[(i + D * j, k + D * l)] = entry;
            }
        }
        let eigen = moduli.symmetric_eigen();
        let kept = eigen.eigenvalues.map(|v| v.max(0.0));
        eigen.eigenvectors * SMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose()
    }
}

fn indices<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..D).flat_map(|j| (0..D).map(move |i| (i, j)))
}

/// The block that moduli make between two shape functions with gradients `ga` and `gb`.
fn contract<const D: usize>(
    moduli: &Moduli,
    ga: &SVector<f64, D>,
    gb: &SVector<f64, D>,
) -> SMatrix<f64, D, D> {
    let mut block = SMatrix::zeros();
    for (i, j) in indices::<D>() {
        for (k, l) in indices::<D>() {
            block[(i, k)] += moduli[(i + D * j, k + D * l)] * ga[j] * gb[l];
        }
    }
    block
}
