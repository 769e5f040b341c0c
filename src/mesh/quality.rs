//! How good a 2D mesh is, in the numbers that the thesis gives for its own.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Mesh;
use super::plane;

/// Counts and extremes of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// Nodes.
    pub nodes: usize,
    /// Nodes of no triangle: those of muscles outside the tissue.
    pub nodes_outside_tissue: usize,
    /// Nodes on the rim of the tissue.
    pub boundary_nodes: usize,
    /// Triangles.
    pub cells: usize,
    /// Connections.
    pub connections: usize,
    /// Area of all triangles, m².
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
        let mut in_tissue = vec![false; mesh.nodes.len()];
        let mut sides: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        let (mut area, mut smallest) = (0.0, f64::INFINITY);
        for cell in mesh.cells.iter() {
            let &[a, b, c] = cell else { continue };
            for [node, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
                in_tissue[node] = true;
                *sides.entry([node.min(next), node.max(next)]).or_default() += 1;
                let (u, v) = (mesh.nodes[next] - mesh.nodes[node], mesh.nodes[last] - mesh.nodes[node]);
                smallest = f64::min(smallest, u.perp(&v).atan2(u.dot(&v)).to_degrees());
            }
            area += 0.5 * plane::doubled_area(mesh.nodes[a], mesh.nodes[b], mesh.nodes[c]);
        }
        // An edge of one triangle only is on the rim. A rim is closed, so it has as many nodes as edges.
        let boundary_nodes = sides.values().filter(|count| **count == 1).count();
        let lengths = || mesh.connections.iter().map(|[a, b]| (mesh.nodes[*a] - mesh.nodes[*b]).norm());
        let or_zero = |x: f64| if x.is_finite() { x } else { 0.0 };
        Self {
            nodes: mesh.nodes.len(),
            nodes_outside_tissue: in_tissue.iter().filter(|t| !**t).count(),
            boundary_nodes,
            cells: mesh.cells.len(),
            connections: mesh.connections.len(),
            area_m2: area,
            smallest_angle_deg: or_zero(smallest),
            shortest_connection_m: or_zero(lengths().fold(f64::INFINITY, f64::min)),
            mean_connection_m: or_zero(lengths().sum::<f64>() / mesh.connections.len() as f64),
            longest_connection_m: lengths().fold(0.0, f64::max),
        }
    }
}
