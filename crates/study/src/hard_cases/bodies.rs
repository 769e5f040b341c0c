//! Bodies of the hard cases.

use nalgebra::{Rotation2, SVector};

use tongue_core::body::{Cells, Mesh, MuscleChain};
use tongue_core::geometry::topology::pair;

/// A parallelogram of equilateral triangles with `columns x rows` nodes and sides of `side`, m. The bottom
/// row is bone, and one muscle runs along the middle row.
pub fn lattice(columns: usize, rows: usize, side: f64) -> Mesh<2> {
    let node = |i: usize, j: usize| j * columns + i;
    let mut mesh = Mesh { fixed: (0..columns).collect(), ..Mesh::default() };
    for j in 0..rows {
        for i in 0..columns {
            let x = side * (i as f64 + 0.5 * j as f64);
            mesh.nodes.push(SVector::from([x, side * 0.75f64.sqrt() * j as f64]));
        }
    }
    for j in 1..rows {
        for i in 1..columns {
            mesh.cells.push(&[node(i - 1, j - 1), node(i, j - 1), node(i - 1, j)]);
            mesh.cells.push(&[node(i, j - 1), node(i, j), node(i - 1, j)]);
        }
    }
    let middle = (0..columns).map(|i| node(i, rows / 2)).collect();
    mesh.muscles.push(MuscleChain { name: "row".into(), nodes: middle });
    mesh.connect();
    mesh
}

/// Two struts of span `2 half_span` that meet at an apex `height` above their bones, m, and a muscle of
/// `links` connections that pulls the apex straight down to a bone `depth` below the struts' bones.
///
/// With `links` connections in series the muscle's own spring is `links` times softer than a strut, so that a
/// shallow truss snaps through (von Mises).
pub fn truss(half_span: f64, height: f64, depth: f64, links: usize) -> Mesh<2> {
    let mut nodes = vec![[-half_span, 0.0], [half_span, 0.0], [0.0, -depth], [0.0, height]];
    nodes.extend((1..links).map(|i| [0.0, height - (height + depth) * i as f64 / links as f64]));
    let mut chain = vec![3];
    chain.extend(4..3 + links);
    chain.push(2);
    from_parts(nodes, vec![[0, 3], [1, 3]], chain, vec![0, 1, 2])
}

/// A strut from a bone at the origin to a free head at `length`, braced by two springs to bones `brace` above
/// and below the head. A muscle of `links` connections from the head to a bone `length` behind the strut's
/// foot compresses it along its axis.
pub fn strut(length: f64, brace: f64, links: usize) -> Mesh<2> {
    let mut nodes = vec![[0.0, 0.0], [length, brace], [length, -brace], [-length, 0.0], [length, 0.0]];
    // An odd number of links keeps the muscle's inner nodes off the strut's foot.
    nodes.extend((1..links).map(|i| [length - 2.0 * length * i as f64 / links as f64, 0.0]));
    let mut chain = vec![4];
    chain.extend(5..4 + links);
    chain.push(3);
    from_parts(nodes, vec![[0, 4], [1, 4], [2, 4]], chain, vec![0, 1, 2, 3])
}

fn from_parts(
    nodes: Vec<[f64; 2]>,
    tissue: Vec<[usize; 2]>,
    chain: Vec<usize>,
    fixed: Vec<usize>,
) -> Mesh<2> {
    let mut connections = tissue;
    connections.extend(chain.windows(2).map(|w| pair(w[0], w[1])));
    connections.sort_unstable();
    Mesh {
        nodes: nodes.into_iter().map(SVector::from).collect(),
        cells: Cells::new(),
        connections,
        muscles: vec![MuscleChain { name: "pull".into(), nodes: chain }],
        fixed,
        continuum: None,
        hexahedra: Vec::new(),
    }
}

/// The same body, mirrored in the y axis if `mirrored`, then turned by `angle`, rad, and moved by `shift`, m.
pub fn moved(mesh: &Mesh<2>, angle: f64, mirrored: bool, shift: SVector<f64, 2>) -> Mesh<2> {
    let mut out = mesh.clone();
    out.nodes = mesh.nodes.iter().map(|p| place(p, angle, mirrored, shift)).collect();
    if mirrored {
        out.cells = Cells::new();
        for cell in mesh.cells.iter() {
            let turned: Vec<usize> = cell.iter().rev().copied().collect();
            out.cells.push(&turned);
        }
    }
    out
}

/// The image of a point under [`moved`].
pub fn place(p: &SVector<f64, 2>, angle: f64, mirrored: bool, shift: SVector<f64, 2>) -> SVector<f64, 2> {
    let p = if mirrored { SVector::from([-p.x, p.y]) } else { *p };
    Rotation2::new(angle) * p + shift
}

/// The same body with node `i` renumbered to `name[i]`, its cells in another order, and their nodes rotated.
pub fn renumbered(mesh: &Mesh<2>, name: &[usize]) -> Mesh<2> {
    let mut nodes = mesh.nodes.clone();
    for (i, &n) in name.iter().enumerate() {
        nodes[n] = mesh.nodes[i];
    }
    let mut cells: Vec<Vec<usize>> =
        mesh.cells.iter().map(|c| c.iter().map(|&n| name[n]).collect()).collect();
    cells.iter_mut().enumerate().for_each(|(i, c)| c.rotate_left(i % 3));
    cells.sort_unstable();
    let mut out = Mesh { nodes, ..Mesh::default() };
    cells.iter().for_each(|c| {
        out.cells.push(c);
    });
    out.connections = mesh.connections.iter().map(|&[a, b]| pair(name[a], name[b])).collect();
    out.connections.sort_unstable();
    out.muscles = mesh.muscles.clone();
    out.muscles.iter_mut().flat_map(|m| &mut m.nodes).for_each(|n| *n = name[*n]);
    out.fixed = mesh.fixed.iter().map(|&n| name[n]).collect();
    out.fixed.sort_unstable();
    out
}

/// A pseudo-random permutation of `0..n`, the same on every machine (Fisher-Yates with a linear congruential
/// sequence).
pub fn shuffled(n: usize, seed: u64) -> Vec<usize> {
    let mut state = seed;
    let mut out: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        out.swap(i, (state >> 33) as usize % (i + 1));
    }
    out
}
