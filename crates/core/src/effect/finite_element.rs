//! Tissue as a continuum: linear finite elements of a [`NeoHookean`] solid, in place of springs and area
//! terms.

use nalgebra::{SMatrix, SVector};

use crate::body::Cells;
use crate::geometry::simplex::{self, Corners};
use crate::material::law::{Deformed, contract};
use crate::material::{NeoHookean, Stress};
use crate::sparse::{BlockMatrix, Pattern};

use super::cell::Cell;
use super::{Configuration, Effect, Tangent};

#[derive(Debug, Clone)]
struct Element<const D: usize> {
    cell: Cell<D>,
    /// Gradients of the shape functions at rest, 1/m.
    shape: Corners<D>,
}

struct Strained<const D: usize> {
    law: Deformed<D>,
    /// Its measure, m² or m³.
    measure: f64,
    /// Gradients of the shape functions in the deformed shape, `F⁻ᵀ` times those at rest, 1/m.
    shape: Corners<D>,
}

/// Energy of a cell: its rest measure times the energy density of the law at the cell's deformation
/// gradient, which is the same everywhere in a linear simplex. At small strain the cell is the linear
/// element `K_CST` of the same E and ν (thesis eqs. 3.38-3.42), which the springs are matched to.
///
/// Linear simplices are too stiff in bending when nearly incompressible (volumetric locking at ν = 0.49); so
/// are the springs with one area term a triangle that are matched to them.
///
/// In time a Newtonian viscosity acts beside the law (Kelvin-Voigt): Cauchy's stress gains `2 η d`, `d` the
/// rate of deformation (symmetric part of the velocity's gradient), which resists no rigid motion. At small
/// strain shear relaxes with η/μ.
#[derive(Debug, Clone)]
pub struct FiniteElements<const D: usize> {
    law: NeoHookean,
    /// Viscosity η, N s/m².
    viscosity: f64,
    elements: Vec<Element<D>>,
}

impl<const D: usize> FiniteElements<D> {
    /// Elements of a law and a viscosity (N s/m²) with their shape at the given rest positions, m.
    pub fn new(
        law: NeoHookean,
        viscosity: f64,
        cells: &Cells<D>,
        rest_positions: &[SVector<f64, D>],
    ) -> Self {
        let element = |cell: Cell<D>| {
            let shape = simplex::gradient(&cell.corners(rest_positions)).map(|g| g / cell.rest);
            Element { cell, shape }
        };
        let elements = Cell::all(cells, rest_positions).map(element).collect();
        Self { law, viscosity, elements }
    }
}

impl<const D: usize> Element<D> {
    #[inline(always)]
    fn strained(&self, law: NeoHookean, positions: &[SVector<f64, D>]) -> Strained<D> {
        let x = self.cell.corners(positions);
        let measure = simplex::measure(&x);
        let mut gradient = SMatrix::zeros();
        for (x, shape) in x.iter().zip(&self.shape) {
            gradient += x * shape.transpose();
        }
        let shape = simplex::gradient(&x).map(|g| g / measure);
        Strained { law: law.at(gradient, measure / self.cell.rest), measure, shape }
    }
}

impl<const D: usize> Effect<D> for FiniteElements<D> {
    fn name(&self) -> &'static str {
        "finite elements"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.elements.iter().for_each(|e| couple(e.cell.nodes()));
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.elements.iter_mut().for_each(|e| e.cell.bind(pattern));
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.elements.iter().map(|e| e.cell.rest * e.strained(self.law, at.positions).law.energy()).sum()
    }

    /// `-V0 P G` on each corner, with the first Piola-Kirchhoff stress `P` and the shape function's gradient
    /// `G`.
    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for e in &self.elements {
            let s = e.strained(self.law, at.positions);
            for (a, &node) in e.cell.nodes().iter().enumerate() {
                force[node] -= s.law.stress(&e.shape[a], &s.shape[a]) * e.cell.rest;
            }
        }
    }

    /// `V0` times the block of `dP/dF` between the gradients of two shape functions; [`Tangent::Convex`]
    /// leaves out the negative eigenvalues of `dP/dF`.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for e in &self.elements {
            let s = e.strained(self.law, at.positions);
            let convex = (tangent == Tangent::Convex).then(|| s.law.convex_moduli());
            let block = |a: usize, b: usize| -> SMatrix<f64, D, D> {
                let (rest, deformed) = ([&e.shape[a], &e.shape[b]], [&s.shape[a], &s.shape[b]]);
                let block = match &convex {
                    Some(moduli) => contract(moduli, rest[0], rest[1]),
                    None => s.law.tangent(rest, deformed),
                };
                block * e.cell.rest
            };
            e.cell.add_stiffness(|a| block(a, a), block, stiffness);
        }
    }

    /// `-V 2 η d g` on each corner, `V` the deformed measure and `g` the shape function's gradient in the
    /// deformed shape.
    fn add_viscous_force(
        &self,
        at: Configuration<'_, D>,
        velocities: &[SVector<f64, D>],
        force: &mut [SVector<f64, D>],
    ) {
        for e in &self.elements {
            let s = e.strained(self.law, at.positions);
            let mut gradient = SMatrix::<f64, D, D>::zeros();
            for (v, shape) in e.cell.corners(velocities).iter().zip(&s.shape) {
                gradient += v * shape.transpose();
            }
            let stress = (gradient + gradient.transpose()) * (self.viscosity * s.measure);
            for (a, &node) in e.cell.nodes().iter().enumerate() {
                force[node] -= stress * s.shape[a];
            }
        }
    }

    /// `V η (ga·gb I + gb gaᵀ)` between two corners.
    fn add_damping(&self, at: Configuration<'_, D>, weight: f64, damping: &mut BlockMatrix<D>) {
        for e in &self.elements {
            let s = e.strained(self.law, at.positions);
            let block = |a: usize, b: usize| -> SMatrix<f64, D, D> {
                let [ga, gb] = [&s.shape[a], &s.shape[b]];
                let both = SMatrix::identity() * ga.dot(gb) + gb * ga.transpose();
                both * (weight * self.viscosity * s.measure)
            };
            e.cell.add_stiffness(|a| block(a, a), block, damping);
        }
    }

    fn stresses(&self, at: Configuration<'_, D>) -> Vec<Stress<D>> {
        self.elements.iter().map(|e| e.strained(self.law, at.positions).law.state()).collect()
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        Cell::step_limit(self.elements.iter().map(|e| &e.cell), at.positions, step)
    }
}
