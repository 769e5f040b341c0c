//! Quadratic simplices with straight sides (a node at each corner and one in the middle of each edge), and Gauss's rules.
//!
//! Corners come first, then the middles of `EDGES`, as in VTK. In barycentric coordinates `l` the shape functions are `l_i (2 l_i - 1)`
//! and `4 l_i l_j` (Zienkiewicz and Taylor, The Finite Element Method, 6th ed., vol. 1, 4.7 and 4.9).

use nalgebra::SVector;

use super::simplex::{Corners, MAX_CORNERS};

/// Largest number of nodes of a quadratic simplex, that of a tetrahedron. A triangle uses the first six items of an array.
pub const MAX_NODES: usize = 10;

/// The two corners of each edge, of which a triangle has the first three; node `corners + n` is the middle of edge `n`.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// The linear cells into which the nodes divide a quadratic cell.
const PARTS: [&[&[usize]]; 2] = [
    &[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]],
    &[
        &[0, 4, 6, 7],
        &[4, 1, 5, 8],
        &[6, 5, 2, 9],
        &[7, 8, 9, 3],
        &[4, 8, 6, 7],
        &[4, 5, 6, 8],
        &[6, 8, 9, 7],
        &[5, 9, 6, 8],
    ],
];

/// Interior points with equal weights that integrate quadratic polynomials exactly (Hammer and Stroud 1956).
const POINTS: [&[[f64; MAX_CORNERS]]; 2] = {
    const P: f64 = 1.0 / 6.0;
    const Q: f64 = 2.0 / 3.0;
    // R is (5 - sqrt 5)/20 and S is (5 + 3 sqrt 5)/20.
    const R: f64 = 0.138_196_601_125_010_5;
    const S: f64 = 0.585_410_196_624_968_5;
    [
        &[[Q, P, P, 0.0], [P, Q, P, 0.0], [P, P, Q, 0.0]],
        &[[S, R, R, R], [R, S, R, R], [R, R, S, R], [R, R, R, S]],
    ]
};

/// Number of nodes of a quadratic simplex: 6 in the plane, 10 in space.
pub const fn nodes<const D: usize>() -> usize {
    (D + 1) * (D + 2) / 2
}

/// The two corners beside each node that is the middle of an edge.
pub fn edges<const D: usize>() -> &'static [[usize; 2]] {
    &EDGES[..nodes::<D>() - D - 1]
}

/// The linear cells, 4 in the plane and 8 in space, into which the nodes divide a quadratic cell.
pub fn parts<const D: usize>() -> &'static [&'static [usize]] {
    PARTS[D - 2]
}

/// Barycentric coordinates of the centroid of one of the [`parts`].
pub fn middle<const D: usize>(part: &[usize]) -> [f64; MAX_CORNERS] {
    let mut at = [0.0; MAX_CORNERS];
    let share = 1.0 / part.len() as f64;
    for &node in part {
        match node.checked_sub(D + 1) {
            None => at[node] += share,
            Some(edge) => edges::<D>()[edge].iter().for_each(|&i| at[i] += 0.5 * share),
        }
    }
    at
}

/// Barycentric coordinates of the integration points, 3 in the plane and 4 in space, with equal weights.
pub fn points<const D: usize>() -> &'static [[f64; MAX_CORNERS]] {
    POINTS[D - 2]
}

/// Values of the shape functions at barycentric coordinates.
pub fn values<const D: usize>(at: &[f64; MAX_CORNERS]) -> [f64; MAX_NODES] {
    let mut out = [0.0; MAX_NODES];
    for i in 0..=D {
        out[i] = at[i] * (2.0 * at[i] - 1.0);
    }
    for (value, [i, j]) in out[D + 1..].iter_mut().zip(edges::<D>()) {
        *value = 4.0 * at[*i] * at[*j];
    }
    out
}

/// Gradients of the shape functions at barycentric coordinates, 1/m, from the gradients of these coordinates.
pub fn gradients<const D: usize>(
    at: &[f64; MAX_CORNERS],
    of_coordinates: &Corners<D>,
) -> [SVector<f64, D>; MAX_NODES] {
    let g = of_coordinates;
    let mut out = [SVector::zeros(); MAX_NODES];
    for i in 0..=D {
        out[i] = g[i] * (4.0 * at[i] - 1.0);
    }
    for (gradient, &[i, j]) in out[D + 1..].iter_mut().zip(edges::<D>()) {
        *gradient = (g[i] * at[j] + g[j] * at[i]) * 4.0;
    }
    out
}

/// Points in -1..1 and weights, whose sum is 2, of Gauss's rule with `count` points, which is exact for polynomials up to degree
/// `2 count - 1`. The points are the roots of the Legendre polynomial, by Newton's method (Press et al., Numerical Recipes, 3rd ed., 4.6).
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    // The Legendre polynomial of degree `count` and its derivative.
    let legendre = |x: f64| {
        let (mut before, mut value) = (1.0, x);
        for k in 2..=count {
            let k = k as f64;
            (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
        }
        (value, n * (x * value - before) / (x * x - 1.0))
    };
    let roots = (0..count).map(|i| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        for _ in 0..50 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        let (_, slope) = legendre(x);
        (-x, 2.0 / ((1.0 - x * x) * slope * slope))
    });
    match count {
        0 => Vec::new(),
        1 => vec![(0.0, 2.0)],
        _ => roots.collect(),
    }
}
