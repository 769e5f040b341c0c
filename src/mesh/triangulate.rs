//! Triangles between given nodes that keep given edges: spade's constrained Delaunay triangulation.

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::build::MeshError;
use super::plane::Point;

/// The triangles inside a closed outline, counter-clockwise; every node is used and every segment is an edge.
///
/// `segments` are the edges to keep, those of the outline among them.
///
/// # Errors
/// Two segments cross, a node lies on a segment, or two nodes coincide.
pub(crate) fn triangulate(nodes: &[Point], segments: &[[usize; 2]]) -> Result<Vec<[usize; 3]>, MeshError> {
    let points = nodes.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let mut conflict = None;
    let cdt: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(points, segments.to_vec(), |edge| {
            conflict.get_or_insert(edge);
        })
        .map_err(|_| MeshError::NotFinite)?;
    if cdt.num_vertices() != nodes.len() {
        return Err(MeshError::CoincidentNodes);
    }
    // A segment through a node is kept as two: then there are more of them than were asked for.
    if conflict.is_some() || cdt.num_constraints() != segments.len() {
        let at = conflict.and_then(|[a, _]| nodes.get(a)).copied().unwrap_or_default() * 1e3;
        return Err(MeshError::LinesCollide { x_mm: at.x, y_mm: at.y });
    }

    // Flood from outside over edges that are not segments: what stays dry is inside the outline.
    let mut outside = vec![false; cdt.num_all_faces()];
    let mut front: Vec<_> = cdt
        .convex_hull()
        .filter(|e| !e.is_constraint_edge())
        .filter_map(|e| e.rev().face().as_inner())
        .collect();
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
