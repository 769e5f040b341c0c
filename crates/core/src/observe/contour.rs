//! The surface of a body in the plane as a curve, and the distance of measured contour points from it.

use std::sync::Arc;

use nalgebra::SVector;

use super::Observable;
use crate::body::{Body, HYOID, MANDIBLE};
use crate::geometry::Point;

/// Number of intervals of every piece at whose ends the search for the nearest place may start.
const TRIALS: usize = 4;
/// Largest number of steps of Newton's method to the nearest place.
const MOST_STEPS: usize = 30;

/// A chain of surface nodes as a smooth curve of Hermite cubics, whose slopes are those of the parabola through a node and its neighbours
/// (Bessel's; de Boor 1978, IV). Its parameter is the distance along the chain at rest, m, so that each place is a weighted mean of nodes
/// with constant weights: a material point.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    // Shared, because every point of every frame of a recording has a curve.
    nodes: Arc<[usize]>,
    /// Parameter of every node, m.
    knots: Arc<[f64]>,
    /// Weights of the nodes before, at and after every knot in the slope there, 1/m.
    slopes: Arc<[[f64; 3]]>,
    /// Weights of the nodes around every piece in the places at which the search for the nearest one may start.
    trials: Arc<[[[f64; 4]; TRIALS + 1]]>,
}

impl Curve {
    /// The curve through these nodes, with the tissue to its left. `rest` has the positions of all nodes at rest, m. `None` for fewer than
    /// three nodes, a node that does not exist, or neighbours that coincide.
    pub fn through(nodes: Vec<usize>, rest: &[SVector<f64, 2>]) -> Option<Self> {
        let mut knots = vec![0.0];
        for pair in nodes.windows(2) {
            let length = (rest.get(pair[1])? - rest.get(pair[0])?).norm();
            if length.is_nan() || length <= 0.0 {
                return None;
            }
            knots.push(knots.last()? + length);
        }
        if nodes.len() < 3 {
            return None;
        }
        let slopes = (0..knots.len()).map(|knot| slope(&knots, knot)).collect();
        let mut out = Self { nodes: nodes.into(), knots: knots.into(), slopes, trials: Arc::new([]) };
        let trials =
            |piece| std::array::from_fn(|trial| out.weights_on(piece, trial as f64 / TRIALS as f64)[0]);
        out.trials = (0..out.nodes.len() - 1).map(trials).collect();
        Some(out)
    }

    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Length of the chain at rest, m.
    pub fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The parameter, m, of the place that is nearest to `point` if the nodes are at `positions`.
    pub fn nearest_place(&self, point: &SVector<f64, 2>, positions: &[SVector<f64, 2>]) -> f64 {
        let (piece, part) = self.nearest(point, positions);
        self.knots[piece] + part * (self.knots[piece + 1] - self.knots[piece])
    }

    /// The nodes and weights of the place at parameter `at`, m; of an end of the curve for a parameter beyond it.
    pub fn weights(&self, at: f64) -> Vec<(usize, f64)> {
        let last = self.knots.len() - 2;
        let piece = self.knots.partition_point(|k| *k <= at).saturating_sub(1).min(last);
        let part = ((at - self.knots[piece]) / (self.knots[piece + 1] - self.knots[piece])).clamp(0.0, 1.0);
        let [place, ..] = self.weights_on(piece, part);
        let weights = self.around(piece).map(|(i, node)| (node, place[i]));
        weights.filter(|(_, weight)| *weight != 0.0).collect()
    }

    /// The place at parameter `at`, m, if the nodes are at `positions`.
    pub fn place(&self, at: f64, positions: &[SVector<f64, 2>]) -> SVector<f64, 2> {
        self.weights(at).iter().map(|&(node, weight)| positions[node] * weight).sum()
    }

    /// Weights of the nodes `piece - 1 ..= piece + 2` in the place at `part` (0 to 1) of a piece, and in its first and second derivative
    /// by the part.
    fn weights_on(&self, piece: usize, part: f64) -> [[f64; 4]; 3] {
        let t = part;
        let h = self.knots[piece + 1] - self.knots[piece];
        // Hermite's four functions and their derivatives: those of the values and of the slopes (by the part) at both ends.
        let hermite = [
            [
                (1.0 + 2.0 * t) * (1.0 - t).powi(2),
                t * t * (3.0 - 2.0 * t),
                t * (1.0 - t).powi(2),
                t * t * (t - 1.0),
            ],
            [6.0 * t * (t - 1.0), 6.0 * t * (1.0 - t), (1.0 - t) * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)],
            [12.0 * t - 6.0, 6.0 - 12.0 * t, 6.0 * t - 4.0, 6.0 * t - 2.0],
        ];
        let (start, end) = (self.slopes[piece], self.slopes[piece + 1]);
        hermite.map(|[a, b, da, db]| {
            let mut out = [0.0, a, b, 0.0];
            for i in 0..3 {
                out[i] += h * da * start[i];
                out[i + 1] += h * db * end[i];
            }
            out
        })
    }

    /// The nodes `piece - 1 ..= piece + 2` that exist, each with its place among these four.
    fn around(&self, piece: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..4).filter_map(move |i| Some((i, *self.nodes.get((piece + i).checked_sub(1)?)?)))
    }

    /// Sum of the nodes around a piece with these weights.
    fn mean(&self, piece: usize, weights: &[f64; 4], positions: &[SVector<f64, 2>]) -> SVector<f64, 2> {
        self.around(piece).map(|(i, node)| positions[node] * weights[i]).sum()
    }

    /// The piece and the part of it that are nearest to `point`.
    fn nearest(&self, point: &SVector<f64, 2>, positions: &[SVector<f64, 2>]) -> (usize, f64) {
        // Pieces whose nodes are farther than the nearest node by twice their length are skipped, because a piece is less than its length
        // from its chord.
        let far: Vec<f64> = self.nodes.iter().map(|&n| (positions[n] - point).norm()).collect();
        let nearest = far.iter().copied().fold(f64::INFINITY, f64::min);
        let mut best = (0, 0.0, f64::INFINITY);
        for piece in 0..self.nodes.len() - 1 {
            let chord = (positions[self.nodes[piece + 1]] - positions[self.nodes[piece]]).norm();
            if far[piece].min(far[piece + 1]) > nearest + 2.0 * chord {
                continue;
            }
            for (trial, weights) in self.trials[piece].iter().enumerate() {
                let distance = (self.mean(piece, weights, positions) - point).norm_squared();
                if distance < best.2 {
                    best = (piece, trial as f64 / TRIALS as f64, distance);
                }
            }
        }
        let (mut piece, mut part, mut distance) = best;
        let mut weights = self.weights_on(piece, part);
        let mut away = self.mean(piece, &weights[0], positions) - point;
        for _ in 0..MOST_STEPS {
            let [_, first, second] = weights;
            let (d, dd) = (self.mean(piece, &first, positions), self.mean(piece, &second, positions));
            let (slope, bend) = (away.dot(&d), d.norm_squared() + away.dot(&dd));
            let step = -slope / if bend > 0.0 { bend } else { d.norm_squared() };
            let mut next = (piece, part + step);
            // Beyond the end of a piece the search continues in the next one.
            if next.1 > 1.0 && part == 1.0 && piece + 2 < self.nodes.len() {
                next = (piece + 1, 0.0);
            } else if next.1 < 0.0 && part == 0.0 && piece > 0 {
                next = (piece - 1, 1.0);
            }
            next.1 = next.1.clamp(0.0, 1.0);
            if next == (piece, part) {
                break;
            }
            weights = self.weights_on(next.0, next.1);
            away = self.mean(next.0, &weights[0], positions) - point;
            let there = away.norm_squared();
            if there > distance * (1.0 + 1e-12) {
                break;
            }
            (piece, part, distance) = (next.0, next.1, there);
        }
        (piece, part)
    }
}

/// Weights of the nodes before, at and after a knot in the slope there, 1/m; at an end of the curve those of the straight line to the next
/// node.
fn slope(k: &[f64], knot: usize) -> [f64; 3] {
    match (knot.checked_sub(1), k.get(knot + 1)) {
        (Some(before), Some(after)) => {
            let (h0, h1) = (k[knot] - k[before], after - k[knot]);
            [-h1 / (h0 * (h0 + h1)), (h1 - h0) / (h0 * h1), h0 / (h1 * (h0 + h1))]
        }
        (None, Some(after)) => [0.0, -1.0 / (after - k[knot]), 1.0 / (after - k[knot])],
        (Some(before), None) => [-1.0 / (k[knot] - k[before]), 1.0 / (k[knot] - k[before]), 0.0],
        (None, None) => [0.0; 3],
    }
}

/// Signed distance, m, of a measured point from a surface curve: positive outside the tissue, which is to the left of the curve. Beyond an
/// end of the curve it is the distance from the tangent there.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    curve: Curve,
    point: SVector<f64, 2>,
}

impl Contour {
    /// The distance of `point`, m.
    pub fn new(curve: Curve, point: SVector<f64, 2>) -> Self {
        Self { curve, point }
    }
}

impl Observable<2> for Contour {
    fn value(&self, positions: &[SVector<f64, 2>]) -> f64 {
        self.value_and_gradient(positions, &mut |_, _| {})
    }

    fn gradient(&self, positions: &[SVector<f64, 2>], part: &mut dyn FnMut(usize, SVector<f64, 2>)) {
        self.value_and_gradient(positions, part);
    }

    fn value_and_gradient(
        &self,
        positions: &[SVector<f64, 2>],
        part: &mut dyn FnMut(usize, SVector<f64, 2>),
    ) -> f64 {
        let (piece, fraction) = self.curve.nearest(&self.point, positions);
        let [place, first, _] = self.curve.weights_on(piece, fraction);
        let along = self.curve.mean(piece, &first, positions);
        // The outward normal.
        let normal = SVector::from([along.y, -along.x]) / along.norm();
        let away = self.point - self.curve.mean(piece, &place, positions);
        // At the foot of a perpendicular `beside` is zero; beyond an end of the curve the normal rotates too.
        let beside = away.dot(&along) / along.norm_squared();
        for (i, node) in self.curve.around(piece) {
            part(node, -normal * (place[i] + beside * first[i]));
        }
        away.dot(&normal)
    }
}

/// The visible surface of a body, from the hyoid over root, dorsum and tip to the mental spine, with the place of the tip.
#[derive(Debug, Clone)]
pub struct TongueSurface {
    /// The curve, with the tissue to its left.
    pub curve: Curve,
    /// Distance of the tip along the curve at rest, m.
    pub tip: f64,
}

impl TongueSurface {
    /// The surface of a body, whose tip is its foremost point; the whole outline if the bones are not on it. `None` for a body without an
    /// outline.
    pub fn of(body: &Body<2>) -> Option<Self> {
        Self::with_tip(body, None)
    }

    /// [`Self::of`] with a node of the surface as the tip.
    pub fn with_tip(body: &Body<2>, tip: Option<usize>) -> Option<Self> {
        let mesh = &body.mesh;
        let mut outline = mesh.outlines().into_iter().max_by_key(Vec::len)?;
        let ends = [HYOID, MANDIBLE].map(|bone| {
            let nodes = body.bone(bone);
            outline.iter().position(|n| nodes.contains(n))
        });
        match ends {
            [Some(hyoid), Some(spine)] if hyoid != spine => {
                outline.rotate_left(hyoid);
                let last = (spine + outline.len() - hyoid) % outline.len();
                outline.truncate(last + 1);
            }
            _ => {
                let seam = outline.iter().position(|n| mesh.fixed.binary_search(n).is_ok()).unwrap_or(0);
                outline.rotate_left(seam);
                outline.extend(outline.first().copied());
            }
        }
        let named = tip.and_then(|tip| outline.iter().position(|n| *n == tip));
        let end = named.or_else(|| {
            (0..outline.len()).min_by(|&a, &b| mesh.nodes[outline[a]].x.total_cmp(&mesh.nodes[outline[b]].x))
        })?;
        let tip = outline[..=end].windows(2).map(|w| (mesh.nodes[w[1]] - mesh.nodes[w[0]]).norm()).sum();
        Some(Self { curve: Curve::through(outline, &mesh.nodes)?, tip })
    }

    /// Signed distance of a point from the surface, m; positive outside.
    pub fn distance(&self, point: Point, positions: &[Point]) -> f64 {
        Contour::new(self.curve.clone(), point).value(positions)
    }
}
