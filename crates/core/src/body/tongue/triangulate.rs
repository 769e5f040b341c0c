//! Triangles between given nodes that keep given edges: spade's constrained Delaunay triangulation.

use spade::handles::FixedVertexHandle as Handle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::body::BodyError;
use crate::geometry::plane::Point;

/// The triangles inside a closed outline, counter-clockwise; every node is used and every segment is an edge.
///
/// `segments` are the edges to keep, those of the outline among them.
pub(crate) fn triangulate(nodes: &[Point], segments: &[[usize; 2]]) -> Result<Vec<[usize; 3]>, BodyError> {
    let points = nodes.iter().map(|p| Point2::new(p.x, p.y)).collect();
    // Conflicts are found below, together with segments that were split because a node lies on them.
    let cdt: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(points, segments.to_vec(), |_| {})
            .map_err(|_| BodyError("a node's position is not finite".to_owned()))?;
    if cdt.num_vertices() != nodes.len() {
        let said = "two nodes fall on the same place at this spacing; try a finer one";
        return Err(BodyError(said.to_owned()));
    }
    let kept = |[a, b]: &[usize; 2]| cdt.exists_constraint(Handle::from_index(*a), Handle::from_index(*b));
    if let Some([a, b]) = segments.iter().find(|segment| !kept(segment)) {
        let [x, y]: [f64; 2] = ((nodes[*a] + nodes[*b]) / 2.0 * 1e3).into();
        let said = "mm two lines of outline and muscles collide at this spacing; try a finer one";
        return Err(BodyError(format!("near [{x:.1}, {y:.1}] {said}")));
    }

    // Triangles that can be reached from outside over edges that are not segments are outside the outline.
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
