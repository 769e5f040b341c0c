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

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of 16 triangles around a hole: nodes 0..8 on the outer outline and 8..16 on the inner one, counter-clockwise.
    fn ring() -> Vec<[usize; 3]> {
        (0..8).flat_map(|i| [[i, (i + 1) % 8, 8 + i], [(i + 1) % 8, 8 + (i + 1) % 8, 8 + i]]).collect()
    }

    fn slices(cells: &[[usize; 3]]) -> impl Iterator<Item = &[usize]> {
        cells.iter().map(<[usize; 3]>::as_slice)
    }

    #[test]
    fn a_ring_has_an_outer_outline_and_a_hole_that_runs_the_other_way() {
        let ring = ring();
        let loops = outlines(slices(&ring));
        assert_eq!(loops, [vec![0, 1, 2, 3, 4, 5, 6, 7], vec![8, 15, 14, 13, 12, 11, 10, 9]]);
        let on_outline: Vec<[usize; 2]> =
            edges(slices(&ring)).into_iter().filter(|(_, cells)| *cells == 1).map(|(edge, _)| edge).collect();
        let surface: Vec<Vec<usize>> = surface(slices(&ring)).into_keys().collect();
        assert_eq!(surface, on_outline.iter().map(|e| e.to_vec()).collect::<Vec<_>>());
        assert_eq!(on_outline.len(), 16);
    }

    #[test]
    fn parts_that_meet_in_a_node_and_parts_that_do_not_are_all_outlined() {
        let cells = [[0, 1, 2], [2, 3, 4], [5, 6, 7]];
        let loops = outlines(slices(&cells));
        assert_eq!(loops.iter().map(Vec::len).sum::<usize>(), 9);
        assert_eq!(loops.last(), Some(&vec![5, 6, 7]));
    }
}
