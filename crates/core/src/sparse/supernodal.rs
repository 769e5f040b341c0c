//! Supernodal Cholesky factorisation by faer, for factors that are so full that dense blocks of neighbouring columns are faster.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use nalgebra::SVector;

use super::{BlockMatrix, Pattern};

/// Operations for each entry of the factor above which dense blocks are faster. In measurements (`cargo bench factorise`) both methods
/// take the same time between 80 and 120, with 450 to 750 unknowns in space or some 4000 in the plane.
const OPERATIONS_PER_ENTRY: usize = 80;

/// faer's factor of a matrix on a [`Pattern`], with the scratch space to compute it.
pub(super) struct Supernodal {
    symbolic: SymbolicCholesky<usize>,
    /// Column starts, rows and values of the lower triangle of the matrix, in scalar entries.
    start: Vec<usize>,
    row: Vec<usize>,
    matrix: Vec<f64>,
    factor: Vec<f64>,
    right_side: Vec<f64>,
    scratch: MemBuffer,
}

impl std::fmt::Debug for Supernodal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Supernodal").field("factor", &self.factor.len()).finish_non_exhaustive()
    }
}

impl Pattern {
    /// Whether faer's supernodes are faster than single blocks for matrices of `D x D` blocks on this pattern.
    pub fn is_for_supernodes<const D: usize>(&self) -> bool {
        self.factor_operations::<D>() > OPERATIONS_PER_ENTRY * self.factor_entries::<D>()
    }
}

impl Supernodal {
    /// Space for the factor; `None` if faer cannot allocate its memory.
    pub fn new<const D: usize>(pattern: &Pattern) -> Option<Self> {
        let (mut start, mut row) = (vec![0], Vec::new());
        for j in 0..pattern.unknowns() {
            for c in 0..D {
                row.extend(j * D + c..(j + 1) * D);
                let below = pattern.rows(pattern.column(j)).iter().skip(1);
                row.extend(below.flat_map(|&i| i as usize * D..(i as usize + 1) * D));
                start.push(row.len());
            }
        }
        let n = start.len() - 1;
        let lower = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &row);
        let upper = lower.transpose().to_col_major().ok()?;
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        // The pattern is in elimination order already.
        let order = SymmetricOrdering::Identity;
        let symbolic = factorize_symbolic_cholesky(upper.as_ref(), Side::Upper, order, parameters).ok()?;
        let factorise = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let scratch = MemBuffer::try_new(factorise.or(solve)).ok()?;
        let factor = vec![0.0; symbolic.len_val()];
        Some(Self {
            matrix: vec![0.0; row.len()],
            right_side: vec![0.0; n],
            symbolic,
            start,
            row,
            factor,
            scratch,
        })
    }

    /// Factorises the matrix. Returns whether every pivot exceeds `floor`; if not, the factor must not be used.
    pub fn factorise<const D: usize>(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix<D>,
        floor: f64,
    ) -> bool {
        let mut places = self.matrix.iter_mut();
        for j in 0..pattern.unknowns() {
            let blocks = &matrix.blocks[pattern.column(j)];
            for c in 0..D {
                let column = blocks.iter().flat_map(|b| b.as_slice()[c * D..(c + 1) * D].iter());
                // `places` is the second part of the zip, because a zip takes an item of its first part before it finds that the second
                // one has ended.
                column.skip(c).zip(places.by_ref()).for_each(|(value, place)| *place = *value);
            }
        }
        let n = self.right_side.len();
        let shape = SymbolicSparseColMatRef::new_checked(n, n, &self.start, None, &self.row);
        let done = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(shape, &self.matrix),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
        done.is_ok() && self.pivots_exceed(floor)
    }

    /// Whether every pivot of the factor exceeds `floor`; NaN does not.
    fn pivots_exceed(&self, floor: f64) -> bool {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else { return false };
        let factor = SupernodalLltRef::new(symbolic, &self.factor);
        (0..symbolic.n_supernodes()).all(|s| {
            let block = factor.supernode(s).val();
            (0..block.ncols()).all(|i| block[(i, i)] * block[(i, i)] > floor)
        })
    }

    /// Solves `K x = b` in place; `b` has one vector for each unknown in the pattern's order.
    pub fn solve<const D: usize>(&mut self, b: &mut [SVector<f64, D>]) {
        self.right_side.iter_mut().zip(b.iter().flatten()).for_each(|(place, value)| *place = *value);
        let n = self.right_side.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.right_side, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        b.iter_mut().flatten().zip(&self.right_side).for_each(|(place, value)| *place = *value);
    }
}
