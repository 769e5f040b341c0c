//! Simple solids of tetrahedra on a fixed base at z = 0: a block and a cylinder.

use nalgebra::Vector3;

use super::{Mesh, MuscleChain};
use crate::geometry::simplex;

/// A block with a corner at the origin: `counts` cubes along x, y, z of six tetrahedra each (Kuhn's division, in which neighbouring cubes
/// have the same diagonals of their common face). `size` in m.
pub fn block(size: [f64; 3], counts: [usize; 3]) -> Mesh<3> {
    let counts = counts.map(|n| n.max(1));
    let mut mesh = Mesh::default();
    for at in grid(counts.map(|n| n + 1)) {
        mesh.nodes.push(Vector3::from_fn(|d, _| size[d] * at[d] as f64 / counts[d] as f64));
    }
    // Each permutation of the axes gives a tetrahedron; those of odd permutations are mirrored.
    let walks = [
        ([0, 1, 2], false),
        ([1, 2, 0], false),
        ([2, 0, 1], false),
        ([0, 2, 1], true),
        ([2, 1, 0], true),
        ([1, 0, 2], true),
    ];
    for cube in grid(counts) {
        for (walk, mirrored) in walks {
            let mut at = cube;
            let mut cell = [grid_node(counts, at); 4];
            for (corner, axis) in cell.iter_mut().skip(1).zip(walk) {
                at[axis] += 1;
                *corner = grid_node(counts, at);
            }
            if mirrored {
                cell.swap(2, 3);
            }
            mesh.cells.push(&cell);
        }
    }
    mesh.connect();
    mesh.fixed = (0..grid_node(counts, [0, 0, 1])).collect();
    mesh
}

/// The places of a grid with these numbers of them along each axis; the first axis is the fastest.
pub(super) fn grid([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// The number of the node at a place of the grid of the nodes of so many cells along each axis.
pub(super) fn grid_node([nx, ny, _]: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    (k * (ny + 1) + j) * (nx + 1) + i
}

/// A cylinder along z of `rings` rings of triangles and `layers` layers of prisms, three tetrahedra each; every column of nodes is a
/// muscle fibre called `axial`. `radius` and `length` in m.
pub fn cylinder(radius: f64, length: f64, rings: usize, layers: usize) -> Mesh<3> {
    let (rings, layers) = (rings.max(1), layers.max(1));
    let (disc, triangles) = disc(radius, rings);
    let per_layer = disc.len();
    let mut mesh = Mesh::default();
    for layer in 0..=layers {
        let z = length * layer as f64 / layers as f64;
        mesh.nodes.extend(disc.iter().map(|[x, y]| Vector3::new(*x, *y, z)));
    }
    for layer in 0..layers {
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|n| n + layer * per_layer);
            let [d, e, f] = [a, b, c].map(|n| n + per_layer);
            // Since the corners are in ascending order, neighbouring prisms have the same diagonal of their common face.
            for cell in [[a, b, c, f], [a, b, f, e], [a, e, f, d]] {
                let volume = simplex::measure::<3>(&simplex::corners(&mesh.nodes, &cell));
                let [a, b, c, d] = cell;
                mesh.cells.push(&if volume < 0.0 { [a, b, d, c] } else { cell });
            }
        }
    }
    mesh.fixed = (0..per_layer).collect();
    let nodes = |n: usize| (0..=layers).map(|layer| layer * per_layer + n).collect();
    let fibres = (0..per_layer).map(|n| MuscleChain { name: "axial".to_owned(), nodes: nodes(n) });
    mesh.muscles = fibres.collect();
    mesh.connect();
    mesh
}

/// Points of a disc on rings of 1, 6, 12, .. points, and its triangles, the corners of each in ascending order.
fn disc(radius: f64, rings: usize) -> (Vec<[f64; 2]>, Vec<[usize; 3]>) {
    let mut points = Vec::new();
    for ring in 0..=rings {
        let r = radius * ring as f64 / rings as f64;
        let count = ring_points(ring);
        for i in 0..count {
            let angle = std::f64::consts::TAU * i as f64 / count as f64;
            points.push([r * angle.cos(), r * angle.sin()]);
        }
    }
    let mut triangles = Vec::new();
    for ring in 1..=rings {
        for sextant in 0..6 {
            for i in 0..ring {
                let (outer, inner) = (sextant * ring + i, sextant * (ring - 1) + i);
                triangles.push([
                    disc_point(ring, outer),
                    disc_point(ring, outer + 1),
                    disc_point(ring - 1, inner),
                ]);
                if i + 1 < ring {
                    triangles.push([
                        disc_point(ring - 1, inner),
                        disc_point(ring, outer + 1),
                        disc_point(ring - 1, inner + 1),
                    ]);
                }
            }
        }
    }
    triangles.iter_mut().for_each(|t| t.sort_unstable());
    (points, triangles)
}

/// The number of points of a ring of a disc: one in the middle, then six more in each ring.
fn ring_points(ring: usize) -> usize {
    (6 * ring).max(1)
}

fn disc_point(ring: usize, i: usize) -> usize {
    let first = if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    first + i % ring_points(ring)
}
