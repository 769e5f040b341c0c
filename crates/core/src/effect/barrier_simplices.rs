//! The simplices of a quadratic element that must keep their orientation: its corners, and the linear parts into which its nodes divide it.

use nalgebra::SVector;

use crate::geometry::quadratic::{self, MAX_NODES};
use crate::geometry::simplex::{self, Corners, LARGEST_LOSS, MAX_CORNERS};

use super::barrier::THRESHOLD;

/// An edge of a guarded simplex: its nodes in the element, and how each counts.
type SimplexEdge = [(usize, f64); 3];

pub(super) type SimplexNodes<const D: usize> = [SVector<f64, D>; MAX_NODES];

/// The guarded corners and parts of every element, each with its share of the element's area or volume at
/// rest.
pub(super) struct BarrierSimplices<const D: usize>(Vec<([SimplexEdge; 3], f64)>);

impl<const D: usize> BarrierSimplices<D> {
    pub fn new() -> Self {
        let middle = |i: usize, j: usize| {
            let nth = quadratic::edges::<D>().iter().position(|e| *e == [i, j] || *e == [j, i]);
            D + 1 + nth.unwrap_or(0)
        };
        let corners = (0..=D).map(|i| {
            let mut others = (1..=D).map(|step| (i + step) % (D + 1)).collect::<Vec<_>>();
            // In space the order of the other corners is reversed at every second corner; otherwise its
            // volume would be negative.
            if D == 3 && i % 2 == 1 {
                others.swap(0, 1);
            }
            let mut edges = [[(0, 0.0); 3]; 3];
            for (edge, &j) in edges.iter_mut().zip(&others) {
                *edge = [(middle(i, j), 4.0), (i, -3.0), (j, -1.0)];
            }
            (edges, 1.0)
        });
        let parts = quadratic::parts::<D>().iter().map(|part| {
            let mut edges = [[(0, 0.0); 3]; 3];
            for (edge, &j) in edges.iter_mut().zip(&part[1..]) {
                *edge = [(j, 1.0), (part[0], -1.0), (part[0], 0.0)];
            }
            (edges, 1.0 / f64::from(1 << D))
        });
        Self(corners.chain(parts).collect())
    }

    /// Every guarded simplex of an element of this measure at rest with nodes at `x`, as edges and corners, and its measure at rest.
    #[inline(always)]
    pub fn of<'a>(
        &'a self,
        measure: f64,
        x: &'a SimplexNodes<D>,
    ) -> impl Iterator<Item = BarrierSimplex<'a, D>> {
        self.0.iter().map(move |(edges, part)| {
            let mut corners = [SVector::zeros(); MAX_CORNERS];
            for (corner, edge) in corners[1..=D].iter_mut().zip(edges) {
                *corner = edge.iter().map(|&(node, c)| x[node] * c).sum();
            }
            BarrierSimplex { edges, corners, rest: measure * part }
        })
    }

    pub fn count(&self) -> usize {
        self.0.len()
    }
}

/// The halves of the sides of a triangle with nodes at `x`, one after another around it.
#[inline(always)]
fn halves<const D: usize>(x: &SimplexNodes<D>) -> [SVector<f64, D>; 6] {
    [x[3] - x[0], x[1] - x[3], x[4] - x[1], x[2] - x[4], x[5] - x[2], x[0] - x[5]]
}

/// Twice the area of each guarded corner and part of a triangle with these half sides, scaled to the area of
/// the triangle itself while its sides are straight. The values are those of [`BarrierSimplices::of`], in a fraction
/// of the time.
#[inline(always)]
fn measures<const D: usize>(halves: &[SVector<f64, D>; 6]) -> [f64; 7] {
    let [p, q, r, s, t, u] = halves;
    [
        cross(&(p * 3.0 - q), &(t - u * 3.0)),
        cross(&(r * 3.0 - s), &(p - q * 3.0)),
        cross(&(t * 3.0 - u), &(r - s * 3.0)),
        4.0 * cross(u, p),
        4.0 * cross(q, r),
        4.0 * cross(s, t),
        4.0 * cross(&(p + u), &(q + r)),
    ]
}

fn cross<const D: usize>(a: &SVector<f64, D>, b: &SVector<f64, D>) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A measure that exceeds a threshold by this factor is above it in spite of rounding.
const SURE: f64 = 1.0 + 1e-9;

/// Whether an element of this measure at rest is a triangle in which no barrier acts, in spite of rounding.
#[inline(always)]
pub(super) fn is_free<const D: usize>(measure: f64, x: &SimplexNodes<D>) -> bool {
    let least = 2.0 * measure * THRESHOLD * SURE;
    D == 2 && measures(&halves(x)).iter().all(|m| *m > least)
}

/// Whether an element is a triangle all of whose guarded parts keep enough of their area along a whole step, in
/// spite of rounding.
#[inline(always)]
pub(super) fn may_go<const D: usize>(x: &SimplexNodes<D>, step: &SimplexNodes<D>) -> bool {
    if D != 2 {
        return false;
    }
    let (x, step) = (halves(x), halves(step));
    let (start, leading) = (measures(&x), measures(&step));
    let end = measures(&std::array::from_fn(|i| x[i] + step[i]));
    // As in `simplex::safe_part`.
    (0..7).all(|i| {
        let change = end[i] - start[i] - leading[i];
        LARGEST_LOSS * start[i] > SURE * (change.abs() + leading[i].abs())
    })
}

pub(super) struct BarrierSimplex<'a, const D: usize> {
    edges: &'a [SimplexEdge; 3],
    pub corners: Corners<D>,
    pub rest: f64,
}

impl<const D: usize> BarrierSimplex<'_, D> {
    /// The ratio of its measure to that at rest, if the barrier acts.
    #[inline(always)]
    pub fn ratio(&self) -> Option<f64> {
        let ratio = simplex::measure(&self.corners) / self.rest;
        // NaN counts as inverted.
        (ratio < THRESHOLD || ratio.is_nan()).then_some(ratio)
    }

    /// The coefficient of a node of the element in each of the edges.
    pub fn counts(&self) -> [[f64; 3]; MAX_NODES] {
        let mut counts = [[0.0; 3]; MAX_NODES];
        for (d, edge) in self.edges.iter().enumerate().take(D) {
            edge.iter().for_each(|&(node, c)| counts[node][d] += c);
        }
        counts
    }

    /// The derivative of the ratio with respect to the nodes of the element, 1/m.
    pub fn slopes(&self, counts: &[[f64; 3]; MAX_NODES]) -> SimplexNodes<D> {
        let of_corners = simplex::gradient(&self.corners);
        counts.each_ref().map(|counts| (0..D).map(|d| of_corners[d + 1] * (counts[d] / self.rest)).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_guarded_simplex_has_its_share_of_the_measure_at_rest_and_is_upright() {
        fn shares<const D: usize>() {
            let mut x = [SVector::<f64, D>::zeros(); MAX_NODES];
            (0..D).for_each(|d| x[d + 1][d] = 1.0);
            for (n, [i, j]) in quadratic::edges::<D>().iter().enumerate() {
                x[D + 1 + n] = (x[*i] + x[*j]) * 0.5;
            }
            let measure = simplex::measure(&simplex::corners(&x, &[0, 1, 2, 3][..=D]));
            let guards = BarrierSimplices::<D>::new();
            for guarded in guards.of(measure, &x) {
                assert!((simplex::measure(&guarded.corners) / guarded.rest - 1.0).abs() < 1e-12, "{D}D");
            }
            // The fast test for triangles gives the same answer for a bent element.
            (D + 1..quadratic::nodes::<D>()).for_each(|n| x[n][n % D] += 0.1 * (n as f64).sin());
            for (guarded, fast) in guards.of(measure, &x).zip(measures(&halves(&x))).filter(|_| D == 2) {
                let slow = simplex::measure(&guarded.corners) * measure / guarded.rest;
                assert!((2.0 * slow - fast).abs() < 1e-12, "{slow} {fast}");
            }
        }
        shares::<2>();
        shares::<3>();
    }
}
