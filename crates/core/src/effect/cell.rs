//! Shared by effects on cells: corners, area or volume at rest, and the places of the stiffness blocks.

use nalgebra::{SMatrix, SVector};

use crate::body::Cells;
use crate::geometry::simplex::{self, Corners, MAX_CORNERS};
use crate::sparse::{BlockMatrix, Pattern, Slot};

/// A step may reduce the area or volume of a cell by at most this part of it.
pub(super) const LARGEST_LOSS: f64 = 0.9;

/// A triangle or tetrahedron of tissue.
#[derive(Debug, Clone)]
pub(super) struct Cell<const D: usize> {
    nodes: [usize; MAX_CORNERS],
    /// Area, m², or volume, m³, at rest.
    pub rest: f64,
    /// Diagonal blocks of the corners, then the blocks of the pairs (0,1) (0,2) .. in order.
    diagonal: [Slot; MAX_CORNERS],
    pairs: [Slot; 6],
}

impl<const D: usize> Cell<D> {
    /// The cells with their measure at the given rest positions, m, not yet bound to a matrix.
    pub fn all(cells: &Cells<D>, rest_positions: &[SVector<f64, D>]) -> impl Iterator<Item = Self> {
        cells.iter().map(move |cell| {
            let mut nodes = [0; MAX_CORNERS];
            nodes[..=D].copy_from_slice(cell);
            let rest = simplex::measure(&simplex::corners(rest_positions, cell));
            Self { nodes, rest, diagonal: [Slot::UNBOUND; MAX_CORNERS], pairs: [Slot::UNBOUND; 6] }
        })
    }

    #[inline(always)]
    pub fn nodes(&self) -> &[usize] {
        &self.nodes[..=D]
    }

    /// Positions of its corners, or steps of them.
    #[inline(always)]
    pub fn corners(&self, of_nodes: &[SVector<f64, D>]) -> Corners<D> {
        simplex::corners(of_nodes, self.nodes())
    }

    pub fn bind(&mut self, pattern: &Pattern) {
        let mut pair = 0;
        for a in 0..=D {
            self.diagonal[a] = pattern.slot(self.nodes[a], self.nodes[a]);
            for b in a + 1..=D {
                self.pairs[pair] = pattern.slot(self.nodes[a], self.nodes[b]);
                pair += 1;
            }
        }
    }

    #[inline(always)]
    pub fn add_stiffness(
        &self,
        of_corner: impl Fn(usize) -> SMatrix<f64, D, D>,
        of_pair: impl Fn(usize, usize) -> SMatrix<f64, D, D>,
        stiffness: &mut BlockMatrix<D>,
    ) {
        let mut pair = 0;
        for a in 0..=D {
            stiffness.add_symmetric(self.diagonal[a], &of_corner(a));
            for b in a + 1..=D {
                stiffness.add(self.pairs[pair], &of_pair(a, b));
                pair += 1;
            }
        }
    }

    /// Largest part of `step` that leaves all cells a tenth of their area or volume.
    #[inline(always)]
    pub fn step_limit<'a>(
        cells: impl Iterator<Item = &'a Self>,
        positions: &[SVector<f64, D>],
        step: &[SVector<f64, D>],
    ) -> f64 {
        let mut limit: f64 = 1.0;
        for cell in cells {
            let x = cell.corners(positions);
            let p = cell.corners(step).map(|p| p * limit);
            let floor = (1.0 - LARGEST_LOSS) * simplex::measure(&x);
            limit *= simplex::way_above(&x, &p, floor);
        }
        limit
    }
}
