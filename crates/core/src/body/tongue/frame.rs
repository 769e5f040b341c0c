//! The lines of a mesh: the outline and the muscles, cut into connections about as long as the mesh spacing.

use std::collections::BTreeMap;

use super::anatomy::Anatomy;
use super::anchors::Anchors;
use crate::geometry::plane::{self, Point};
use crate::geometry::{ClosedSpline, topology};

/// Length of an outline connection in mesh spacings: the published mesh has 32 of them on 182.3 mm at 5.5 mm.
const OUTLINE_SPACING: f64 = 1.036;

/// How a node may move while the mesh is smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Freedom {
    None,
    /// Along its muscle (unit vector).
    Along(Point),
    Plane,
}

/// A node before the mesh is assembled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DraftNode {
    pub at: Point,
    pub freedom: Freedom,
}

/// Outline and muscles as nodes and the connections that the triangles must keep.
#[derive(Default)]
pub(crate) struct OutlineFrame {
    /// Nodes of the tissue, those of the outline first, in order.
    pub nodes: Vec<DraftNode>,
    pub boundary: usize,
    /// Connections of outline and muscles within the tissue, each once.
    pub segments: Vec<[usize; 2]>,
    /// Node chains of the muscles from first to second end.
    pub chains: Vec<Vec<Site>>,
    /// Nodes of muscles outside the tissue, m.
    pub outside: Vec<Point>,
    pub fixed: Vec<Site>,
    /// The mesh spacing, m.
    h: f64,
    /// The node at each anchor.
    sites: BTreeMap<usize, Site>,
}

/// A node by its number among those of the tissue, or among those outside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Site {
    Tissue(usize),
    Outside(usize),
}

impl OutlineFrame {
    /// The lines of an anatomy at a mesh spacing `h`, m.
    pub fn new(anatomy: &Anatomy, h: f64) -> Self {
        let anchors = Anchors::find(anatomy, h);
        let mut frame = Self { h, ..Self::default() };
        frame.add_outline(anatomy.outline(), &anchors);
        let mut pieces = BTreeMap::new();
        for (muscle, stations) in anatomy.muscles().iter().zip(&anchors.stations) {
            frame.add_muscle(&anchors.points, stations, muscle.outside.map(|o| o.end), &mut pieces);
        }
        frame.fixed = anchors.fixed.iter().filter_map(|a| frame.sites.get(a).copied()).collect();
        frame.segments.iter_mut().for_each(|s| s.sort_unstable());
        frame.segments.sort_unstable();
        frame.segments.dedup();
        frame
    }

    /// Cuts the outline between its anchors, then moves the nodes between them outwards until the polygon has the area of the curve, on
    /// which the stiffness depends. A polygon with its corners on the curve has up to 2 % less.
    fn add_outline(&mut self, curve: &ClosedSpline, anchors: &Anchors) {
        let mut stops: Vec<(f64, Option<usize>)> =
            anchors.on_outline.iter().map(|(along, anchor)| (*along, Some(*anchor))).collect();
        if stops.is_empty() {
            stops.push((0.0, None));
        }
        let wanted = (curve.perimeter / (OUTLINE_SPACING * self.h)).round().max(3.0);
        let first = stops[0].0;
        let ends = stops.iter().skip(1).map(|s| s.0).chain([first + curve.perimeter]);
        let lengths: Vec<f64> = stops.iter().zip(ends).map(|((from, _), to)| to - from).collect();
        let parts = share(wanted as usize, &lengths);
        for (((from, anchor), length), parts) in stops.into_iter().zip(lengths).zip(parts) {
            for part in 0..parts {
                let at = match anchor {
                    Some(anchor) if part == 0 => {
                        self.sites.insert(anchor, Site::Tissue(self.nodes.len()));
                        anchors.points[anchor]
                    }
                    _ => curve.point(from + length * part as f64 / parts as f64),
                };
                let held = part == 0 && anchor.is_some();
                self.nodes.push(DraftNode { at, freedom: if held { Freedom::None } else { Freedom::Plane } });
            }
        }
        self.boundary = self.nodes.len();
        let polygon: Vec<Point> = self.nodes.iter().map(|n| n.at).collect();
        let moves: Vec<bool> = self.nodes.iter().map(|n| n.freedom == Freedom::Plane).collect();
        for (node, at) in self.nodes.iter_mut().zip(with_area(&polygon, &moves, curve.area())) {
            *node = DraftNode { at, freedom: Freedom::None };
        }
        self.segments.extend((0..self.boundary).map(|i| [i, (i + 1) % self.boundary]));
    }

    /// Cuts a muscle between its anchors. Muscles on the same part of a line share its nodes.
    fn add_muscle(
        &mut self,
        anchors: &[Point],
        stations: &[usize],
        outside_end: Option<usize>,
        pieces: &mut BTreeMap<[usize; 2], Vec<Site>>,
    ) {
        let last = stations.len().saturating_sub(2);
        let mut chain = Vec::new();
        for (i, pair) in stations.windows(2).enumerate() {
            let outside = outside_end.is_some_and(|end| i == if end == 0 { 0 } else { last });
            let key = topology::pair(pair[0], pair[1]);
            let mut piece = pieces.get(&key).cloned().unwrap_or_else(|| {
                let site = key.map(|anchor| {
                    let dangles = outside && outside_end.is_some_and(|e| stations[e * (last + 1)] == anchor);
                    let known = self.sites.get(&anchor).copied();
                    let site = known.unwrap_or_else(|| self.add(anchors[anchor], Freedom::None, dangles));
                    self.sites.insert(anchor, site);
                    site
                });
                let piece = self.cut(site, key.map(|a| anchors[a]), outside);
                pieces.insert(key, piece.clone());
                piece
            });
            if pair[0] != key[0] {
                piece.reverse();
            }
            chain.extend_from_slice(&piece[usize::from(i > 0)..]);
        }
        self.chains.push(chain);
    }

    fn add(&mut self, at: Point, freedom: Freedom, outside: bool) -> Site {
        if outside {
            self.outside.push(at);
            Site::Outside(self.outside.len() - 1)
        } else {
            self.nodes.push(DraftNode { at, freedom });
            Site::Tissue(self.nodes.len() - 1)
        }
    }

    /// Cuts a straight part of a line; returns its nodes with both ends.
    fn cut(&mut self, site: [Site; 2], ends: [Point; 2], outside: bool) -> Vec<Site> {
        let along = ends[1] - ends[0];
        let parts = along.norm() / self.h;
        // Outside the tissue connections are not shorter than h, as in the published mesh, which has 12 nodes there.
        let parts = (if outside { parts.floor() } else { parts.round() }).max(1.0);
        let mut piece = vec![site[0]];
        for part in 1..parts as usize {
            let at = ends[0] + along * (part as f64 / parts);
            piece.push(self.add(at, Freedom::Along(along.normalize()), outside));
        }
        piece.push(site[1]);
        for pair in piece.windows(2) {
            if let (Site::Tissue(a), Site::Tissue(b)) = (pair[0], pair[1])
                && !outside
            {
                self.segments.push([a, b]);
            }
        }
        piece
    }
}

/// Distributes `wanted` parts over spans, at least one to each, so that the longest part is as short as possible.
fn share(wanted: usize, lengths: &[f64]) -> Vec<usize> {
    let total: f64 = lengths.iter().sum();
    let mut parts: Vec<usize> =
        lengths.iter().map(|l| ((l / total * wanted as f64).floor() as usize).max(1)).collect();
    while parts.iter().sum::<usize>() < wanted {
        let longest = (0..parts.len())
            .max_by(|a, b| (lengths[*a] / parts[*a] as f64).total_cmp(&(lengths[*b] / parts[*b] as f64)));
        longest.into_iter().for_each(|i| parts[i] += 1);
    }
    parts
}

/// Moves the corners that may move outwards by the same distance, so that the polygon has the given area, m².
fn with_area(polygon: &[Point], moves: &[bool], area: f64) -> Vec<Point> {
    let n = polygon.len();
    let outwards: Vec<Point> = Vec::from_iter((0..n).map(|i| {
        let across = polygon[(i + 1) % n] - polygon[(i + n - 1) % n];
        let normal = Point::new(across.y, -across.x);
        if moves[i] && normal.norm() > 0.0 { normal.normalize() } else { Point::zeros() }
    }));
    let moved = |by: f64| polygon.iter().zip(&outwards).map(|(p, o)| p + o * by).collect::<Vec<_>>();
    // The area is a quadratic function of the distance, a + b d + c d²; the smaller root is in the form without cancellation.
    let step = area.abs().sqrt() * 1e-2;
    let [below, here, above] = [-step, 0.0, step].map(|by| plane::polygon_area(&moved(by)));
    let (a, b, c) =
        (here - area, (above - below) / (2.0 * step), (above + below - 2.0 * here) / (2.0 * step * step));
    let root = b * b - 4.0 * a * c;
    if root < 0.0 || b <= 0.0 {
        return polygon.to_vec();
    }
    moved(-2.0 * a / (b + root.sqrt()))
}
