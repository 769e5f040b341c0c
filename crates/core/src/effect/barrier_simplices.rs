//! The simplices of a quadratic element that must not be inverted: those at its corners, and the linear parts into which its nodes divide
//! it.

use nalgebra::SVector;

use crate::geometry::quadratic::{self, MAX_NODES};
use crate::geometry::simplex::{self, Corners, LARGEST_LOSS, MAX_CORNERS};

use super::barrier::THRESHOLD;

/// An edge of a simplex: nodes of the element with their coefficients.
type SimplexEdge = [(usize, f64); 3];

/// The positions of an element's nodes; an element in the plane uses the first six.
pub type SimplexNodes<const D: usize> = [SVector<f64, D>; MAX_NODES];

/// The simplices of any element, each with its share of the element's area or volume at rest.
#[derive(Debug, Clone)]
pub struct BarrierSimplices<const D: usize>(Vec<([SimplexEdge; 3], f64)>);

impl<const D: usize> Default for BarrierSimplices<D> {
    fn default() -> Self {
        let middle = |i: usize, j: usize| {
            let nth = quadratic::edges::<D>().iter().position(|e| *e == [i, j] || *e == [j, i]);
            D + 1 + nth.unwrap_or(0)
        };
        let corners = (0..=D).map(|i| {
            let mut others = (1..=D).map(|step| (i + step) % (D + 1)).collect::<Vec<_>>();
            // In space every second corner has its other corners in reverse order, so that its volume is positive.
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
}

impl<const D: usize> BarrierSimplices<D> {
    /// The simplices of an element with this measure at rest and nodes at `x`.
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

/// The halves of the sides of a triangle with nodes at `x`, in order around it.
#[inline(always)]
pub fn halves<const D: usize>(x: &SimplexNodes<D>) -> [SVector<f64, D>; 6] {
    [x[3] - x[0], x[1] - x[3], x[4] - x[1], x[2] - x[4], x[5] - x[2], x[0] - x[5]]
}

/// Twice the area of each simplex of a triangle, from the halves of its sides ([`halves`]), divided by the simplex's share of the triangle:
/// with straight sides all are twice the area of the triangle. Faster than [`BarrierSimplices::of`], with the same ratios.
#[inline(always)]
pub fn measures<const D: usize>(halves: &[SVector<f64, D>; 6]) -> [f64; 7] {
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

/// A measure that exceeds a threshold by this factor exceeds it in spite of rounding.
const ROUNDING_MARGIN: f64 = 1.0 + 1e-9;

/// Whether an element with this measure at rest is a triangle in which no barrier acts, in spite of rounding.
#[inline(always)]
pub(super) fn barrier_is_inactive<const D: usize>(measure: f64, x: &SimplexNodes<D>) -> bool {
    let least = 2.0 * measure * THRESHOLD * ROUNDING_MARGIN;
    D == 2 && measures(&halves(x)).iter().all(|m| *m > least)
}

/// Whether an element is a triangle whose simplices keep enough of their area along a whole step, in spite of rounding.
#[inline(always)]
pub(super) fn step_is_free<const D: usize>(x: &SimplexNodes<D>, step: &SimplexNodes<D>) -> bool {
    if D != 2 {
        return false;
    }
    let (x, step) = (halves(x), halves(step));
    let (start, leading) = (measures(&x), measures(&step));
    let end = measures(&std::array::from_fn(|i| x[i] + step[i]));
    // Bounds the change of area along the step as the first test in `simplex::safe_part` does, with a margin for rounding.
    (0..7).all(|i| {
        let change = end[i] - start[i] - leading[i];
        LARGEST_LOSS * start[i] > ROUNDING_MARGIN * (change.abs() + leading[i].abs())
    })
}

pub struct BarrierSimplex<'a, const D: usize> {
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

    /// The coefficient of each node of the element in each of the edges.
    pub fn counts(&self) -> [[f64; 3]; MAX_NODES] {
        let mut counts = [[0.0; 3]; MAX_NODES];
        for (d, edge) in self.edges.iter().enumerate().take(D) {
            edge.iter().for_each(|&(node, c)| counts[node][d] += c);
        }
        counts
    }

    /// The derivative of the ratio by the nodes of the element, 1/m.
    pub fn slopes(&self, counts: &[[f64; 3]; MAX_NODES]) -> SimplexNodes<D> {
        let of_corners = simplex::gradient(&self.corners);
        counts.each_ref().map(|counts| (0..D).map(|d| of_corners[d + 1] * (counts[d] / self.rest)).sum())
    }
}
