//! Nearly incompressible cells: triangles that keep their area, tetrahedra that keep their volume (Kato 2014, 3.3).

use nalgebra::{SMatrix, SVector};

use super::barrier::{self, barrier};
use super::{Configuration, Effect, PrimitiveElement, Tangent};
use crate::body::Cells;
use crate::geometry::simplex::{self, Corners, MAX_CORNERS};
use crate::sparse::pattern::pairs;
use crate::sparse::{BlockMatrix, Pattern, Slot};

/// Largest number of pairs of corners of a cell; a corner with itself counts as a pair.
const MAX_PAIRS: usize = MAX_CORNERS * (MAX_CORNERS + 1) / 2;

/// `W = 1/2 kappa ((S - S0)/S0)²` for every cell with the *signed* area (2D; eq. 3.28) or volume (3D; eq. 3.16) `S`.
///
/// The force is `-kappa (S - S0)/S0² dS/dx`, eqs. 3.30 and 3.18 with the sign of a conservative force and a signed gradient. Below a tenth
/// of the measure at rest kappa times a [`barrier()`] is added, so that no cell is inverted.
#[derive(Debug, Clone)]
pub struct Incompressibility<const D: usize> {
    /// kappa_s (2D) or kappa_v (3D), J.
    kappa: f64,
    cells: Vec<Cell<D>>,
}

#[derive(Debug, Clone)]
struct Cell<const D: usize> {
    nodes: [usize; MAX_CORNERS],
    /// Area, m², or volume, m³, at rest.
    rest: f64,
    /// A slot for each pair of corners, with those of a corner with itself.
    slots: [Slot; MAX_PAIRS],
}

impl<const D: usize> Cell<D> {
    #[inline(always)]
    fn nodes(&self) -> &[usize] {
        &self.nodes[..=D]
    }

    /// Positions, or steps, of its corners.
    #[inline(always)]
    fn corners(&self, of_nodes: &[SVector<f64, D>]) -> Corners<D> {
        simplex::corners(of_nodes, self.nodes())
    }
}

impl<const D: usize> Incompressibility<D> {
    /// Cells with their measure at these positions at rest, m; `kappa` in J (2D: per metre of thickness).
    pub fn new(kappa: f64, cells: &Cells<D>, rest_positions: &[SVector<f64, D>]) -> Self {
        let cells = cells.iter().map(|given| {
            let mut nodes = [0; MAX_CORNERS];
            nodes[..=D].copy_from_slice(given);
            let rest = simplex::measure(&simplex::corners(rest_positions, given));
            Cell { nodes, rest, slots: [Slot::UNBOUND; MAX_PAIRS] }
        });
        Self { kappa, cells: cells.collect() }
    }
}

impl<const D: usize> Effect<D> for Incompressibility<D> {
    fn name(&self) -> &'static str {
        "incompressibility"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.cells.iter().for_each(|c| couple(c.nodes()));
    }

    fn parts(&self, visit: &mut dyn FnMut(PrimitiveElement<'_>)) -> bool {
        self.cells.iter().for_each(|c| {
            visit(PrimitiveElement::Cell { nodes: c.nodes(), rest: c.rest, kappa: self.kappa })
        });
        true
    }

    fn bind(&mut self, pattern: &Pattern) {
        for c in &mut self.cells {
            let slots = pattern.pair_slots(&c.nodes[..=D]);
            c.slots.iter_mut().zip(slots).for_each(|(place, slot)| *place = slot);
        }
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let strain_squares = self.cells.iter().map(|c| {
            let strain = (simplex::measure(&c.corners(at.positions)) - c.rest) / c.rest;
            let is_flat = strain < barrier::THRESHOLD - 1.0;
            strain * strain + if is_flat { 2.0 * barrier(strain + 1.0).value } else { 0.0 }
        });
        0.5 * self.kappa * strain_squares.sum::<f64>()
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

    /// `kappa/S0² (g gᵀ + (S - S0) d²S/dx²)`; [`Tangent::Convex`] keeps the first part, which is positive semidefinite.
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
            let outer =
                |a: usize, b: usize| -> SMatrix<f64, D, D> { gradient[a] * scale * gradient[b].transpose() };
            for (&slot, (a, b)) in c.slots.iter().zip(pairs(D + 1)) {
                if a == b {
                    stiffness.add_symmetric(slot, &outer(a, a));
                } else {
                    stiffness.add(slot, &(outer(a, b) + simplex::hessian(&x, a, b) * bend));
                }
            }
        }
    }

    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        self.cells.iter().fold(1.0, |limit, c| {
            limit * simplex::safe_part(&c.corners(at.positions), &c.corners(step).map(|p| p * limit))
        })
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }

    fn barrier_active(&self, at: Configuration<'_, D>) -> usize {
        let least = |c: &Cell<D>| barrier::THRESHOLD * c.rest;
        self.cells.iter().filter(|c| simplex::measure(&c.corners(at.positions)) < least(c)).count()
    }
}
