//! Quality of a mesh; in the plane by the numbers that the thesis gives for its own mesh.

use serde::Serialize;

use super::Mesh;
use crate::geometry::plane;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    pub nodes: usize,
    /// Nodes that belong to no triangle: those of muscles outside the tissue.
    pub nodes_outside_tissue: usize,
    /// Nodes on the outline of the tissue.
    pub boundary_nodes: usize,
    pub cells: usize,
    pub connections: usize,
    pub area_m2: f64,
    /// The smallest angle of any triangle, degrees; 0 without triangles.
    pub smallest_angle_deg: f64,
    /// The shortest connection, m; 0 without connections.
    pub shortest_connection_m: f64,
    /// The mean length of the connections, m; 0 without connections.
    pub mean_connection_m: f64,
    /// The longest connection, m; 0 without connections.
    pub longest_connection_m: f64,
}

impl Quality {
    /// Measures a mesh that passed [`Mesh::check`].
    pub fn of(mesh: &Mesh<2>) -> Self {
        let (mut area, mut smallest) = (0.0, f64::INFINITY);
        for cell in mesh.cells.iter() {
            let &[a, b, c] = cell else { continue };
            for [node, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
                let (u, v) = (mesh.nodes[next] - mesh.nodes[node], mesh.nodes[last] - mesh.nodes[node]);
                smallest = f64::min(smallest, u.perp(&v).atan2(u.dot(&v)).to_degrees());
            }
            area += 0.5 * plane::doubled_area(mesh.nodes[a], mesh.nodes[b], mesh.nodes[c]);
        }
        let [shortest_connection_m, mean_connection_m, longest_connection_m] = connections(mesh);
        Self {
            nodes: mesh.nodes.len(),
            nodes_outside_tissue: mesh.in_tissue().iter().filter(|t| !**t).count(),
            // An outline is closed, so it has as many nodes as edges.
            boundary_nodes: mesh.surface().len(),
            cells: mesh.cells.len(),
            connections: mesh.connections.len(),
            area_m2: area,
            smallest_angle_deg: or_zero(smallest),
            shortest_connection_m,
            mean_connection_m,
            longest_connection_m,
        }
    }
}

/// The shortest, the mean and the longest connection, m; 0 without connections.
fn connections<const D: usize>(mesh: &Mesh<D>) -> [f64; 3] {
    let lengths = || mesh.connections.iter().map(|c| mesh.distance(*c));
    let mean = lengths().sum::<f64>() / mesh.connections.len() as f64;
    [lengths().fold(f64::INFINITY, f64::min), mean, lengths().fold(0.0, f64::max)].map(or_zero)
}

/// An extreme of an empty list counts as 0.
fn or_zero(extreme: f64) -> f64 {
    if extreme.is_finite() { extreme } else { 0.0 }
}
