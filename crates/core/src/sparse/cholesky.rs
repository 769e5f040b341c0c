//! Block Cholesky factorisation `P K Pᵀ = L Lᵀ` on a pattern made once. The few hundred unknowns of the
//! plane are factorised here, left-looking; where the factor is so full that dense blocks are faster, faer
//! does it.

use nalgebra::{SMatrix, SVector};
use pulp::{Arch, NullaryFnOnce};

use super::supernodal::Supernodal;
use super::{BlockMatrix, Pattern};

/// The matrix is not positive definite: the pivot of this unknown is not safely above zero.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("not positive definite{}", self.place())]
pub struct NotPositiveDefinite {
    /// Unknown node (elimination order) where the factorisation stopped; the largest number where that is not
    /// known ([`Factor::find_failure`]).
    pub unknown: usize,
    pub pivot: f64,
}

impl NotPositiveDefinite {
    /// Not positive definite, and not known where.
    const SOMEWHERE: Self = Self { unknown: usize::MAX, pivot: 0.0 };

    fn place(&self) -> String {
        match self.unknown {
            usize::MAX => String::new(),
            unknown => format!(" at unknown {unknown} (pivot {:e})", self.pivot),
        }
    }
}

/// A factor and the scratch space to compute it. It allocates nothing after its creation.
#[derive(Debug)]
pub struct Factor<const D: usize> {
    /// faer's factor, where that is faster. A matrix that faer refuses is factorised here too, when somebody
    /// asks for the pivot that fails ([`Factor::find_failure`]).
    supernodal: Option<Supernodal>,
    /// Whether the last factorisation is in `supernodal`.
    is_supernodal: bool,
    /// Below the diagonal the blocks of `L`; on it the inverses of the diagonal blocks of `L` (lower
    /// triangular).
    lower: Vec<SMatrix<f64, D, D>>,
    place_of_row: Vec<u32>,
}

/// A pivot must exceed this part of the largest entry on the diagonal, or the matrix counts as singular.
const SMALLEST_PIVOT: f64 = 1e-13;

impl<const D: usize> Factor<D> {
    /// Space for the factor of any matrix on `pattern`, by the method that is faster there.
    #[inline(never)]
    pub fn new(pattern: &Pattern) -> Self {
        match pattern.is_for_supernodes::<D>().then(|| Supernodal::new::<D>(pattern)).flatten() {
            None => Self::block_by_block(pattern),
            supernodal => {
                Self { supernodal, is_supernodal: false, lower: Vec::new(), place_of_row: Vec::new() }
            }
        }
    }

    /// As [`Self::new`], but never with faer's supernodes, to compare the two.
    pub fn block_by_block(pattern: &Pattern) -> Self {
        Self {
            supernodal: None,
            is_supernodal: false,
            lower: vec![SMatrix::zeros(); pattern.blocks() + 1],
            place_of_row: vec![0; pattern.unknowns()],
        }
    }

    /// Factorises `matrix`. Where a pivot is below 1e-13 of the largest diagonal entry this fails, and the
    /// factor is not to be used.
    #[inline(never)]
    pub fn factorise(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix<D>,
    ) -> Result<(), NotPositiveDefinite> {
        let floor = SMALLEST_PIVOT * matrix.largest_diagonal(pattern);
        if let Some(faer) = self.supernodal.as_mut() {
            self.is_supernodal = faer.factorise(pattern, matrix, floor);
            return if self.is_supernodal { Ok(()) } else { Err(NotPositiveDefinite::SOMEWHERE) };
        }
        self.factorise_blocks(pattern, matrix, floor)
    }

    /// Where a matrix fails that [`Factor::factorise`] refused: it goes through it block by block, which in
    /// large bodies takes many times as long as the refusal. Our way may find a matrix whole that is singular
    /// but for rounding: then its last pivot counts as the one.
    #[inline(never)]
    pub fn find_failure(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix<D>,
        failure: NotPositiveDefinite,
    ) -> NotPositiveDefinite {
        if failure != NotPositiveDefinite::SOMEWHERE {
            return failure;
        }
        if self.lower.is_empty() {
            self.lower = vec![SMatrix::zeros(); pattern.blocks() + 1];
            self.place_of_row = vec![0; pattern.unknowns()];
        }
        let floor = SMALLEST_PIVOT * matrix.largest_diagonal(pattern);
        let last = NotPositiveDefinite { unknown: pattern.unknowns().saturating_sub(1), pivot: 0.0 };
        self.factorise_blocks(pattern, matrix, floor).err().unwrap_or(last)
    }

    // Not inlined, because the loops are some per cent slower when they are compiled among other code.
    #[inline(never)]
    fn factorise_blocks(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix<D>,
        floor: f64,
    ) -> Result<(), NotPositiveDefinite> {
        let (lower, place_of_row) = (&mut self.lower[..], &mut self.place_of_row[..]);
        Arch::new().dispatch(Blocks { pattern, matrix: &matrix.blocks, lower, place_of_row, floor })
    }

    /// A direction `d` of negative or no curvature, after a factorisation that failed: one vector for each
    /// unknown, with `dᵀ K d <= 0` up to the floor of the pivots.
    ///
    /// `d` is zero after the unknown where it failed, the eigenvector `v` of that pivot's smallest
    /// eigenvalue at it, and `-A⁻¹ b v` before it, `A` the part factorised and `b` the column beside it.
    pub fn negative_curvature(
        &self,
        pattern: &Pattern,
        failure: &NotPositiveDefinite,
        d: &mut [SVector<f64, D>],
    ) {
        let at = failure.unknown;
        d.fill(SVector::zeros());
        d[at] = lowest_mode(&self.lower[pattern.column(at).start]);
        for &(k, place) in pattern.left_of(at) {
            d[k as usize] = -self.lower[place as usize].tr_mul(&d[at]);
        }
        for j in (0..at).rev() {
            let column = pattern.column(j);
            let mut y = d[j];
            let below = column.start + 1..column.end;
            for (block, &i) in self.lower[below.clone()].iter().zip(pattern.rows(below)) {
                // Rows from the failed one on are on the right-hand side already, or beyond it.
                if (i as usize) < at {
                    y -= block.tr_mul(&d[i as usize]);
                }
            }
            d[j] = self.lower[column.start].tr_mul(&y);
        }
    }

    /// Solves `K x = b` in place; one vector for each unknown in the pattern's order.
    #[inline(never)]
    pub fn solve(&mut self, pattern: &Pattern, b: &mut [SVector<f64, D>]) {
        if let Some(faer) = self.supernodal.as_mut().filter(|_| self.is_supernodal) {
            return faer.solve(b);
        }
        for j in 0..pattern.unknowns() {
            let column = pattern.column(j);
            let y = self.lower[column.start] * b[j];
            b[j] = y;
            let below = column.start + 1..column.end;
            for (block, &i) in self.lower[below.clone()].iter().zip(pattern.rows(below)) {
                b[i as usize] -= block * y;
            }
        }
        for j in (0..pattern.unknowns()).rev() {
            let column = pattern.column(j);
            let below = column.start + 1..column.end;
            let mut y = b[j];
            for (block, &i) in self.lower[below.clone()].iter().zip(pattern.rows(below)) {
                y -= block.tr_mul(&b[i as usize]);
            }
            b[j] = self.lower[column.start].tr_mul(&y);
        }
    }
}

/// The factorisation, for the processor at hand: with wide registers it takes two thirds of the time, and
/// gives the same bits.
struct Blocks<'a, const D: usize> {
    pattern: &'a Pattern,
    matrix: &'a [SMatrix<f64, D, D>],
    lower: &'a mut [SMatrix<f64, D, D>],
    place_of_row: &'a mut [u32],
    floor: f64,
}

impl<const D: usize> NullaryFnOnce for Blocks<'_, D> {
    type Output = Result<(), NotPositiveDefinite>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { pattern, matrix, lower, place_of_row, floor } = self;
        for j in 0..pattern.unknowns() {
            let column = pattern.column(j);
            lower[column.clone()].copy_from_slice(&matrix[column.clone()]);
            for (p, &i) in column.clone().zip(pattern.rows(column.clone())) {
                place_of_row[i as usize] = p as u32;
            }
            let (done, current) = lower.split_at_mut(column.start);
            for &(k, place) in pattern.left_of(j) {
                let places = place as usize..pattern.column(k as usize).end;
                let head = done[place as usize].transpose();
                for (block, &i) in done[places.clone()].iter().zip(pattern.rows(places)) {
                    let target = place_of_row[i as usize] as usize - column.start;
                    current[target] -= product(block, &head);
                }
            }
            let inverse = invert_lower_cholesky(&current[0], floor)
                .map_err(|pivot| NotPositiveDefinite { unknown: j, pivot })?;
            current[0] = inverse;
            let turned = inverse.transpose();
            for block in &mut current[1..column.len()] {
                *block = product(block, &turned);
            }
        }
        Ok(())
    }
}

/// `a b` written out, so that it unrolls for the dimension at hand.
#[inline(always)]
fn product<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let mut out = SMatrix::zeros();
    for c in 0..D {
        for k in 0..D {
            let f = b[(k, c)];
            for r in 0..D {
                out[(r, c)] += a[(r, k)] * f;
            }
        }
    }
    out
}

/// The inverse of the Cholesky factor of a small matrix (of which only the lower triangle is read), or the
/// pivot that is not above `floor`.
#[inline(always)]
fn invert_lower_cholesky<const D: usize>(
    a: &SMatrix<f64, D, D>,
    floor: f64,
) -> Result<SMatrix<f64, D, D>, f64> {
    let mut l = SMatrix::<f64, D, D>::zeros();
    let mut inverse = SMatrix::<f64, D, D>::zeros();
    for j in 0..D {
        let mut pivot = a[(j, j)];
        for k in 0..j {
            pivot -= l[(j, k)] * l[(j, k)];
        }
        // The comparison is written so that a pivot that is NaN fails too.
        if !(pivot > floor && pivot.is_finite()) {
            return Err(pivot);
        }
        l[(j, j)] = pivot.sqrt();
        let reciprocal = 1.0 / l[(j, j)];
        for i in j + 1..D {
            let mut s = a[(i, j)];
            for k in 0..j {
                s -= l[(i, k)] * l[(j, k)];
            }
            l[(i, j)] = s * reciprocal;
        }
        inverse[(j, j)] = reciprocal;
        for c in 0..j {
            let mut s = 0.0;
            for k in c..j {
                s += l[(j, k)] * inverse[(k, c)];
            }
            inverse[(j, c)] = -s * reciprocal;
        }
    }
    Ok(inverse)
}

/// The eigenvector of the smallest eigenvalue of a small symmetric matrix (of which only the lower triangle
/// is read), by the power method on `c I - A`, which is enough for a direction of descent.
fn lowest_mode<const D: usize>(a: &SMatrix<f64, D, D>) -> SVector<f64, D> {
    let mut whole = *a;
    for r in 0..D {
        for c in r + 1..D {
            whole[(r, c)] = whole[(c, r)];
        }
    }
    let size = whole.norm();
    let mut best = SVector::<f64, D>::zeros();
    let mut least = f64::INFINITY;
    for axis in 0..D {
        let mut v = SVector::<f64, D>::zeros();
        v[axis] = 1.0;
        for _ in 0..30 {
            let next = v * size - whole * v;
            if next.norm() > 0.0 {
                v = next.normalize();
            }
        }
        let quotient = v.dot(&(whole * v));
        if quotient < least {
            (least, best) = (quotient, v);
        }
    }
    best
}
