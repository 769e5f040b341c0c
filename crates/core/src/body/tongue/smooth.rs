//! Places the free nodes of a mesh and smooths it in rounds of moving nodes and triangulating again.
//!
//! Free nodes form a hexagonal lattice; the missing ones are placed in the largest holes. In the first rounds every free node moves to the
//! mean of the circumcentres around it, weighted by area, which minimises the error of linear interpolation (optimal Delaunay
//! triangulation; Chen and Xu 2004, Chen 2004). In the last rounds the worst remaining triangles are improved one node at a time.

use spade::handles::FixedVertexHandle as Handle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::frame::{DraftNode, Freedom, OutlineFrame};
use crate::body::BodyError;
use crate::geometry::plane::{self, Point};

/// Numbers of rounds by circumcentres and by single nodes.
const EVEN_ROUNDS: usize = 15;
const POLISH_ROUNDS: usize = 6;
const SWEEPS: usize = 3;
/// The sine of an angle, and the length of a connection in mesh spacings, with a score of 1.
const SINE_UNIT: f64 = 0.5;
const LENGTH_UNIT: f64 = 0.6;
/// Nodes whose triangles all have this score do not move.
const GOOD_SCORE: f64 = 0.9;
/// First and smallest step of the search, in mesh spacings.
const FIRST_STEP: f64 = 0.1;
const LAST_STEP: f64 = 0.01;

pub(crate) fn smooth(
    nodes: &mut [DraftNode],
    segments: &[[usize; 2]],
    h: f64,
) -> Result<Vec<[usize; 3]>, BodyError> {
    let mut points: Vec<Point> = nodes.iter().map(|n| n.at).collect();
    let mut triangles = triangulate(&points, segments)?;
    for round in 0..EVEN_ROUNDS + POLISH_ROUNDS {
        let around = around(points.len(), &triangles);
        let patches = nodes.iter().zip(&around).enumerate();
        if round < EVEN_ROUNDS {
            for (node, (draft, patch)) in patches {
                even(&mut points, node, draft.freedom, patch, h);
            }
        } else {
            for (node, (draft, patch)) in (0..SWEEPS).flat_map(|_| patches.clone()) {
                polish(&mut points, node, draft.freedom, patch, h);
            }
        }
        triangles = triangulate(&points, segments)?;
    }
    nodes.iter_mut().zip(points).for_each(|(node, at)| node.at = at);
    Ok(triangles)
}

/// The other two corners of every triangle around each node, in counter-clockwise order.
fn around(count: usize, triangles: &[[usize; 3]]) -> Vec<Vec<[usize; 2]>> {
    let mut around = vec![Vec::new(); count];
    for [a, b, c] in triangles.iter().copied() {
        for (node, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            around[node].push(others);
        }
    }
    around
}

fn even(points: &mut [Point], node: usize, freedom: Freedom, patch: &[[usize; 2]], h: f64) {
    let here = points[node];
    let (mut sum, mut area) = (Point::zeros(), 0.0);
    for [b, c] in patch {
        let weight = plane::doubled_area(here, points[*b], points[*c]);
        sum += plane::circumcentre([here, points[*b], points[*c]]) * weight;
        area += weight;
    }
    let step = sum / area - here;
    let step = match freedom {
        Freedom::None => return,
        Freedom::Along(line) => line * step.dot(&line),
        Freedom::Plane => step,
    };
    let limit = 0.3 * h;
    let there = here + step * (limit / step.norm()).min(1.0);
    // The node moves only if no triangle around it is inverted; a step of NaN is rejected too.
    if patch_score(points, there, patch, h) >= patch_score(points, here, patch, h).min(0.5) {
        points[node] = there;
    }
}

/// The score of the worst triangle around a node that is moved to `at`: 1 is fair, 0 or less is inverted.
fn patch_score(points: &[Point], at: Point, patch: &[[usize; 2]], h: f64) -> f64 {
    let scores = patch.iter().map(|[b, c]| {
        let (b, c) = (points[*b], points[*c]);
        let mut sides = [(b - at).norm_squared(), (c - at).norm_squared(), (c - b).norm_squared()];
        sides.sort_by(f64::total_cmp);
        let sine = plane::doubled_area(at, b, c) / (sides[1] * sides[2]).sqrt();
        if sine > 0.0 { (sine / SINE_UNIT).min(sides[0].sqrt() / (LENGTH_UNIT * h)) } else { sine }
    });
    scores.fold(f64::INFINITY, f64::min)
}

fn polish(points: &mut [Point], node: usize, freedom: Freedom, patch: &[[usize; 2]], h: f64) {
    let diagonal = 0.5_f64.sqrt();
    let compass =
        [(1.0, 0.0), (diagonal, diagonal), (0.0, 1.0), (-diagonal, diagonal)].map(|(x, y)| Point::new(x, y));
    let directions: &[Point] = match &freedom {
        Freedom::None => return,
        Freedom::Along(line) => std::slice::from_ref(line),
        Freedom::Plane => &compass,
    };
    let mut score = patch_score(points, points[node], patch, h);
    let mut step = FIRST_STEP * h;
    while score < GOOD_SCORE && step > LAST_STEP * h {
        let here = points[node];
        let steps = directions.iter().flat_map(|d| [d * step, d * -step]);
        let scored = steps.map(|s| (here + s, patch_score(points, here + s, patch, h)));
        match scored.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((there, better)) if better > score => {
                points[node] = there;
                score = better;
            }
            _ => step /= 2.0,
        }
    }
}

/// Smallest distance of lattice nodes from outline and muscles, in mesh spacings.
const LINE_DISTANCE: f64 = 0.55;
/// First lattice spacing in mesh spacings, and the factor by which it grows while the lattice has too many nodes.
const FIRST_LATTICE: f64 = 0.98;
const LATTICE_GROWTH: f64 = 1.01;
/// One round of filling holes places one part in this many of the missing nodes.
const HOLE_ROUNDS: usize = 4;

/// Adds `wanted` free nodes to a frame at a mesh spacing `h`, m.
pub(crate) fn fill(frame: &mut OutlineFrame, wanted: usize, h: f64) -> Result<(), BodyError> {
    let lines: Vec<[Point; 2]> =
        frame.segments.iter().map(|[a, b]| [frame.nodes[*a].at, frame.nodes[*b].at]).collect();
    let outline: Vec<Point> = frame.nodes[..frame.boundary].iter().map(|n| n.at).collect();
    let clear = |p: &Point, by: f64| {
        plane::encloses(&outline, *p)
            && lines.iter().all(|[a, b]| plane::squared_distance_to_line(*p, *a, *b) > (by * h).powi(2))
    };

    let mut spacing = FIRST_LATTICE * h;
    let lattice = loop {
        let nodes: Vec<Point> = hexagons(&outline, spacing).filter(|p| clear(p, LINE_DISTANCE)).collect();
        if nodes.len() <= wanted {
            break nodes;
        }
        spacing *= LATTICE_GROWTH;
    };
    let placed = lattice.len();
    frame.nodes.extend(lattice.into_iter().map(|at| DraftNode { at, freedom: Freedom::Plane }));

    let mut missing = wanted - placed;
    while missing > 0 {
        let mut holes = holes(&frame.nodes, &frame.segments)?;
        holes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (before, round) = (frame.nodes.len(), missing.div_ceil(HOLE_ROUNDS));
        for (centre, radius) in &holes {
            if frame.nodes.len() == before + round {
                break;
            }
            // The circle may contain nodes beyond a line that its triangle does not cross, or nodes of this round, which are the last in
            // the list.
            let filled = frame.nodes.iter().rev().any(|n| (n.at - centre).norm() < 0.99 * radius);
            if !filled && clear(centre, LINE_DISTANCE / 2.0) {
                frame.nodes.push(DraftNode { at: *centre, freedom: Freedom::Plane });
            }
        }
        if frame.nodes.len() == before {
            return Err(BodyError(format!(
                "there is no room for {missing} nodes at this spacing; try a finer one"
            )));
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

/// Circumcentre and circumradius of every triangle, m.
fn holes(nodes: &[DraftNode], segments: &[[usize; 2]]) -> Result<Vec<(Point, f64)>, BodyError> {
    let points: Vec<Point> = nodes.iter().map(|n| n.at).collect();
    let triangles = triangulate(&points, segments)?;
    let circles = triangles.iter().map(|t| {
        let corners = t.map(|i| points[i]);
        let centre = plane::circumcentre(corners);
        (centre, (centre - corners[0]).norm())
    });
    Ok(circles.filter(|(centre, _)| centre.iter().all(|c| c.is_finite())).collect())
}

/// The triangles inside a closed outline, counter-clockwise, with every node as a corner and every segment as an edge. The segments
/// contain the outline.
pub(crate) fn triangulate(nodes: &[Point], segments: &[[usize; 2]]) -> Result<Vec<[usize; 3]>, BodyError> {
    let points = nodes.iter().map(|p| Point2::new(p.x, p.y)).collect();
    // The checks below find conflicts, and segments that were split because a node lies on them.
    let cdt: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(points, segments.to_vec(), |_| {})
            .map_err(|_| BodyError("a node's position is not finite".to_owned()))?;
    if cdt.num_vertices() != nodes.len() {
        let message = "two nodes fall on the same place at this spacing; try a finer one";
        return Err(BodyError(message.to_owned()));
    }
    let kept = |[a, b]: &[usize; 2]| cdt.exists_constraint(Handle::from_index(*a), Handle::from_index(*b));
    if let Some([a, b]) = segments.iter().find(|segment| !kept(segment)) {
        let [x, y]: [f64; 2] = ((nodes[*a] + nodes[*b]) / 2.0 * 1e3).into();
        let message = "mm a connection of the outline or of a muscle meets another one at this spacing; try a finer one";
        return Err(BodyError(format!("near [{x:.1}, {y:.1}] {message}")));
    }

    // Triangles that are reached from outside over edges that are no segments are outside the outline.
    let mut outside = vec![false; cdt.num_all_faces()];
    let mut front = Vec::from_iter(
        cdt.convex_hull().filter(|e| !e.is_constraint_edge()).filter_map(|e| e.rev().face().as_inner()),
    );
    while let Some(face) = front.pop() {
        let seen = &mut outside[face.fix().index()];
        if *seen {
            continue;
        }
        *seen = true;
        let open = face.adjacent_edges().into_iter().filter(|e| !e.is_constraint_edge());
        front.extend(open.filter_map(|e| e.rev().face().as_inner()));
    }
    let inside = cdt.inner_faces().filter(|f| !outside[f.fix().index()]);
    Ok(inside.map(|f| f.vertices().map(|v| v.index())).collect())
}
