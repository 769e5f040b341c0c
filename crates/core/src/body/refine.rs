//! Nested meshes: every cell is divided into cells of half its size.

use std::collections::{BTreeMap, BTreeSet};

use super::{Body, ClosedSpline, Mesh};
use crate::geometry::hexahedron::{CORNERS, LOCAL, values};
use crate::geometry::quadratic;
use crate::geometry::topology::{self, pair};

impl<const D: usize> Mesh<D> {
    /// The mesh with a node in the middle of every edge of a cell, and four cells (in space eight) in place of each. Nodes keep their
    /// numbers; muscles pass through the middles of their edges; bones that hold a whole surface edge (in space: face) hold its middles
    /// too. The elements and muscles of a continuum are not refined.
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
        let held = self.surface();
        let held = held.iter().filter(|face| face.iter().all(|n| self.fixed.binary_search(n).is_ok()));
        let held = held.flat_map(|f| topology::edges(std::iter::once(f.as_slice())));
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
            self.nodes[node] = outline.point(along);
        }
        self
    }
}

impl Body<3> {
    /// The body with every hexahedron divided into eight. Nodes keep their numbers; a new node is on bone if all corners of which it is
    /// the middle are. Muscles keep their fibres and their stress, and their regions consist of the parts of their elements.
    pub fn refined(&self) -> Self {
        let mut body = self.clone();
        body.what = format!("{}, every hexahedron divided into eight", self.what);
        let mut middle: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
        let mut cut = Vec::with_capacity(8 * self.mesh.hexahedra.len());
        for corners in &self.mesh.hexahedra {
            for part in LOCAL {
                let nodes = LOCAL.map(|corner| {
                    // The middle between the corner of the whole and the corner of the part that it is a part of.
                    let at: [f64; 3] = std::array::from_fn(|d| 0.5 * (part[d] + corner[d]));
                    let shares = values(at);
                    let mut among: Vec<usize> =
                        (0..CORNERS).filter(|&i| shares[i] > 1e-9).map(|i| corners[i]).collect();
                    among.sort_unstable();
                    among.dedup();
                    if let [one] = among[..] {
                        return one;
                    }
                    *middle.entry(among).or_insert_with_key(|among| {
                        let place = corners.iter().zip(shares).map(|(&n, s)| self.mesh.nodes[n] * s).sum();
                        body.mesh.nodes.push(place);
                        let number = body.mesh.nodes.len() - 1;
                        for bone in &mut body.bones {
                            if among.iter().all(|n| bone.nodes.contains(n)) {
                                bone.nodes.push(number);
                            }
                        }
                        if among.iter().all(|n| self.mesh.fixed.binary_search(n).is_ok()) {
                            body.mesh.fixed.push(number);
                        }
                        number
                    })
                });
                cut.push(nodes);
            }
        }
        body.mesh.hexahedra = cut;
        body.factors = self.factors.iter().flat_map(|&factor| [factor; 8]).collect();
        for muscle in &mut body.muscles {
            muscle.region = muscle.region.iter().flat_map(|e| 8 * e..8 * e + 8).collect();
            // Each part contains one Gauss point of the whole, in the same order.
            muscle.directions = muscle.directions.iter().flat_map(|d| d.map(|at| [at; 8])).collect();
        }
        body.mesh.connect();
        body
    }
}
