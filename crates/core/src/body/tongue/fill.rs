//! Nodes between the lines: a hexagonal lattice, then one at a time into the largest hole.

use super::frame::{Draft, Frame, Freedom};
use super::triangulate::triangulate;
use crate::body::BodyError;
use crate::geometry::plane::{self, Point};

/// Lattice nodes keep this far from outline and muscles, in mesh spacings.
const CLEAR: f64 = 0.55;
/// First lattice spacing in mesh spacings, and the factor to widen it by while it gives too many nodes.
const START: f64 = 0.98;
const WIDEN: f64 = 1.01;
/// The share of the missing nodes that one round of hole filling places.
const ROUND: usize = 4;

/// Adds `wanted` free nodes to a frame at spacing `h`, m.
pub(crate) fn fill(frame: &mut Frame, wanted: usize, h: f64) -> Result<(), BodyError> {
    let lines: Vec<[Point; 2]> =
        frame.segments.iter().map(|[a, b]| [frame.nodes[*a].at, frame.nodes[*b].at]).collect();
    let outline: Vec<Point> = frame.nodes[..frame.boundary].iter().map(|n| n.at).collect();
    let clear = |p: &Point, by: f64| {
        plane::encloses(&outline, *p)
            && lines.iter().all(|[a, b]| plane::squared_distance_to_line(*p, *a, *b) > (by * h).powi(2))
    };

    let mut spacing = START * h;
    let lattice = loop {
        let nodes: Vec<Point> = hexagons(&outline, spacing).filter(|p| clear(p, CLEAR)).collect();
        if nodes.len() <= wanted {
            break nodes;
        }
        spacing *= WIDEN;
    };
    let placed = lattice.len();
    frame.nodes.extend(lattice.into_iter().map(|at| Draft { at, freedom: Freedom::Plane }));

    let mut missing = wanted - placed;
    while missing > 0 {
        let mut holes = holes(&frame.nodes, &frame.segments)?;
        holes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (before, round) = (frame.nodes.len(), missing.div_ceil(ROUND));
        for (centre, radius) in &holes {
            if frame.nodes.len() == before + round {
                break;
            }
            // A circle can reach over a line that its triangle may not cross, to nodes on the other side; and
            // nodes of this round, the last in the list, have filled their neighbours' holes.
            let filled = frame.nodes.iter().rev().any(|n| (n.at - centre).norm() < 0.99 * radius);
            if !filled && clear(centre, CLEAR / 2.0) {
                frame.nodes.push(Draft { at: *centre, freedom: Freedom::Plane });
            }
        }
        if frame.nodes.len() == before {
            return Err(BodyError(format!("{missing} nodes find no room at this spacing; try a finer one")));
        }
        missing -= frame.nodes.len() - before;
    }
    Ok(())
}

/// Points of a lattice of equilateral triangles over the box around the outline.
fn hexagons(outline: &[Point], spacing: f64) -> impl Iterator<Item = Point> {
    let low = outline.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = outline.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let rise = spacing * 0.75_f64.sqrt();
    let (rows, columns) = (((high.y - low.y) / rise) as usize + 1, ((high.x - low.x) / spacing) as usize + 1);
    (0..rows).flat_map(move |row| {
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        (0..columns).map(move |column| low + Point::new((column as f64 + shift) * spacing, row as f64 * rise))
    })
}

/// Centre and radius of the circle through the corners of every triangle, m.
fn holes(nodes: &[Draft], segments: &[[usize; 2]]) -> Result<Vec<(Point, f64)>, BodyError> {
    let points: Vec<Point> = nodes.iter().map(|n| n.at).collect();
    let triangles = triangulate(&points, segments)?;
    let circles = triangles.iter().map(|t| {
        let corners = t.map(|i| points[i]);
        let centre = plane::circumcentre(corners);
        (centre, (centre - corners[0]).norm())
    });
    Ok(circles.filter(|(centre, _)| centre.iter().all(|c| c.is_finite())).collect())
}
