//! Checks of a mesh, and its quality in the plane in the numbers of the thesis.

use std::collections::BTreeSet;

use serde::Serialize;

use super::Mesh;
use crate::geometry::topology::pair;
use crate::geometry::{plane, simplex};

/// A cell is degenerate below this part of the area or volume that a cell with its longest edge can have.
const DEGENERATE: f64 = 1e-9;

/// Largest body, m. A larger one was given in millimetres, in which any tongue is longer than 10.
const LARGEST_M: f64 = 10.0;

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeshFault {
    #[error("cell {cell} is turned inside out; list its nodes counter-clockwise (in space: positive volume)")]
    Inverted { cell: usize },
    #[error("cell {cell} has no area or volume")]
    Degenerate { cell: usize },
    /// Any other fault, with what to do.
    #[error("{0}")]
    Other(String),
}

impl<const D: usize> Mesh<D> {
    /// Checks that the mesh is consistent: positions are finite, numbers of nodes exist, cells are not inverted; connections are unique
    /// and their nodes in ascending order; edges of cells and steps of muscles are connections.
    pub fn check(&self) -> Result<(), MeshFault> {
        if let Some(node) = self.nodes.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(MeshFault::Other(format!("the position of node {node} is not finite")));
        }
        let connected = self.check_connections()?;
        let joined = |a: usize, b: usize| connected.contains(&pair(a, b));
        self.check_cells(joined)?;
        for muscle in &self.muscles {
            let wrong = |what: String| Err(MeshFault::Other(format!("muscle {} {what}", muscle.name)));
            if muscle.nodes.len() < 2 {
                return wrong(format!("has {} nodes; it needs at least two", muscle.nodes.len()));
            }
            self.in_range(&muscle.nodes, || format!("muscle {}", muscle.name))?;
            if let Some(step) = muscle.nodes.windows(2).find(|s| !joined(s[0], s[1])) {
                return wrong(format!(
                    "steps from node {} to node {}, which are not connected",
                    step[0], step[1]
                ));
            }
            let mut passed = BTreeSet::new();
            if let Some(node) = muscle.nodes.iter().find(|n| !passed.insert(**n)) {
                return wrong(format!("passes node {node} twice; a muscle is one line between two ends"));
            }
        }
        self.in_range(&self.fixed, || "the list of fixed nodes".to_owned())?;
        let Some(before) = self.fixed.windows(2).position(|pair| pair[0] >= pair[1]) else { return Ok(()) };
        Err(MeshFault::Other(format!(
            "entry {} of the fixed nodes is not above the one before; list each once, in ascending order",
            before + 1
        )))
    }

    /// Checks that the body was not given in millimetres.
    pub fn check_size(&self) -> Result<(), MeshFault> {
        let size_m = self.extent();
        if size_m > LARGEST_M {
            return Err(MeshFault::Other(format!(
                "it is {size_m:.0} m across; positions are in metres, so these look like millimetres: divide them by 1000"
            )));
        }
        Ok(())
    }

    fn check_connections(&self) -> Result<BTreeSet<[usize; 2]>, MeshFault> {
        let mut seen = BTreeSet::new();
        for (connection, [a, b]) in self.connections.iter().copied().enumerate() {
            self.in_range(&[a, b], || format!("connection {connection}"))?;
            let what = if a >= b {
                "joins nodes in descending order or a node to itself; write the lower one first"
            } else if !seen.insert([a, b]) {
                "repeats an earlier one"
            } else if self.nodes[a] == self.nodes[b] {
                "has no length"
            } else {
                continue;
            };
            return Err(MeshFault::Other(format!("connection {connection} {what}")));
        }
        Ok(seen)
    }

    fn check_cells(&self, joined: impl Fn(usize, usize) -> bool) -> Result<(), MeshFault> {
        let mut seen = BTreeSet::new();
        for (cell, corners) in self.cells.iter().enumerate() {
            self.in_range(corners, || format!("cell {cell}"))?;
            let mut nodes = corners.to_vec();
            nodes.sort_unstable();
            if !seen.insert(nodes) {
                let what = "repeats an earlier one, so that its tissue would count twice; list it once";
                return Err(MeshFault::Other(format!("cell {cell} {what}")));
            }
            let x = simplex::corners(&self.nodes, corners);
            let sides = (0..=D).flat_map(|i| (0..i).map(move |j| (x[i] - x[j]).norm()));
            let content =
                simplex::factorial::<D>() * simplex::measure(&x) / sides.fold(0.0, f64::max).powi(D as i32);
            if content.is_nan() || content.abs() < DEGENERATE {
                return Err(MeshFault::Degenerate { cell });
            }
            if content < 0.0 {
                return Err(MeshFault::Inverted { cell });
            }
            for (i, from) in corners.iter().copied().enumerate() {
                if let Some(to) = corners[i + 1..].iter().copied().find(|to| !joined(from, *to)) {
                    let what = format!("nodes {from} and {to} of cell {cell} are not connected");
                    return Err(MeshFault::Other(what));
                }
            }
        }
        Ok(())
    }

    fn in_range(&self, nodes: &[usize], what: impl Fn() -> String) -> Result<(), MeshFault> {
        let count = self.nodes.len();
        let Some(node) = nodes.iter().find(|node| **node >= count) else { return Ok(()) };
        let what = what();
        Err(MeshFault::Other(format!(
            "{what} refers to node {node}, but there are {count} nodes (numbered from 0)"
        )))
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    pub nodes: usize,
    /// Nodes that belong to no triangle, which are those of muscles outside the tissue.
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
        let lengths = mesh.connections.iter().map(|c| mesh.distance(*c));
        let mean = lengths.clone().sum::<f64>() / mesh.connections.len() as f64;
        Self {
            nodes: mesh.nodes.len(),
            nodes_outside_tissue: mesh.in_tissue().iter().filter(|t| !**t).count(),
            // An outline is closed, so it has as many nodes as edges.
            boundary_nodes: mesh.surface().len(),
            cells: mesh.cells.len(),
            connections: mesh.connections.len(),
            area_m2: area,
            smallest_angle_deg: or_zero(smallest),
            shortest_connection_m: or_zero(lengths.clone().fold(f64::INFINITY, f64::min)),
            mean_connection_m: or_zero(mean),
            longest_connection_m: or_zero(lengths.fold(0.0, f64::max)),
        }
    }
}

/// 0 in place of an extreme of an empty list.
fn or_zero(extreme: f64) -> f64 {
    if extreme.is_finite() { extreme } else { 0.0 }
}
