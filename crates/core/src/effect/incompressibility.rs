//! Near-incompressible cells: triangles that keep their area, tetrahedra that keep their volume (Kato 2014,
//! 3.3).

use nalgebra::SVector;

use crate::body::Cells;
use crate::geometry::simplex;
use crate::sparse::{BlockMatrix, Pattern};

use super::barrier::{self, barrier};
use super::cell::Cell;
use super::{Configuration, Effect, Part, Tangent};

/// `W = 1/2 kappa ((S - S0)/S0)²` for every cell, `S` its *signed* area (2D; eq. 3.28) or volume (3D; eq.
/// 3.16).
///
/// Force `-kappa (S - S0)/S0² dS/dx`: eqs. 3.30 and 3.18 with the sign of a conservative force and a signed
/// gradient. Below a tenth of the measure at rest a [`barrier()`] is added, times kappa, so that no cell
/// turns over.
#[derive(Debug, Clone)]
pub struct Incompressibility<const D: usize> {
    /// kappa_s (2D) or kappa_v (3D), J.
    kappa: f64,
    cells: Vec<Cell<D>>,
}

impl<const D: usize> Incompressibility<D> {
    /// Cells with their measure at the given rest positions, m; `kappa` in J (2D: per metre of thickness).
    pub fn new(kappa: f64, cells: &Cells<D>, rest_positions: &[SVector<f64, D>]) -> Self {
        Self { kappa, cells: Cell::all(cells, rest_positions).collect() }
    }
}

impl<const D: usize> Effect<D> for Incompressibility<D> {
    fn name(&self) -> &'static str {
        "incompressibility"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.cells.iter().for_each(|c| couple(c.nodes()));
    }

    fn parts(&self, visit: &mut dyn FnMut(Part<'_>)) -> bool {
        let part = |c: &Cell<D>| visit(Part::Cell { nodes: c.nodes(), rest: c.rest, kappa: self.kappa });
        self.cells.iter().for_each(part);
        true
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.cells.iter_mut().for_each(|c| c.bind(pattern));
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let strain_squares: f64 = self
            .cells
            .iter()
            .map(|c| {
                let x = c.corners(at.positions);
                let strain = (simplex::measure(&x) - c.rest) / c.rest;
                let square = strain * strain;
                if strain < barrier::THRESHOLD - 1.0 {
                    square + 2.0 * barrier(strain + 1.0).value
                } else {
                    square
                }
            })
            .sum();
        0.5 * self.kappa * strain_squares
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for c in &self.cells {
            let x = c.corners(at.positions);
            let measure = simplex::measure(&x);
            let mut pressure = -self.kappa * (measure - c.rest) / (c.rest * c.rest);
            if measure < barrier::THRESHOLD * c.rest {
                pressure -= self.kappa * barrier(measure / c.rest).slope / c.rest;
            }
            let gradient = simplex::gradient(&x);
            for (&node, g) in c.nodes().iter().zip(&gradient) {
                force[node] += g * pressure;
            }
        }
    }

    /// `kappa/S0² (g gᵀ + (S - S0) d²S/dx²)`; [`Tangent::Convex`] keeps the first part, which is positive
    /// semidefinite.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for c in &self.cells {
            let x = c.corners(at.positions);
            let mut scale = self.kappa / (c.rest * c.rest);
            let measure = simplex::measure(&x);
            let mut bend = scale * (measure - c.rest);
            if measure < barrier::THRESHOLD * c.rest {
                let b = barrier(measure / c.rest);
                bend += scale * c.rest * b.slope;
                scale += scale * b.curvature;
            }
            if tangent == Tangent::Convex {
                bend = 0.0;
            }
            let gradient = simplex::gradient(&x);
            let outer = |a: usize, b: usize| gradient[a] * scale * gradient[b].transpose();
            let pair = |a: usize, b: usize| outer(a, b) + simplex::hessian(&x, a, b) * bend;
            c.add_stiffness(|a| outer(a, a), pair, stiffness);
        }
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        Cell::step_limit(self.cells.iter(), at.positions, step)
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn guarded(&self, at: Configuration<'_, D>) -> usize {
        let flat = |c: &&Cell<D>| {
            let x = c.corners(at.positions);
            simplex::measure(&x) < barrier::THRESHOLD * c.rest
        };
        self.cells.iter().filter(flat).count()
    }
}
