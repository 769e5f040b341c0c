//! Nested meshes: every cell is divided into cells of half its size.

use nalgebra::SVector;

use super::{ClosedSpline, Mesh};
use crate::geometry::quadratic;
use crate::geometry::topology::{self, pair};
use std::collections::{BTreeMap, BTreeSet};

impl<const D: usize> Mesh<D> {
    /// The mesh with a node in the middle of every edge of a cell, and four cells (in space eight) in place
    /// of each. Nodes keep their numbers; muscles run through the middles of the edges that they run along;
    /// bones that hold all of a surface edge (in space: face) hold its middles too.
    ///
    /// For springs only: the elements and muscles of a continuum are not refined.
    pub fn refined(&self) -> Self {
        let mut nodes = self.nodes.clone();
        let mut middles: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for &edge in self.cells.edges().keys() {
            middles.insert(edge, nodes.len());
            nodes.push((nodes[edge[0]] + nodes[edge[1]]) * 0.5);
        }
        let mut mesh = Self { nodes, ..Self::default() };
        for cell in self.cells.iter() {
            let middle = quadratic::edges::<D>().iter().map(|&[i, j]| middles[&pair(cell[i], cell[j])]);
            let all: Vec<usize> = cell.iter().copied().chain(middle).collect();
            for part in quadratic::parts::<D>() {
                let part: Vec<usize> = part.iter().map(|&i| all[i]).collect();
                mesh.cells.push(&part);
            }
        }
        mesh.muscles.clone_from(&self.muscles);
        for muscle in &mut mesh.muscles {
            let mut chain: Vec<usize> = muscle.nodes[..1].to_vec();
            for step in muscle.nodes.windows(2) {
                chain.extend(middles.get(&pair(step[0], step[1])));
                chain.push(step[1]);
            }
            muscle.nodes = chain;
        }
        let holds = |face: &&Vec<usize>| face.iter().all(|n| self.fixed.binary_search(n).is_ok());
        let held = self.surface();
        let held = held.iter().filter(holds).flat_map(|f| topology::edges(std::iter::once(f.as_slice())));
        let fixed: BTreeSet<usize> =
            held.filter_map(|(edge, _)| middles.get(&edge)).chain(&self.fixed).copied().collect();
        mesh.fixed = fixed.into_iter().collect();
        mesh.connect();
        mesh
    }
}

impl Mesh<2> {
    /// The mesh with every node of its outline moved to the nearest place of a curve.
    pub fn on_outline(mut self, outline: &ClosedSpline) -> Self {
        for node in self.surface_nodes() {
            let (along, _) = outline.nearest(self.nodes[node]);
            let at: SVector<f64, 2> = outline.at(along);
            self.nodes[node] = at;
        }
        self
    }
}
