//! Topology of a mesh whose cells are lists of node numbers: shared edges, shared faces and outlines.

use std::collections::BTreeMap;

/// An edge as a pair of nodes with the lower number first.
pub fn pair(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// Every edge of simplices, in ascending order, with the number of cells that share it.
pub fn edges<'a>(cells: impl Iterator<Item = &'a [usize]>) -> BTreeMap<[usize; 2], usize> {
    let mut edges = BTreeMap::new();
    for cell in cells {
        for (i, &a) in cell.iter().enumerate() {
            for &b in &cell[i + 1..] {
                *edges.entry(pair(a, b)).or_default() += 1;
            }
        }
    }
    edges
}

/// The faces of simplices (edges of triangles) that belong to one cell only, by their nodes in ascending order: the number of the cell, and
/// the place in it of the corner that is not on the face.
pub fn surface<'a>(cells: impl Iterator<Item = &'a [usize]>) -> BTreeMap<Vec<usize>, [usize; 2]> {
    let mut faces: BTreeMap<Vec<usize>, Option<[usize; 2]>> = BTreeMap::new();
    for (number, cell) in cells.enumerate() {
        for opposite in 0..cell.len() {
            let mut face = cell.to_vec();
            face.remove(opposite);
            face.sort_unstable();
            faces.entry(face).and_modify(|only| *only = None).or_insert(Some([number, opposite]));
        }
    }
    faces.into_iter().filter_map(|(face, only)| Some((face, only?))).collect()
}

/// The outlines of counter-clockwise triangles as closed loops of nodes, with the tissue to the left: outer ones run counter-clockwise,
/// holes clockwise. Each begins at its lowest node and does not repeat it at the end, and the loops are in ascending order of this node.
pub fn outlines<'a>(triangles: impl Iterator<Item = &'a [usize]>) -> Vec<Vec<usize>> {
    // An edge is interior if another triangle has it in the opposite direction.
    let mut sides: BTreeMap<[usize; 2], [usize; 2]> = BTreeMap::new();
    for triangle in triangles {
        for (&a, &b) in triangle.iter().zip(triangle.iter().cycle().skip(1)) {
            if sides.remove(&pair(a, b)).is_none() {
                sides.insert(pair(a, b), [a, b]);
            }
        }
    }
    let mut next: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    sides.into_values().for_each(|[a, b]| next.entry(a).or_default().push(b));
    let mut loops = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let (mut outline, mut node) = (Vec::new(), start);
        while let Some(there) = next.get_mut(&node).and_then(Vec::pop) {
            outline.push(node);
            node = there;
        }
        next.retain(|_, ways| !ways.is_empty());
        loops.push(outline);
    }
    loops
}
