//! Near-incompressible cells: triangles that keep their area, tetrahedra that keep their volume (Kato 2014, 3.3).

use nalgebra::SVector;

use crate::body::Cells;
use crate::geometry::simplex::{self, MAX_CORNERS};
use crate::sparse::{BlockMatrix, Pattern, Slot};

use super::barrier::{self, barrier};
use super::{Configuration, Effect, Tangent};

/// A step may take at most this part of what is left of a cell's measure.
const LARGEST_LOSS: f64 = 0.9;

#[derive(Debug, Clone)]
struct Cell {
    nodes: [usize; MAX_CORNERS],
    rest: f64,
    /// Diagonal blocks of the corners, then the blocks of the pairs (0,1) (0,2) .. in order.
    diagonal: [Slot; MAX_CORNERS],
    pairs: [Slot; 6],
}

/// `W = 1/2 kappa ((S - S0)/S0)²` for every cell, `S` its *signed* area (2D; eq. 3.28) or volume (3D; eq. 3.16).
///
/// Force `-kappa (S - S0)/S0² dS/dx`: eqs. 3.30 and 3.18 with the sign of a conservative force and a signed gradient.
/// Below a tenth of the measure at rest a [`barrier()`] is added, times kappa, so that no cell turns over.
#[derive(Debug, Clone)]
pub struct Incompressibility {
    /// kappa_s (2D) or kappa_v (3D), J.
    kappa: f64,
    cells: Vec<Cell>,
}

impl Incompressibility {
    /// Cells with their measure at the given rest positions; `kappa` in J (2D: per metre of thickness).
    pub fn new<const D: usize>(kappa: f64, cells: &Cells<D>, rest_positions: &[SVector<f64, D>]) -> Self {
        let bin = Pattern::new(0, &[], []).bin();
        let cells = cells
            .iter()
            .map(|cell| {
                let mut nodes = [0; MAX_CORNERS];
                nodes[..=D].copy_from_slice(cell);
                Cell {
                    nodes,
                    rest: simplex::measure(&simplex::corners(rest_positions, cell)),
                    diagonal: [bin; MAX_CORNERS],
                    pairs: [bin; 6],
                }
            })
            .collect();
        Self { kappa, cells }
    }
}

impl<const D: usize> Effect<D> for Incompressibility {
    fn name(&self) -> &'static str {
        "incompressibility"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.cells.iter().for_each(|c| couple(&c.nodes[..=D]));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for cell in &mut self.cells {
            let mut pair = 0;
            for a in 0..=D {
                cell.diagonal[a] = pattern.slot(cell.nodes[a], cell.nodes[a]);
                for b in a + 1..=D {
                    cell.pairs[pair] = pattern.slot(cell.nodes[a], cell.nodes[b]);
                    pair += 1;
                }
            }
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let strain_squares: f64 = self
            .cells
            .iter()
            .map(|c| {
                let x = simplex::corners(at.positions, &c.nodes[..=D]);
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
            let x = simplex::corners(at.positions, &c.nodes[..=D]);
            let measure = simplex::measure(&x);
            let mut pressure = -self.kappa * (measure - c.rest) / (c.rest * c.rest);
            if measure < barrier::THRESHOLD * c.rest {
                pressure -= self.kappa * barrier(measure / c.rest).slope / c.rest;
            }
            let gradient = simplex::gradient(&x);
            for a in 0..=D {
                force[c.nodes[a]] += gradient[a] * pressure;
            }
        }
    }

    /// `kappa/S0² (g gᵀ + (S - S0) d²S/dx²)`; [`Tangent::Convex`] keeps the first part, which is positive semidefinite.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for c in &self.cells {
            let x = simplex::corners(at.positions, &c.nodes[..=D]);
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
            let mut pair = 0;
            for a in 0..=D {
                let ga = gradient[a] * scale;
                stiffness.add_symmetric(c.diagonal[a], &(ga * gradient[a].transpose()));
                for (b, gb) in gradient.iter().enumerate().take(D + 1).skip(a + 1) {
                    let block = ga * gb.transpose() + simplex::hessian(&x, a, b) * bend;
                    stiffness.add(c.pairs[pair], &block);
                    pair += 1;
                }
            }
        }
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        let mut limit: f64 = 1.0;
        for c in &self.cells {
            let x = simplex::corners(at.positions, &c.nodes[..=D]);
            let p = simplex::corners(step, &c.nodes[..=D]).map(|p| p * limit);
            let floor = (1.0 - LARGEST_LOSS) * simplex::measure(&x);
            limit *= simplex::way_above(&x, &p, floor);
        }
        limit
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn guarded(&self, at: Configuration<'_, D>) -> usize {
        let flat = |c: &&Cell| {
            let x = simplex::corners(at.positions, &c.nodes[..=D]);
            simplex::measure(&x) < barrier::THRESHOLD * c.rest
        };
        self.cells.iter().filter(flat).count()
    }
}
