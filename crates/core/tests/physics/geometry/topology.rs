//! Outlines and surfaces of meshes.

use tongue_core::geometry::topology::{edges, outlines, surface};

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
