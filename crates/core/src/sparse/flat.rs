//! Block Cholesky factorisation `K = L Lᵀ` of one matrix of 2 x 2 blocks, or of several matrices at once, one in each lane. Each block of
//! `L` is written once, from a flat list of its products, so that the sums stay in registers (dot form).

use super::Pattern;
use super::cholesky::SMALLEST_PIVOT;
use super::simd::{Simd, SimdPair};

const FILL: u32 = u32::MAX;

/// The entries of a block, row by row.
pub(crate) type MatrixBlock<const L: usize> = [Simd<L>; 4];
/// The lower triangle of a block: entries (0,0), (1,0), (1,1).
pub(crate) type Lower<const L: usize> = [Simd<L>; 3];

/// The products of which each block of `L` consists. Blocks have the places of the pattern.
#[derive(Debug)]
pub(crate) struct Symbolic {
    pattern: Pattern,
    /// For each block, the pair of unknowns whose block of the matrix the sum starts with; [`FILL`] for fill-in and the diagonal.
    source: Vec<u32>,
    products_end: Vec<u32>,
    products: Vec<[u32; 2]>,
}

/// The blocks of `L` below the diagonal; on the diagonal the inverses of its diagonal blocks, as a [`Lower`] and a zero.
pub(crate) type FlatFactor<const L: usize> = Vec<MatrixBlock<L>>;

impl Symbolic {
    /// The products for matrices with a block for each of `pairs` of coupled unknowns, the later one of the pattern's order first; pairs
    /// that begin with a number that is no unknown are ignored. `None` if the pattern does not couple a pair.
    pub fn new(pattern: &Pattern, pairs: impl Iterator<Item = [u32; 2]>) -> Option<Self> {
        let n = pattern.unknowns();
        let (mut products, mut products_end) = (Vec::new(), Vec::new());
        for j in 0..n {
            products_end.push(products.len() as u32);
            for i in pattern.column(j).skip(1).map(|place| pattern.row(place)) {
                // Both lists are in ascending order of columns.
                let mut others = pattern.left_of(j).iter().peekable();
                for &(column, a) in pattern.left_of(i).iter().take_while(|(column, _)| (*column as usize) < j)
                {
                    while others.next_if(|(other, _)| *other < column).is_some() {}
                    products.extend(others.next_if(|(other, _)| *other == column).map(|&(_, b)| [a, b]));
                }
                products_end.push(products.len() as u32);
            }
        }
        let mut source = vec![FILL; pattern.blocks()];
        for (e, [i, j]) in pairs.enumerate().filter(|(_, pair)| (pair[0] as usize) < n) {
            let column = pattern.column(j as usize);
            source[column.start + pattern.rows(column).binary_search(&i).ok()?] = e as u32;
        }
        Some(Self { pattern: pattern.clone(), source, products_end, products })
    }

    pub fn factor<const L: usize>(&self) -> FlatFactor<L> {
        vec![[Simd::ZERO; 4]; self.pattern.blocks()]
    }

    /// Factorises the matrices whose blocks are `pairs`, off the diagonal, and `diagonal`. Returns for each lane whether every pivot
    /// exceeds its floor; if not, that lane of the factor must not be used.
    #[inline(always)]
    pub fn factorise<const L: usize>(
        &self,
        pairs: &[MatrixBlock<L>],
        diagonal: &[Lower<L>],
        factor: &mut [MatrixBlock<L>],
    ) -> [bool; L] {
        let diagonal = &diagonal[..self.pattern.unknowns()];
        let floor = largest_diagonal(diagonal) * Simd::splat(SMALLEST_PIVOT);
        let mut safe = [true; L];
        let mut product = 0;
        for (j, whole) in diagonal.iter().enumerate() {
            let mut d = *whole;
            for &(_, place) in self.pattern.left_of(j) {
                let l = &factor[place as usize];
                d[0] -= l[0] * l[0] + l[1] * l[1];
                d[1] -= l[2] * l[0] + l[3] * l[1];
                d[2] -= l[2] * l[2] + l[3] * l[3];
            }
            let (p, safe_p) = pivot(d[0], floor);
            let across = d[1] * p;
            let (q, safe_q) = pivot(d[2] - across * across, floor);
            for lane in 0..L {
                safe[lane] &= safe_p[lane] & safe_q[lane];
            }
            let r = -(across * p * q);
            let column = self.pattern.column(j);
            factor[column.start] = [p, r, q, Simd::ZERO];
            for block in column.start + 1..column.end {
                let mut b = match self.source[block] {
                    FILL => [Simd::ZERO; 4],
                    pair => pairs[pair as usize],
                };
                let end = self.products_end[block] as usize;
                for &[i, j] in &self.products[product..end] {
                    let (x, y) = (&factor[i as usize], &factor[j as usize]);
                    b[0] -= x[0] * y[0] + x[1] * y[1];
                    b[1] -= x[0] * y[2] + x[1] * y[3];
                    b[2] -= x[2] * y[0] + x[3] * y[1];
                    b[3] -= x[2] * y[2] + x[3] * y[3];
                }
                product = end;
                factor[block] = [b[0] * p, b[0] * r + b[1] * q, b[2] * p, b[2] * r + b[3] * q];
            }
        }
        safe
    }

    /// Solves `K x = b` in place; `b` has one vector for each unknown.
    #[inline(always)]
    pub fn solve<const L: usize>(&self, factor: &[MatrixBlock<L>], b: &mut [SimdPair<L>]) {
        let pattern = &self.pattern;
        for i in 0..pattern.unknowns() {
            let mut y = b[i];
            for &(column, place) in pattern.left_of(i) {
                let (l, x) = (&factor[place as usize], b[column as usize]);
                y[0] -= l[0] * x[0] + l[1] * x[1];
                y[1] -= l[2] * x[0] + l[3] * x[1];
            }
            let [p, r, q, _] = factor[pattern.column(i).start];
            b[i] = [p * y[0], r * y[0] + q * y[1]];
        }
        for j in (0..pattern.unknowns()).rev() {
            let mut y = b[j];
            let column = pattern.column(j);
            let below = column.start + 1..column.end;
            for (l, &i) in factor[below.clone()].iter().zip(pattern.rows(below)) {
                let x = b[i as usize];
                y[0] -= l[0] * x[0] + l[2] * x[1];
                y[1] -= l[1] * x[0] + l[3] * x[1];
            }
            let [p, r, q, _] = factor[column.start];
            b[j] = [p * y[0] + r * y[1], q * y[1]];
        }
    }
}

/// The reciprocal of the root of a pivot, and the lanes in which the pivot exceeds the floor. The other lanes get 1, so that they stay
/// finite.
#[inline(always)]
fn pivot<const L: usize>(value: Simd<L>, floor: Simd<L>) -> (Simd<L>, [bool; L]) {
    let safe = value.above(floor);
    let root = value.sqrt().inverse();
    (Simd(std::array::from_fn(|lane| if safe[lane] { root.0[lane] } else { 1.0 })), safe)
}

#[inline(always)]
pub(crate) fn largest_diagonal<const L: usize>(diagonal: &[Lower<L>]) -> Simd<L> {
    diagonal.iter().fold(Simd::ZERO, |m, d| m.max(d[0].abs()).max(d[2].abs()))
}
