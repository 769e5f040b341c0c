//! Block Cholesky factorisation `K = L Lᵀ` of one matrix of 2 x 2 blocks, or of several matrices at once, one in each lane. Each block of
//! `L` is written once, from a flat list of its products, so that the sums stay in registers (dot form).

use pulp::NullaryFnOnce;

use super::Pattern;
use super::cholesky::SMALLEST_PIVOT;
use super::simd::{Simd, SimdPair};

const FILL: u32 = u32::MAX;

/// The entries of a block, row by row.
pub(crate) type MatrixBlock<const L: usize> = [Simd<L>; 4];
/// The lower triangle of a block: entries (0,0), (1,0), (1,1).
pub(crate) type Lower<const L: usize> = [Simd<L>; 3];

/// The products of which each block of `L` consists. Blocks below the diagonal are numbered column by column.
#[derive(Debug)]
pub(crate) struct Symbolic {
    columns: usize,
    /// First block of each column.
    start: Vec<u32>,
    row: Vec<u32>,
    /// For each block, the pair of unknowns whose block of the matrix the sum starts with; [`FILL`] for fill-in.
    source: Vec<u32>,
    products_end: Vec<u32>,
    products: Vec<[u32; 2]>,
    /// Blocks left of the diagonal in each row: `(column, block)`.
    left_start: Vec<u32>,
    left: Vec<[u32; 2]>,
}

#[derive(Debug)]
pub(crate) struct FlatFactor<const L: usize> {
    lower: Vec<MatrixBlock<L>>,
    /// Inverses of the factor's diagonal blocks.
    inverse: Vec<Lower<L>>,
}

impl Symbolic {
    /// The products for matrices with a block for each of `pairs` of coupled unknowns, the later one of the pattern's order first; pairs
    /// that begin with a number that is no unknown are ignored. `None` if the pattern does not couple a pair.
    pub fn new(pattern: &Pattern, pairs: impl Iterator<Item = [u32; 2]>) -> Option<Self> {
        let n = pattern.unknowns();
        let (mut start, mut row) = (vec![0], Vec::new());
        let mut left: Vec<Vec<[u32; 2]>> = vec![Vec::new(); n];
        for j in 0..n {
            for i in pattern.column(j).skip(1).map(|p| pattern.row(p)) {
                left[i].push([j as u32, row.len() as u32]);
                row.push(i as u32);
            }
            start.push(row.len() as u32);
        }
        let (mut products, mut products_end) = (Vec::new(), Vec::new());
        for j in 0..n {
            for &i in &row[start[j] as usize..start[j + 1] as usize] {
                // Both lists are in ascending order of columns.
                let mut others = left[j].iter().peekable();
                for &[column, a] in left[i as usize].iter().take_while(|[column, _]| (*column as usize) < j) {
                    while others.next_if(|[other, _]| *other < column).is_some() {}
                    products.extend(others.next_if(|[other, _]| *other == column).map(|&[_, b]| [a, b]));
                }
                products_end.push(products.len() as u32);
            }
        }
        let mut source = vec![FILL; row.len()];
        for (e, [i, j]) in pairs.enumerate().filter(|(_, pair)| (pair[0] as usize) < n) {
            let column = start[j as usize] as usize..start[j as usize + 1] as usize;
            let place = column.start + row[column].binary_search(&i).ok()?;
            source[place] = e as u32;
        }
        let mut left_start = vec![0];
        left_start.extend(left.iter().scan(0, |end, list| {
            *end += list.len() as u32;
            Some(*end)
        }));
        let left = left.concat();
        Some(Self { columns: n, start, row, source, products_end, products, left_start, left })
    }

    pub fn factor<const L: usize>(&self) -> FlatFactor<L> {
        FlatFactor {
            lower: vec![[Simd::ZERO; 4]; self.row.len()],
            inverse: vec![[Simd::ZERO; 3]; self.columns],
        }
    }

    #[inline(always)]
    fn left(&self, i: usize) -> &[[u32; 2]] {
        &self.left[self.left_start[i] as usize..self.left_start[i + 1] as usize]
    }

    #[inline(always)]
    fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.start[j] as usize..self.start[j + 1] as usize
    }
}

/// Factorises the matrices whose blocks are `pairs`, off the diagonal, and `diagonal`. Returns for each lane whether every pivot exceeds
/// its floor; if not, that lane of the factor must not be used.
pub(crate) struct Factorise<'a, const L: usize> {
    pub symbolic: &'a Symbolic,
    pub pairs: &'a [MatrixBlock<L>],
    pub diagonal: &'a [Lower<L>],
    pub factor: &'a mut FlatFactor<L>,
}

impl<const L: usize> NullaryFnOnce for Factorise<'_, L> {
    type Output = [bool; L];

    #[inline(always)]
    fn call(self) -> [bool; L] {
        let Self { symbolic: s, pairs, diagonal, factor: FlatFactor { lower, inverse: inverses } } = self;
        let floor = largest_diagonal(&diagonal[..s.columns]) * Simd::splat(SMALLEST_PIVOT);
        let mut safe = [true; L];
        let mut product = 0;
        for (j, whole) in diagonal[..s.columns].iter().enumerate() {
            let mut d = *whole;
            for &[_, place] in s.left(j) {
                let l = &lower[place as usize];
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
            let inverse = [p, -(across * p * q), q];
            inverses[j] = inverse;
            let column = s.column(j);
            for block in column {
                let mut b = match s.source[block] {
                    FILL => [Simd::ZERO; 4],
                    pair => pairs[pair as usize],
                };
                let end = s.products_end[block] as usize;
                for &[i, j] in &s.products[product..end] {
                    let (x, y) = (&lower[i as usize], &lower[j as usize]);
                    b[0] -= x[0] * y[0] + x[1] * y[1];
                    b[1] -= x[0] * y[2] + x[1] * y[3];
                    b[2] -= x[2] * y[0] + x[3] * y[1];
                    b[3] -= x[2] * y[2] + x[3] * y[3];
                }
                product = end;
                let [p, r, q] = inverse;
                lower[block] = [b[0] * p, b[0] * r + b[1] * q, b[2] * p, b[2] * r + b[3] * q];
            }
        }
        safe
    }
}

/// Solves `K x = b` in place; `b` has one vector for each unknown.
pub(crate) struct Solve<'a, const L: usize> {
    pub symbolic: &'a Symbolic,
    pub factor: &'a FlatFactor<L>,
    pub b: &'a mut [SimdPair<L>],
}

impl<const L: usize> NullaryFnOnce for Solve<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { symbolic: s, factor: FlatFactor { lower, inverse }, b } = self;
        for i in 0..s.columns {
            let mut y = b[i];
            for &[column, place] in s.left(i) {
                let (l, x) = (&lower[place as usize], b[column as usize]);
                y[0] -= l[0] * x[0] + l[1] * x[1];
                y[1] -= l[2] * x[0] + l[3] * x[1];
            }
            let [p, r, q] = inverse[i];
            b[i] = [p * y[0], r * y[0] + q * y[1]];
        }
        for j in (0..s.columns).rev() {
            let mut y = b[j];
            let column = s.column(j);
            for (l, &i) in lower[column.clone()].iter().zip(&s.row[column]) {
                let x = b[i as usize];
                y[0] -= l[0] * x[0] + l[2] * x[1];
                y[1] -= l[1] * x[0] + l[3] * x[1];
            }
            let [p, r, q] = inverse[j];
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
