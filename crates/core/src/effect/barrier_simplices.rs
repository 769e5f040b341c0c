//! The simplices of a quadratic element that must not be inverted: those at its corners, and its linear parts.

use nalgebra::SVector;

use super::barrier::THRESHOLD;
use crate::geometry::quadratic::{self, MAX_NODES};
use crate::geometry::simplex::{self, Corners, MAX_CORNERS};

/// An edge of a simplex: nodes of the element with their coefficients.
type SimplexEdge = [(usize, f64); 3];

/// The positions of an element's nodes; an element in the plane uses the first six.
pub type SimplexNodes<const D: usize> = [SVector<f64, D>; MAX_NODES];

/// The simplices of any element, each with its share of the element's area or volume at rest.
#[derive(Debug, Clone)]
pub struct BarrierSimplices<const D: usize>(Vec<(Vec<SimplexEdge>, f64)>);

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
            let edges = others.into_iter().map(|j| [(middle(i, j), 4.0), (i, -3.0), (j, -1.0)]);
            (edges.collect(), 1.0)
        });
        let parts = quadratic::parts::<D>().iter().map(|part| {
            let edges = part[1..].iter().map(|&j| [(j, 1.0), (part[0], -1.0), (part[0], 0.0)]);
            (edges.collect(), 1.0 / f64::from(1 << D))
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

pub struct BarrierSimplex<'a, const D: usize> {
    edges: &'a [SimplexEdge],
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
        for (d, edge) in self.edges.iter().enumerate() {
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
