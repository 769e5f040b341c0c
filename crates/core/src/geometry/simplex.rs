//! Signed area of a triangle and signed volume of a tetrahedron, with first and second derivatives.
//!
//! All measures are signed: that of an inverted cell is negative. With the absolute values in the gradients of the thesis (eqs. 3.22,
//! 3.34) the force would always push towards +x, +y.

use nalgebra::{SMatrix, SVector};

/// Largest number of corners of a cell, that of a tetrahedron. A triangle uses the first three items of an array.
pub const MAX_CORNERS: usize = 4;

/// Positions of the `D + 1` corners of a cell, m; further items are zero.
pub type Corners<const D: usize> = [SVector<f64, D>; MAX_CORNERS];

/// The positions of the corners of `cell`, whose `D + 1` items are numbers of nodes.
#[inline]
pub fn corners<const D: usize>(positions: &[SVector<f64, D>], cell: &[usize]) -> Corners<D> {
    let mut out = [SVector::zeros(); MAX_CORNERS];
    for (corner, &node) in out.iter_mut().zip(cell) {
        *corner = positions[node];
    }
    out
}

/// `D!`: the parallelogram or parallelepiped of `D` edges from one corner is so many times the simplex of these edges.
pub const fn factorial<const D: usize>() -> f64 {
    if D == 2 { 2.0 } else { 6.0 }
}

/// The simplex with a corner at the origin and the others at the columns of a matrix, whose determinant is `D!` times its measure.
#[inline(always)]
pub fn of_columns<const D: usize>(matrix: &SMatrix<f64, D, D>) -> Corners<D> {
    let mut corners = [SVector::zeros(); MAX_CORNERS];
    for d in 0..D {
        corners[d + 1] = matrix.column(d).into_owned();
    }
    corners
}

/// Signed area (2D, m²; positive if counter-clockwise) or volume (3D, m³) of a simplex.
#[inline]
pub fn measure<const D: usize>(x: &Corners<D>) -> f64 {
    const { assert!(D == 2 || D == 3, "a tongue is flat or solid") };
    let (b, c) = (x[1] - x[0], x[2] - x[0]);
    if D == 2 { 0.5 * (b[0] * c[1] - b[1] * c[0]) } else { cross(&b, &c).dot(&(x[3] - x[0])) / 6.0 }
}

/// Derivative of [`measure`] by each corner, m (2D) or m² (3D): `dS/dA = 1/2 (y_B - y_C, x_C - x_B)` and cyclic (thesis eq. 3.34 with
/// corrected signs); in 3D a sixth of the cross product of two edges of the opposite face (eq. 3.22 likewise).
#[inline]
pub fn gradient<const D: usize>(x: &Corners<D>) -> Corners<D> {
    let mut g = [SVector::zeros(); MAX_CORNERS];
    if D == 2 {
        for a in 0..3 {
            let (p, q) = (x[(a + 1) % 3], x[(a + 2) % 3]);
            g[a][0] = 0.5 * (p[1] - q[1]);
            g[a][1] = 0.5 * (q[0] - p[0]);
        }
    } else {
        let (b, c, d) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
        g[1] = cross(&c, &d) / 6.0;
        g[2] = cross(&d, &b) / 6.0;
        g[3] = cross(&b, &c) / 6.0;
        g[0] = -(g[1] + g[2] + g[3]);
    }
    g
}

/// Second derivative of [`measure`] by corners `a` (rows) and `b` (columns), dimensionless (2D) or m (3D).
#[inline]
pub fn hessian<const D: usize>(x: &Corners<D>, a: usize, b: usize) -> SMatrix<f64, D, D> {
    let mut h = SMatrix::zeros();
    if a == b {
        return h;
    }
    if D == 2 {
        let sign = if b == (a + 1) % 3 { 0.5 } else { -0.5 };
        h[(0, 1)] = sign;
        h[(1, 0)] = -sign;
        return h;
    }
    // The block is minus a sixth of the cross-product matrix of the edge from c to d, the other two corners.
    let [c, d] = OTHERS[a][b];
    let e = (x[d] - x[c]) * (-1.0 / 6.0);
    h[(0, 1)] = -e[2];
    h[(0, 2)] = e[1];
    h[(1, 0)] = e[2];
    h[(1, 2)] = -e[0];
    h[(2, 0)] = -e[1];
    h[(2, 1)] = e[0];
    h
}

/// Largest part of its area or volume that a simplex may lose in one step.
pub(crate) const LARGEST_LOSS: f64 = 0.9;

/// The largest `t <= 1`, to 1/64, for which a simplex is known to keep a tenth of its measure on the whole straight path `x + s p`,
/// `0 <= s <= t`. The measure is a polynomial of degree `D` in `s`, which its Bernstein coefficients bound from below.
///
/// Inlined, because it takes half of the time that a solve spends on its step limits.
#[inline(always)]
pub fn safe_part<const D: usize>(x: &Corners<D>, p: &Corners<D>) -> f64 {
    let at = |t: f64| {
        let mut y = *x;
        for (y, p) in y.iter_mut().zip(p) {
            *y += p * t;
        }
        measure(&y)
    };
    // Coefficients of the measure along the path; the leading one is the measure of the step.
    let (start, leading, f1) = (at(0.0), measure(p), at(1.0));
    let c0 = start - (1.0 - LARGEST_LOSS) * start;
    let (c1, c2, c3) = if D == 2 {
        (f1 - start - leading, leading, 0.0)
    } else {
        let fm = at(-1.0);
        (0.5 * (f1 - fm) - leading, 0.5 * (f1 + fm) - start, leading)
    };
    if c0 > c1.abs() + c2.abs() + c3.abs() {
        return 1.0;
    }
    // Positive Bernstein coefficients on [lo, hi] prove that the polynomial is positive there.
    let positive = |lo: f64, hi: f64| {
        let w = hi - lo;
        let d0 = c0 + lo * (c1 + lo * (c2 + lo * c3));
        let d1 = w * (c1 + lo * (2.0 * c2 + 3.0 * lo * c3));
        let d2 = w * w * (c2 + 3.0 * lo * c3);
        let d3 = w * w * w * c3;
        let b = [d0, d0 + d1 / 3.0, d0 + 2.0 * d1 / 3.0 + d2 / 3.0, d0 + d1 + d2 + d3];
        b.iter().all(|b| *b > 0.0)
    };
    if positive(0.0, 1.0) {
        return 1.0;
    }
    let (mut safe, mut width) = (0.0, 0.5);
    while width > 1.0 / 128.0 && safe < 1.0 {
        if positive(safe, safe + width) {
            safe += width;
        } else {
            width *= 0.5;
        }
    }
    safe
}

/// The part of the segment from `a` to `b` that lies in the cell, as fractions of the segment; `None` if it misses the cell. Points
/// outside by at most `slack` in a barycentric coordinate count as inside, so that rounding does not exclude a segment along a face.
pub fn part_inside<const D: usize>(
    x: &Corners<D>,
    a: &SVector<f64, D>,
    b: &SVector<f64, D>,
    slack: f64,
) -> Option<[f64; 2]> {
    let (first, last) = (barycentric(x, a), barycentric(x, b));
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (at, change) in first.iter().zip(&last).map(|(p, q)| (p + slack, q - p)).take(D + 1) {
        // The segment is inside where at + t change >= 0.
        if change > 0.0 {
            from = from.max(-at / change);
        } else if change < 0.0 {
            to = to.min(-at / change);
        } else if at < 0.0 {
            return None;
        }
    }
    (from <= to).then_some([from, to])
}

/// Barycentric coordinates of a point: 1 at one corner and 0 at the others, between 0 and 1 inside.
pub fn barycentric<const D: usize>(x: &Corners<D>, p: &SVector<f64, D>) -> [f64; MAX_CORNERS] {
    let (measure, slopes) = (measure(x), gradient(x));
    let mut at = [0.0; MAX_CORNERS];
    for i in 0..=D {
        at[i] = f64::from(u8::from(i == 0)) + slopes[i].dot(&(p - x[0])) / measure;
    }
    at
}

#[inline]
fn cross<const D: usize>(a: &SVector<f64, D>, b: &SVector<f64, D>) -> SVector<f64, D> {
    let mut c = SVector::zeros();
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
    c
}

/// For each pair of corners of a tetrahedron the other two, in the order that makes the permutation even; unused for a corner with itself.
const OTHERS: [[[usize; 2]; MAX_CORNERS]; MAX_CORNERS] = [
    [[0, 0], [2, 3], [3, 1], [1, 2]],
    [[3, 2], [0, 0], [0, 3], [2, 0]],
    [[1, 3], [3, 0], [0, 0], [0, 1]],
    [[2, 1], [0, 2], [1, 0], [0, 0]],
];
