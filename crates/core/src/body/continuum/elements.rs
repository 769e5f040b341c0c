//! From linear cells to quadratic elements.

use std::collections::BTreeMap;

use crate::body::{Cells, Mesh};
use crate::geometry::quadratic;
use crate::geometry::topology::pair;

/// The tissue of a mesh with nodes in the middle of its edges: the mesh of its nodes and of the linear parts
/// of the elements, the elements, and the new number of every node that is in the tissue.
pub(super) fn quadratic<const D: usize>(base: &Mesh<D>) -> (Mesh<D>, Vec<Vec<usize>>, Vec<Option<usize>>) {
    let mut nodes = Vec::new();
    let number: Vec<Option<usize>> = base
        .in_tissue()
        .iter()
        .zip(&base.nodes)
        .map(|(inside, at)| {
            inside.then(|| {
                nodes.push(*at);
                nodes.len() - 1
            })
        })
        .collect();
    let mut middles: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let (mut elements, mut cells) = (Vec::new(), Cells::new());
    for cell in base.cells.iter() {
        let mut element: Vec<usize> = cell.iter().filter_map(|&n| number[n]).collect();
        for &[i, j] in quadratic::edges::<D>() {
            let [a, b] = pair(element[i], element[j]);
            element.push(*middles.entry([a, b]).or_insert_with(|| {
                nodes.push((nodes[a] + nodes[b]) * 0.5);
                nodes.len() - 1
            }));
        }
        for part in quadratic::parts::<D>() {
            let part: Vec<usize> = part.iter().map(|&i| element[i]).collect();
            cells.push(&part);
        }
        elements.push(element);
    }
    (Mesh { nodes, cells, ..Mesh::default() }, elements, number)
}
