//! Contact of the tongue's surface with a rigid outline: palate and teeth.
//!
//! A node at distance `d < d̂` of the outline has the energy `b(d) = -κ (d - d̂)² ln(d/d̂)`, which is twice continuously differentiable at
//! `d̂`, where the wall begins to act, and infinite at the wall (Li et al. 2020, Incremental Potential Contact, eq. 6). With a step limit
//! before every crossing no force moves a node through the wall.
//!
//! Along a polyline the barriers of all segments are added and those of the corners between them are subtracted (Li et al. 2023,
//! Convergent IPC). So a straight row of segments acts on a node as one wall, and the energy is smooth across corners.

use nalgebra::{SMatrix, SVector, Vector2};

use super::{Configuration, Effect, Tangent};
use crate::geometry::plane::nearest_fraction;
use crate::sparse::{BlockMatrix, Pattern, Slot};

/// A step covers at most this part of the way to the wall.
const LARGEST_APPROACH: f64 = 0.9;
/// Relative extension of the segments in the search for crossings, so that rounding opens no gap at a corner.
const OVERLAP: f64 = 1e-9;
/// An outline that turns back over less than this, m, is only drawn roughly.
const SHORTEST_FOLD_M: f64 = 1e-3;

/// A rigid wall along a polyline in the first two coordinates (infinitely wide in space) that acts on some nodes.
#[derive(Debug, Clone)]
pub struct Contact {
    pub outline: Vec<Vector2<f64>>,
    nodes: Vec<(usize, Slot)>,
    /// κ, N/m (2D: per metre of thickness).
    stiffness: f64,
    /// d̂, m.
    reach: f64,
}

/// Energy of a node by the wall, with its derivatives by the first two coordinates.
#[derive(Debug, Clone, Copy, Default)]
struct Repulsion {
    energy: f64,
    gradient: Vector2<f64>,
    exact: nalgebra::Matrix2<f64>,
    convex: nalgebra::Matrix2<f64>,
}

impl Contact {
    /// A wall of `stiffness` (κ, N/m; positive) that acts on `nodes` nearer than `reach` (d̂, m; positive).
    pub fn new(outline: Vec<Vector2<f64>>, nodes: &[usize], stiffness: f64, reach: f64) -> Self {
        Self { outline, nodes: nodes.iter().map(|&n| (n, Slot::UNBOUND)).collect(), stiffness, reach }
    }

    /// Distance of a point from the outline, m.
    pub fn distance<const D: usize>(&self, point: &SVector<f64, D>) -> f64 {
        let p = flat(point);
        self.segments().map(|s| nearest(p, s).0.norm()).fold(f64::INFINITY, f64::min)
    }

    /// The first of `pairs` of nodes whose connecting line meets the outline at these positions, m. Its ends are on opposite sides of the
    /// wall, so that the body has penetrated it.
    pub fn first_penetration<const D: usize>(
        &self,
        positions: &[SVector<f64, D>],
        pairs: &[[usize; 2]],
    ) -> Option<[usize; 2]> {
        pairs.iter().copied().find(|pair| {
            let [a, b] = pair.map(|n| flat(&positions[n]));
            self.segments().any(|s| first_meeting(a, b - a, s).is_some_and(|t| t <= 1.0))
        })
    }

    /// The numbers (from 1) of the ends of a part of the outline that turns back along itself or crosses itself, as if points were exchanged.
    pub fn folded(&self) -> Option<[usize; 2]> {
        let turns = self.outline.windows(3).position(|w| {
            let [a, b, across] = [[0, 1], [1, 2], [0, 2]].map(|[i, j]| (w[j] - w[i]).norm());
            let (short, long) = (a.min(b), a.max(b));
            short > f64::max(SHORTEST_FOLD_M, 0.2 * long) && short + across < 1.05 * long
        });
        let crosses = self.outline.windows(4).position(|w| {
            first_meeting(w[0], w[1] - w[0], [w[2], w[3]]).is_some_and(|t| t > OVERLAP && t < 1.0 - OVERLAP)
        });
        turns.map(|n| [n + 1, n + 3]).or(crosses.map(|n| [n + 1, n + 4]))
    }

    fn segments(&self) -> impl Iterator<Item = [Vector2<f64>; 2]> + '_ {
        self.outline.windows(2).map(|w| [w[0], w[1]])
    }

    /// Sums the barriers of the outline near `p`: that of each segment with its nearest point inside, and at each corner one for each
    /// segment that has its nearest point there, minus one where two segments meet.
    fn repulsion(&self, p: Vector2<f64>) -> Repulsion {
        let mut sum = Repulsion::default();
        let mut ended_before = 1;
        let mut previous: Option<Vector2<f64>> = None;
        for segment in self.segments() {
            let [a, b] = segment;
            let (way, part) = nearest(p, segment);
            let at_start = i32::from(part == 0.0);
            // The first end of the outline belongs to one segment only.
            let weight = if previous.is_some() { ended_before + at_start - 1 } else { at_start };
            self.add_barrier(&mut sum, p - a, weight, false);
            if 0.0 < part && part < 1.0 {
                self.add_barrier(&mut sum, way, 1, true);
            }
            ended_before = i32::from(part == 1.0);
            previous = Some(b);
        }
        if let Some(end) = previous {
            self.add_barrier(&mut sum, p - end, ended_before, false);
        }
        sum
    }

    /// Adds `weight` times the barrier at the displacement `way` from the wall, which is a line if `straight` and a point otherwise.
    fn add_barrier(&self, sum: &mut Repulsion, way: Vector2<f64>, weight: i32, straight: bool) {
        let squared = way.norm_squared();
        if weight == 0 || squared >= self.reach * self.reach {
            return;
        }
        let weight = f64::from(weight) * self.stiffness;
        let d = squared.sqrt();
        let n = way / d;
        let (gap, log) = (d - self.reach, (d / self.reach).ln());
        let slope = -weight * gap * (2.0 * log + gap / d);
        let bend = weight * (-2.0 * log - 4.0 * gap / d + (gap / d).powi(2));
        sum.energy -= weight * gap * gap * log;
        sum.gradient += n * slope;
        let line = n * n.transpose();
        sum.exact += line * bend;
        sum.convex += line * bend.max(0.0);
        if !straight {
            let across = (nalgebra::Matrix2::identity() - line) * (slope / d);
            sum.exact += across;
            if weight < 0.0 {
                sum.convex += across;
            }
        }
    }
}

fn flat<const D: usize>(p: &SVector<f64, D>) -> Vector2<f64> {
    Vector2::new(p[0], p[1])
}

/// The vector from the nearest point of a segment to `p`, m, and where that point is, as a fraction of the segment.
fn nearest(p: Vector2<f64>, [a, b]: [Vector2<f64>; 2]) -> (Vector2<f64>, f64) {
    let t = nearest_fraction(p, a, b);
    (if t < 1.0 { p - a - (b - a) * t } else { p - b }, t)
}

/// The smallest `t >= 0` at which `p + t step` meets a segment.
fn first_meeting(p: Vector2<f64>, step: Vector2<f64>, [a, b]: [Vector2<f64>; 2]) -> Option<f64> {
    let along = b - a;
    let turn = step.perp(&along);
    let t = (a - p).perp(&along) / turn;
    let s = (a - p).perp(&step) / turn;
    // If step and segment are parallel, these numbers are not finite and the test fails.
    (t >= 0.0 && t.is_finite() && (-OVERLAP..=1.0 + OVERLAP).contains(&s)).then_some(t)
}

impl<const D: usize> Effect<D> for Contact {
    fn name(&self) -> &'static str {
        "contact"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.nodes.iter().for_each(|(n, _)| couple(&[*n]));
    }

    /// The number of pairs of a node and a segment.
    fn elements(&self) -> usize {
        self.nodes.len() * self.outline.len().saturating_sub(1)
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.nodes.iter_mut().for_each(|(n, slot)| *slot = pattern.slot(*n, *n));
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.nodes.iter().map(|(n, _)| self.repulsion(flat(&at.positions[*n])).energy).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for (n, _) in &self.nodes {
            let push = self.repulsion(flat(&at.positions[*n]));
            force[*n][0] -= push.gradient.x;
            force[*n][1] -= push.gradient.y;
        }
    }

    /// [`Tangent::Convex`] keeps the curvature along the direction to the wall, and of the lateral part only what a subtracted corner
    /// adds.
    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for (n, slot) in &self.nodes {
            let push = self.repulsion(flat(&at.positions[*n]));
            let plane = if tangent == Tangent::Exact { push.exact } else { push.convex };
            let mut block = SMatrix::<f64, D, D>::zeros();
            for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                block[(r, c)] = plane[(r, c)];
            }
            stiffness.add_symmetric(*slot, &block);
        }
    }

    /// Each node keeps at least a tenth of its straight path to the place where it would cross the wall.
    fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        let mut limit: f64 = 1.0;
        for (n, _) in &self.nodes {
            let (p, way) = (flat(&at.positions[*n]), flat(&step[*n]));
            for t in self.segments().filter_map(|s| first_meeting(p, way, s)) {
                limit = limit.min(LARGEST_APPROACH * t);
            }
        }
        limit
    }
}
