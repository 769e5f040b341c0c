//! Muscle parts outside the tissue (styloglossus to the styloid process, hyoglossus to the hyoid bone).
//!
//! In the mesh such a part is a chain of connections without cells. A chain without load has no lateral stiffness (the stiffness matrix is
//! singular), and it folds in compression: the "unnatural bending" of thesis 4.4.2. In the body a sheath keeps the part straight. So the
//! chain is condensed to one straight element: springs in series with `1/k = sum 1/k_i`, the straight distance between its ends at rest as
//! rest length, and the muscle's tension. For a straight chain this is exact, and the inner nodes are then placed at the chain's
//! equilibrium. A chain that is bent at rest is made straight, so that the body stays at rest without tension.
//!
//! In motion dampers and contractile elements are condensed in the same way (`1/b = sum 1/b_i`, likewise k2 and b_cc). The coefficients
//! have the same proportions in every link, so that this is exact too, except that the inner nodes have no mass.

use std::collections::BTreeMap;

use nalgebra::SVector;

use crate::body::Mesh;
use crate::geometry::topology;

/// A chain is bent if it is longer than the distance between its ends by more than this part, which is rounding.
const BENT_TOLERANCE: f64 = 1e-12;

/// A condensed chain between two nodes that are on bone or in the tissue.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightPath {
    /// All nodes from end to end.
    nodes: Vec<usize>,
    /// Rest length from the first end to each node, m.
    rest_up_to: Vec<f64>,
    /// Compliance from the first end to each node, m/N.
    compliance_up_to: Vec<f64>,
    /// Whether it is longer in the mesh than the distance between its ends.
    pub(super) is_bent: bool,
}

impl StraightPath {
    pub fn ends(&self) -> [usize; 2] {
        [self.nodes[0], self.nodes[self.nodes.len() - 1]]
    }

    pub fn inner_nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.nodes[1..self.nodes.len() - 1].iter().copied()
    }

    /// Spring constant of the whole path, N/m (2D: per metre of thickness).
    pub fn stiffness(&self) -> f64 {
        1.0 / self.compliance_up_to[self.nodes.len() - 1]
    }

    /// Length of the whole path at rest, m.
    pub fn rest_length(&self) -> f64 {
        self.rest_up_to[self.nodes.len() - 1]
    }

    /// Places the inner nodes on the straight line between the ends, where the tension is the same on both sides of each.
    pub fn place<const D: usize>(&self, positions: &mut [SVector<f64, D>]) {
        let [a, b] = self.ends();
        let (start, way) = (positions[a], positions[b] - positions[a]);
        let length = way.norm();
        let force = (length - self.rest_length()) * self.stiffness();
        for (i, &node) in self.nodes.iter().enumerate().take(self.nodes.len() - 1).skip(1) {
            let share = if length > 0.0 {
                (self.rest_up_to[i] + force * self.compliance_up_to[i]) / length
            } else {
                0.0
            };
            positions[node] = start + way * share;
        }
    }

    /// Computes the motion of the inner nodes from that of the ends, at these positions.
    pub fn carry<const D: usize>(&self, positions: &[SVector<f64, D>], motion: &mut [SVector<f64, D>]) {
        let [a, b] = self.ends();
        let (way, moved) = (positions[b] - positions[a], motion[b] - motion[a]);
        let length = way.norm();
        let stretch = if length > 0.0 { way.dot(&moved) / length } else { 0.0 };
        for (i, &node) in self.nodes.iter().enumerate().take(self.nodes.len() - 1).skip(1) {
            if length > 0.0 {
                let yields = self.stiffness() * self.compliance_up_to[i];
                let share = (self.rest_up_to[i] + (length - self.rest_length()) * yields) / length;
                motion[node] = motion[a] + moved * share + way * (stretch * (yields - share) / length);
            } else {
                motion[node] = motion[a];
            }
        }
    }
}

/// All paths outside the tissue: longest chains of muscle nodes that are in no cell, not fixed and joined to two nodes only. `stiffness`
/// has the spring constant of every connection, N/m.
pub fn find<const D: usize>(mesh: &Mesh<D>, stiffness: &[f64]) -> Vec<StraightPath> {
    let in_tissue = mesh.in_tissue();
    let mut degree = vec![0; mesh.nodes.len()];
    let mut stiffness_of = BTreeMap::new();
    for (&[a, b], &k) in mesh.connections.iter().zip(stiffness) {
        degree[a] += 1;
        degree[b] += 1;
        stiffness_of.insert([a, b], k);
    }
    let is_inner = |n: usize| !in_tissue[n] && degree[n] == 2 && mesh.fixed.binary_search(&n).is_err();
    let mut paths: Vec<StraightPath> = Vec::new();
    for muscle in &mesh.muscles {
        let stops: Vec<usize> = (0..muscle.nodes.len()).filter(|&i| !is_inner(muscle.nodes[i])).collect();
        for stop in stops.windows(2).filter(|s| s[1] - s[0] > 1) {
            let nodes = muscle.nodes[stop[0]..=stop[1]].to_vec();
            let (mut rest, mut compliance) = (0.0, 0.0);
            let mut path =
                StraightPath { nodes, rest_up_to: vec![0.0], compliance_up_to: vec![0.0], is_bent: false };
            for pair in path.nodes.windows(2) {
                let key = topology::pair(pair[0], pair[1]);
                rest += (mesh.nodes[pair[1]] - mesh.nodes[pair[0]]).norm();
                compliance += stiffness_of.get(&key).map_or(0.0, |k| 1.0 / k);
                path.rest_up_to.push(rest);
                path.compliance_up_to.push(compliance);
            }
            let straight = mesh.distance(path.ends());
            path.is_bent = rest > (1.0 + BENT_TOLERANCE) * straight;
            if path.is_bent {
                path.rest_up_to.iter_mut().for_each(|up_to| *up_to *= straight / rest);
            }
            if !paths.iter().any(|p| p.nodes == path.nodes) {
                paths.push(path);
            }
        }
    }
    paths
}
