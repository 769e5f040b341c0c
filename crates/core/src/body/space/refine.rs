//! Every hexahedron cut in eight.

use std::collections::BTreeMap;

use crate::body::{Body, Muscle};
use crate::geometry::hexahedron::{CORNERS, LOCAL, values};

impl Body<3> {
    /// The same body with every hexahedron cut in eight. Its nodes come first, with their numbers; a new node
    /// is on bone where it lies in the middle of corners that all are. Muscles keep their fibres and their
    /// stress, and run through the parts of their elements.
    pub fn refined(&self) -> Self {
        let mut body = self.clone();
        body.what = format!("{}, every hexahedron cut in eight", self.what);
        let mut middle: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
        let mut cut = Vec::with_capacity(8 * self.mesh.hexahedra.len());
        for corners in &self.mesh.hexahedra {
            for part in LOCAL {
                let nodes = LOCAL.map(|corner| {
                    // Halfway between the corner of the whole and the same corner of the part.
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
        let parts = |m: &Muscle| m.region.iter().flat_map(|e| 8 * e..8 * e + 8).collect();
        for muscle in &mut body.muscles {
            muscle.region = parts(muscle);
            // Each part holds one of the points of the whole, in the same order.
            muscle.directions = muscle.directions.iter().flat_map(|d| d.map(|at| [at; 8])).collect();
        }
        body.mesh.connect();
        body
    }
}
