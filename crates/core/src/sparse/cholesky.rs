//! Block Cholesky factorisation `P K Pᵀ = L Lᵀ` on a pattern made once: left-looking by blocks for the few hundred unknowns of the plane,
//! and by faer's supernodes where the factor is so full that dense blocks are faster.

use nalgebra::{SMatrix, SVector};

use super::simd::vectorised;
use super::supernodal::Supernodal;
use super::{BlockMatrix, Pattern};

/// A factor and its scratch space. After its creation it allocates only in [`Factor::negative_curvature`].
#[derive(Debug)]
pub struct Factor<const D: usize> {
    /// faer's factor, where supernodes are faster.
    supernodal: Option<Supernodal>,
    /// Blocks of `L` below the diagonal; on the diagonal the inverses of the diagonal blocks of `L`, which are lower triangular.
    lower: Vec<SMatrix<f64, D, D>>,
    place_of_row: Vec<u32>,
    /// The unknown at which the last factorisation by blocks failed.
    failed_at: usize,
}

/// A matrix with a pivot below this part of its largest diagonal entry counts as singular.
pub(super) const SMALLEST_PIVOT: f64 = 1e-13;

impl<const D: usize> Factor<D> {
    /// Space for the factor of any matrix on `pattern`, by the faster of the two methods.
    #[inline(never)]
    pub fn new(pattern: &Pattern) -> Self {
        match pattern.is_for_supernodes::<D>().then(|| Supernodal::new::<D>(pattern)).flatten() {
            None => Self::block_by_block(pattern),
            supernodal => Self { supernodal, lower: Vec::new(), place_of_row: Vec::new(), failed_at: 0 },
        }
    }

    /// Space for a factor that never uses faer, to compare the two methods.
    pub fn block_by_block(pattern: &Pattern) -> Self {
        Self {
            supernodal: None,
            lower: vec![SMatrix::zeros(); pattern.blocks() + 1],
            place_of_row: vec![0; pattern.unknowns()],
            failed_at: 0,
        }
    }

    /// Factorises `matrix`. Returns false, and the factor must not be used, if a pivot is at most `SMALLEST_PIVOT` times the largest
    /// diagonal entry.
    #[inline(never)]
    pub fn factorise(&mut self, pattern: &Pattern, matrix: &BlockMatrix<D>) -> bool {
        match &mut self.supernodal {
            Some(faer) => faer.factorise(pattern, matrix, floor(pattern, matrix)),
            None => self.factorise_blocks(pattern, matrix),
        }
    }

    /// Factorises by blocks. Returns false, and stores the unknown at which it failed, if a pivot is too small.
    // Not inlined, because the loops are a few per cent slower when they are compiled among other code.
    #[inline(never)]
    fn factorise_blocks(&mut self, pattern: &Pattern, matrix: &BlockMatrix<D>) -> bool {
        let floor = floor(pattern, matrix);
        let (lower, place_of_row) = (&mut self.lower[..], &mut self.place_of_row[..]);
        let failure = vectorised(
            #[inline(always)]
            || left_looking(pattern, &matrix.blocks, lower, place_of_row, floor),
        );
        self.failed_at = failure.unwrap_or(self.failed_at);
        failure.is_none()
    }

    /// A direction `d` of negative or no curvature of the matrix that [`Factor::factorise`] refused, one vector for each unknown:
    /// `dᵀ K d <= 0` up to the floor of the pivots.
    ///
    /// `d` is zero after the unknown that failed, at it the eigenvector `v` of the pivot block's smallest eigenvalue, and before it
    /// `-A⁻¹ b v` with the factorised part `A` and the column `b` beside it. After a failure of faer, which does not tell the unknown, the
    /// matrix is factorised again by blocks, which takes many times as long in large bodies. If that succeeds, as it may for a matrix that
    /// is singular up to rounding, the last unknown counts as the one that failed.
    #[inline(never)]
    pub fn negative_curvature(
        &mut self,
        pattern: &Pattern,
        matrix: &BlockMatrix<D>,
        d: &mut [SVector<f64, D>],
    ) {
        if self.supernodal.is_some() {
            self.lower.resize(pattern.blocks() + 1, SMatrix::zeros());
            self.place_of_row.resize(pattern.unknowns(), 0);
            if self.factorise_blocks(pattern, matrix) {
                self.failed_at = pattern.unknowns().saturating_sub(1);
            }
        }
        let at = self.failed_at;
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
                // The right-hand side already contains the row that failed; later entries of `d` are zero.
                if (i as usize) < at {
                    y -= block.tr_mul(&d[i as usize]);
                }
            }
            d[j] = self.lower[column.start].tr_mul(&y);
        }
    }

    /// Solves `K x = b` in place; `b` has one vector for each unknown in the pattern's order.
    #[inline(never)]
    pub fn solve(&mut self, pattern: &Pattern, b: &mut [SVector<f64, D>]) {
        if let Some(faer) = &mut self.supernodal {
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

/// Factorises by blocks. Returns the unknown whose pivot is too small, if there is one. pulp compiles it for the widest registers of the
/// processor: it takes two thirds of the time and gives the same bits.
#[inline(always)]
fn left_looking<const D: usize>(
    pattern: &Pattern,
    matrix: &[SMatrix<f64, D, D>],
    lower: &mut [SMatrix<f64, D, D>],
    place_of_row: &mut [u32],
    floor: f64,
) -> Option<usize> {
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
        let Some(inverse) = invert_lower_cholesky(&current[0], floor) else { return Some(j) };
        current[0] = inverse;
        let turned = inverse.transpose();
        for block in &mut current[1..column.len()] {
            *block = product(block, &turned);
        }
    }
    None
}

/// Pivots up to this size count as zero.
fn floor<const D: usize>(pattern: &Pattern, matrix: &BlockMatrix<D>) -> f64 {
    SMALLEST_PIVOT * matrix.largest_diagonal(pattern)
}

/// `a b`, written out so that it unrolls for each dimension.
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

/// The inverse of the Cholesky factor of a small matrix, whose lower triangle alone is read; `None` if a pivot is at most `floor`.
#[inline(always)]
fn invert_lower_cholesky<const D: usize>(a: &SMatrix<f64, D, D>, floor: f64) -> Option<SMatrix<f64, D, D>> {
    let mut l = SMatrix::<f64, D, D>::zeros();
    let mut inverse = SMatrix::<f64, D, D>::zeros();
    for j in 0..D {
        let mut pivot = a[(j, j)];
        for k in 0..j {
            pivot -= l[(j, k)] * l[(j, k)];
        }
        // A pivot that is NaN fails this comparison too.
        if !(pivot > floor && pivot.is_finite()) {
            return None;
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
    Some(inverse)
}

/// The eigenvector of the smallest eigenvalue of a small symmetric matrix, whose lower triangle alone is read. The power method on
/// `c I - A` is accurate enough for a direction of descent.
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
