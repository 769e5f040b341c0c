//! Directions of a body's shape in which the ends of muscles move.

use tongue_core::body::{Body, HYOID, MANDIBLE, Mesh};
use tongue_core::geometry::Point;

use crate::standard_deviations::{FAR_END_MM, MUSCLE_END_MM};

/// A node where muscles cross moves along the other muscle; if the sine of their angle is smaller than this it stays.
const LEAST_SINE: f64 = 0.3;

/// Motion of the nodes when an end of a muscle moves: its straight line turns with the end; ends on the outline slide along it.
pub(super) fn ends(body: &Body<2>) -> Vec<Vec<Point>> {
    let mesh = &body.mesh;
    let outline = mesh.outlines().into_iter().max_by_key(Vec::len).unwrap_or_default();
    let inside = mesh.in_tissue();
    let fixed = |n: usize| mesh.fixed.binary_search(&n).is_ok();
    let seen = |n: usize| [MANDIBLE, HYOID].iter().any(|b| body.bone(b).contains(&n));
    let mut nodes: Vec<usize> = mesh.muscles.iter().flat_map(|m| m.ends()).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let size = |n: usize| if fixed(n) && !seen(n) { FAR_END_MM } else { MUSCLE_END_MM };
    let mut out = Vec::new();
    for end in nodes {
        let on_outline = outline.iter().position(|&n| n == end).filter(|_| !fixed(end));
        let ways: Vec<Point> = match on_outline {
            Some(i) => {
                let count = outline.len();
                let (before, after) = (outline[(i + count - 1) % count], outline[(i + 1) % count]);
                (mesh.nodes[after] - mesh.nodes[before]).try_normalize(0.0).into_iter().collect()
            }
            None => vec![Point::x(), Point::y()],
        };
        for way in ways {
            let mut moved = vec![Point::zeros(); mesh.nodes.len()];
            moved[end] = way * (1e-3 * size(end));
            for (number, muscle) in mesh.muscles.iter().enumerate() {
                let [a, b] = muscle.ends();
                let other = if a == end { b } else { a };
                let line = mesh.nodes[other] - mesh.nodes[end];
                if (a != end && b != end) || line.norm() <= 0.0 {
                    continue;
                }
                let normal = Point::new(-line.y, line.x) / line.norm();
                for &node in muscle.nodes.iter().filter(|&&n| n != a && n != b && !fixed(n)) {
                    let part = 1.0 - (mesh.nodes[node] - mesh.nodes[end]).dot(&line) / line.norm_squared();
                    let across = normal.dot(&moved[end]) * part.clamp(0.0, 1.0);
                    let crossing = crossing(mesh, number, node);
                    let along = crossing.unwrap_or(normal);
                    let sine = normal.dot(&along);
                    if inside[node] && sine.abs() < LEAST_SINE || outline.contains(&node) {
                        continue;
                    }
                    moved[node] = along * (across / sine);
                }
            }
            out.push(moved);
        }
    }
    out
}

/// The direction of another muscle that shares a node.
fn crossing(mesh: &Mesh<2>, number: usize, node: usize) -> Option<Point> {
    let other = mesh.muscles.iter().enumerate().find(|(i, m)| *i != number && m.nodes.contains(&node))?.1;
    let [a, b] = other.ends();
    (mesh.nodes[b] - mesh.nodes[a]).try_normalize(0.0)
}
