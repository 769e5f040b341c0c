//! Muscles as lines, and the places of their names.

use super::axes::Bounds;
use super::{FontFace, INK, Px, Svg, TEXT, closed_paths, data};
use tongue_core::geometry::Point;
use tongue_core::statistics::least_by;
use tongue_input::measured::muscles::Muscles;

const GAP: f64 = 7.0;
/// Candidate places of a name as parts of its line's length, best first.
const PARTS: [f64; 9] = [0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2, 0.9, 0.1];

/// Line widths of contracting muscles, px: of the line, and how much wider its dark edge is.
const CONTRACTING: [f64; 2] = [8.0, 2.5];
const PASSIVE: [f64; 2] = [3.5, 2.0];

pub(super) struct DrawnMuscle {
    /// Its index in the mesh.
    pub index: usize,
    pub name: String,
    pub colour: String,
    pub contracting: bool,
    pub seen: Vec<Px>,
    /// Where the muscle leaves the view: a point inside, and the point at the edge.
    pub leaves: Option<[Px; 2]>,
}

impl DrawnMuscle {
    pub fn draw(&self, svg: &mut Svg) {
        muscle(svg, &data([self.seen.iter().copied()]), &self.colour, self.contracting);
    }

    pub fn draw_arrow(&self, svg: &mut Svg) {
        if let Some([from, to]) = self.leaves {
            arrow(svg, from, to, &self.colour);
        }
    }

    pub fn face(&self) -> FontFace {
        if self.contracting { FontFace::Bold } else { FontFace::Plain }
    }
}

/// Draws a muscle over a slightly wider dark line, so that light colours have an edge on white paper.
pub(super) fn muscle(svg: &mut Svg, d: &str, colour: &str, contracting: bool) {
    let [width, edge] = if contracting { CONTRACTING } else { PASSIVE };
    for (width, colour) in [(width + edge, INK), (width, colour)] {
        if contracting { svg.stroke(d, colour, width) } else { svg.dashes(d, colour, width) }
    }
}

pub(super) fn arrow(svg: &mut Svg, from: Px, to: Px, colour: &str) {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]).max(1e-9);
    let [u, v] = [way[0] / length, way[1] / length];
    let corner = |along: f64, across: f64| [to[0] + along * u - across * v, to[1] + along * v + across * u];
    let head = closed_paths([[corner(0.0, 0.0), corner(-26.0, 10.0), corner(-26.0, -10.0)]]);
    svg.fill(&head, colour);
    svg.stroke(&head, INK, 1.2);
}

fn around(middle: Px, half: Px) -> Bounds {
    let (middle, half) = (Point::from(middle), Point::from(half));
    Bounds { low: middle - half, high: middle + half }
}

fn shared_area(a: &Bounds, b: &Bounds) -> f64 {
    let [width, height] = [0, 1].map(|i| (a.high[i].min(b.high[i]) - a.low[i].max(b.low[i])).max(0.0));
    width * height
}

/// The centre of the name of every muscle; `None` for a line without length. Names avoid each other, the lines, `points` and the outside of
/// the frame (px) as far as possible; contracting muscles, which are last, choose first.
pub(super) fn place(muscles: &[DrawnMuscle], points: &[Px], frame: &Bounds) -> Vec<Option<Px>> {
    let obstacles: Vec<Px> =
        muscles.iter().flat_map(|m| samples(&m.seen)).chain(points.iter().copied()).collect();
    let mut taken: Vec<Bounds> = Vec::new();
    let mut places = Vec::from_iter(muscles.iter().rev().map(|muscle| {
        let half = [0.5 * muscle.face().width(&muscle.name), 0.5 * TEXT];
        let points =
            PARTS.into_iter().enumerate().filter_map(|(n, part)| Some((n, point_at(&muscle.seen, part)?)));
        let candidates = points.flat_map(|(rank, (on, along))| {
            let across = [-along[1], along[0]];
            let reach = across[0].abs() * half[0] + across[1].abs() * half[1] + GAP;
            [1.0, -1.0].map(|side| {
                let middle = [0, 1].map(|i| on[i] + side * reach * across[i]);
                (cost(&around(middle, half), &taken, &obstacles, frame) + rank as f64, middle)
            })
        });
        let (_, middle) = least_by(candidates, |c| c.0)?;
        taken.push(around(middle, half.map(|h| h + 3.0)));
        Some(middle)
    }));
    places.reverse();
    places
}

fn cost(area: &Bounds, taken: &[Bounds], obstacles: &[Px], frame: &Bounds) -> f64 {
    let size = (area.high[0] - area.low[0]) * (area.high[1] - area.low[1]);
    let hidden: f64 = taken.iter().map(|t| shared_area(area, t)).sum::<f64>() / size;
    let outside = 1.0 - shared_area(area, frame) / size;
    let crossed = obstacles.iter().filter(|p| area.contains(&Point::from(**p))).count() as f64;
    1e4 * (hidden + outside) + 4.0 * crossed
}

/// The point at a part of a line's length, and the direction there.
pub(super) fn point_at(line: &[Px], part: f64) -> Option<(Px, Px)> {
    let length = |p: &[Px]| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
    let whole: f64 = line.windows(2).map(length).sum();
    let mut left = part * whole;
    for pair in line.windows(2) {
        let own = length(pair);
        if own > 0.0 && left <= own * (1.0 + 1e-9) {
            let along = [0, 1].map(|i| (pair[1][i] - pair[0][i]) / own);
            return Some(([0, 1].map(|i| pair[0][i] + left * along[i]), along));
        }
        left -= own;
    }
    None
}

fn samples(line: &[Px]) -> impl Iterator<Item = Px> {
    let parts = (0..=20).map(|n| f64::from(n) / 20.0);
    line.windows(2).flat_map(move |pair| {
        parts.clone().map(|t| [0, 1].map(|i| pair[0][i] + t * (pair[1][i] - pair[0][i])))
    })
}

pub(in crate::report) fn colours(names: &[String]) -> Vec<String> {
    Muscles::built_in().info(names).iter().map(|m| m.colour.to_lowercase()).collect()
}
