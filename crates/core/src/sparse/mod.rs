//! Sparse symmetric matrices of `D x D` blocks, one block row and column for each unknown node.
//!
//! Factorisation and triangular solves are this crate's own, because they are faster than faer's sparse Cholesky on the same matrices
//! (`cargo bench factorise`). From a few hundred unknowns in space, or a few thousand in the plane, faer's supernodal factorisation is
//! faster and is used.

pub mod cholesky;
mod dissection;
pub(crate) mod flat;
pub mod ordering;
pub mod pattern;
pub(crate) mod simd;
mod supernodal;

use nalgebra::SMatrix;

pub use pattern::{Pattern, Slot};

/// Values of a symmetric block matrix on a [`Pattern`]: the lower triangle, column by column, with zeros for fill-in.
///
/// Assembly writes to the places that the factorisation uses, so that a factorisation starts with one copy. The last block, the bin,
/// collects the contributions of fixed nodes, so that assembly needs no branches.
#[derive(Debug, Clone)]
pub struct BlockMatrix<const D: usize> {
    pub(crate) blocks: Vec<SMatrix<f64, D, D>>,
}

impl<const D: usize> BlockMatrix<D> {
    pub fn zeros(pattern: &Pattern) -> Self {
        Self { blocks: vec![SMatrix::zeros(); pattern.blocks() + 1] }
    }

    pub fn clear(&mut self) {
        self.blocks.fill(SMatrix::zeros());
    }

    /// Adds `block` at `slot`, with its rows at the first and its columns at the second node of the pair that the slot was looked up for.
    #[inline]
    pub fn add(&mut self, slot: Slot, block: &SMatrix<f64, D, D>) {
        let place = &mut self.blocks[slot.position()];
        if slot.is_transposed() {
            *place += block.transpose();
        } else {
            *place += block;
        }
    }

    /// Adds a symmetric block, which needs no transposition.
    #[inline]
    pub fn add_symmetric(&mut self, slot: Slot, block: &SMatrix<f64, D, D>) {
        self.blocks[slot.position()] += block;
    }

    pub fn shift(&mut self, pattern: &Pattern, shift: f64) {
        for j in 0..pattern.unknowns() {
            let place = &mut self.blocks[pattern.column(j).start];
            for d in 0..D {
                place[(d, d)] += shift;
            }
        }
    }

    /// Largest absolute entry on the diagonal, without the bin.
    pub fn largest_diagonal(&self, pattern: &Pattern) -> f64 {
        (0..pattern.unknowns())
            .flat_map(|j| {
                let block = &self.blocks[pattern.column(j).start];
                (0..D).map(move |d| block[(d, d)].abs())
            })
            .fold(0.0, f64::max)
    }

    /// Smallest trace of a diagonal block: the stiffness of the softest node. Infinite without unknowns.
    pub fn smallest_trace(&self, pattern: &Pattern) -> f64 {
        let traces = (0..pattern.unknowns()).map(|j| self.blocks[pattern.column(j).start].trace());
        traces.fold(f64::INFINITY, f64::min)
    }

    /// `out = self * v`, both with one vector for each unknown in the pattern's order.
    pub fn multiply(
        &self,
        pattern: &Pattern,
        v: &[nalgebra::SVector<f64, D>],
        out: &mut [nalgebra::SVector<f64, D>],
    ) {
        out.fill(nalgebra::SVector::zeros());
        for j in 0..pattern.unknowns() {
            let column = pattern.column(j);
            out[j] += self.blocks[column.start] * v[j];
            for p in column.skip(1) {
                let i = pattern.row(p);
                out[i] += self.blocks[p] * v[j];
                out[j] += self.blocks[p].tr_mul(&v[i]);
            }
        }
    }
}
