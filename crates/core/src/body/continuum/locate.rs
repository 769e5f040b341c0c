//! The elements of points and of parts of lines, and means over the surroundings of a point.

use nalgebra::SVector;

use crate::geometry::quadratic::{self, gauss_legendre};
use crate::geometry::simplex::{self, Corners, MAX_CORNERS};

/// Lines outside an element by at most this barycentric coordinate count as inside, and points by at most four times as much.
const SLACK: f64 = 1e-9;
/// Parts of a line below this part of its length are ignored.
const SHORTEST: f64 = 1e-9;
/// Number of rings of a mean over a disc, and of points on each.
const RINGS: usize = 12;
const AROUND: usize = 48;

pub struct Locator<'a, const D: usize> {
    pub elements: &'a [Vec<usize>],
    corners: Vec<Corners<D>>,
    boxes: Vec<[SVector<f64, D>; 2]>,
}

impl<'a, const D: usize> Locator<'a, D> {
    pub fn new(nodes: &[SVector<f64, D>], elements: &'a [Vec<usize>]) -> Self {
        let corners: Vec<Corners<D>> = elements.iter().map(|e| simplex::corners(nodes, &e[..=D])).collect();
        let boxes = corners.iter().map(|x| {
            let points = &x[..=D];
            let (low, high) = points.iter().fold((x[0], x[0]), |(l, h), p| (l.inf(p), h.sup(p)));
            let slack = SVector::repeat((high - low).amax() * 8.0 * SLACK);
            [low - slack, high + slack]
        });
        let boxes = boxes.collect();
        Self { elements, corners, boxes }
    }

    /// Derivatives of the shape functions of an element along a direction at a point, 1/m.
    pub fn slopes(&self, element: usize, at: &SVector<f64, D>, along: &SVector<f64, D>) -> Vec<f64> {
        let x = &self.corners[element];
        let measure = simplex::measure(x);
        let of_coordinates = simplex::gradient(x).map(|g| g / measure);
        let gradients = quadratic::gradients(&simplex::barycentric(x, at), &of_coordinates);
        gradients[..quadratic::nodes::<D>()].iter().map(|g| g.dot(along)).collect()
    }

    /// The element in which a point lies deepest, and its barycentric coordinates there.
    fn find(&self, p: &SVector<f64, D>, among: &[usize]) -> Option<(usize, [f64; MAX_CORNERS])> {
        let mut best: Option<(usize, [f64; MAX_CORNERS], f64)> = None;
        for &e in among.iter().filter(|&&e| self.is_near(e, p, 0.0)) {
            let at = simplex::barycentric(&self.corners[e], p);
            let depth = at[..=D].iter().copied().fold(f64::INFINITY, f64::min);
            if depth >= -4.0 * SLACK && best.as_ref().is_none_or(|(_, _, d)| depth > *d) {
                best = Some((e, at, depth));
            }
        }
        best.map(|(e, at, _)| (e, at))
    }

    /// Whether the bounding box of an element is nearer to a point than `reach`, m, along every axis.
    fn is_near(&self, element: usize, p: &SVector<f64, D>, reach: f64) -> bool {
        let [low, high] = &self.boxes[element];
        (0..D).all(|d| p[d] >= low[d] - reach && p[d] <= high[d] + reach)
    }

    /// Weights of nodes that give the mean of a field over the tissue within `radius`, m, of a point, where tissue at the distance d counts
    /// `(1 - d²/radius²)²`; with radius 0 the field at the point. `None` without tissue there.
    pub fn mean(&self, centre: &SVector<f64, D>, radius: f64) -> Option<Vec<(usize, f64)>> {
        let all = 0..self.boxes.len();
        let among: Vec<usize> = all.filter(|&e| self.is_near(e, centre, radius)).collect();
        let mut weights: std::collections::BTreeMap<usize, f64> = std::collections::BTreeMap::new();
        for (offset, weight) in ball::<D>(if radius > 0.0 { RINGS } else { 0 }) {
            let Some((e, at)) = self.find(&(centre + offset * radius), &among) else { continue };
            for (&node, value) in self.elements[e].iter().zip(quadratic::values::<D>(&at)) {
                *weights.entry(node).or_default() += weight * value;
            }
        }
        let sum: f64 = weights.values().sum();
        (sum > 0.0)
            .then(|| weights.into_iter().map(|(node, w)| (node, w / sum)).filter(|w| w.1 != 0.0).collect())
    }

    /// The parts of a straight line that lie in the tissue, in order and without overlap: the element of each, and its beginning and end
    /// as fractions of the line.
    pub fn cut(&self, a: &SVector<f64, D>, b: &SVector<f64, D>) -> Vec<(usize, [f64; 2])> {
        let (low, high) = (a.inf(b), a.sup(b));
        let meets = |[l, h]: &[SVector<f64, D>; 2]| (0..D).all(|d| high[d] >= l[d] && low[d] <= h[d]);
        let mut parts: Vec<(usize, [f64; 2])> = (0..self.corners.len())
            .filter(|&e| meets(&self.boxes[e]))
            .filter_map(|e| Some((e, simplex::part_inside(&self.corners[e], a, b, SLACK)?)))
            .collect();
        parts.sort_by(|(e, p), (f, q)| p[0].total_cmp(&q[0]).then(q[1].total_cmp(&p[1])).then(e.cmp(f)));
        let mut reached = 0.0;
        // A line along an edge is in the elements on both sides; the first one gets it.
        let parts = parts.into_iter().filter_map(|(e, [from, to]): (usize, [f64; 2])| {
            let from = f64::max(from, reached);
            reached = f64::max(reached, to);
            (to - from > SHORTEST).then_some((e, [from, to]))
        });
        parts.collect()
    }
}

/// Points of the unit disc or ball with their weights for `(1 - r²)²`; without rings the centre.
fn ball<const D: usize>(rings: usize) -> Vec<(SVector<f64, D>, f64)> {
    if rings == 0 {
        return vec![(SVector::zeros(), 1.0)];
    }
    let mut points = Vec::new();
    // Half steps of the angle avoid points on lines of symmetry.
    for (x, w) in gauss_legendre(rings) {
        let r = 0.5 * (1.0 + x);
        let bump = w * (1.0 - r * r).powi(2) * r.powi(D as i32 - 1);
        let heights = if D == 2 { vec![(0.0, 1.0)] } else { gauss_legendre(rings) };
        for (height, share) in heights {
            let across = r * f64::sqrt(1.0 - height * height);
            for i in 0..AROUND {
                let mut p = SVector::zeros();
                let angle = std::f64::consts::TAU * (i as f64 + 0.5) / AROUND as f64;
                (p[0], p[1]) = (across * angle.cos(), across * angle.sin());
                if D == 3 {
                    p[2] = r * height;
                }
                points.push((p, bump * share));
            }
        }
    }
    points
}
