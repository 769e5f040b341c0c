//! Small bodies with known properties, shared by the tests.
#![allow(dead_code, reason = "every test binary takes what it needs")]

use std::collections::BTreeSet;

use nalgebra::{DMatrix, SVector};
use tongue_fit::body::{Cells, Mesh, MuscleChain};
use tongue_fit::sparse::{BlockMatrix, Pattern};

/// All edges of the cells, sorted, each once.
pub fn edges<const D: usize>(cells: &Cells<D>) -> Vec<[usize; 2]> {
    let mut set = BTreeSet::new();
    for cell in cells.iter() {
        for (i, &a) in cell.iter().enumerate() {
            for &b in &cell[i + 1..] {
                set.insert([a.min(b), a.max(b)]);
            }
        }
    }
    set.into_iter().collect()
}

/// A parallelogram of equilateral triangles, `columns x rows` nodes, side in m; the bottom row is bone, one muscle runs
/// along the middle row.
pub fn lattice(columns: usize, rows: usize, side: f64) -> Mesh<2> {
    let node = |i: usize, j: usize| j * columns + i;
    let mut nodes = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let x = side * (i as f64 + 0.5 * j as f64);
            nodes.push(SVector::from([x, side * 0.75f64.sqrt() * j as f64]));
        }
    }
    let mut cells = Cells::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            cells.push(&[node(i, j), node(i + 1, j), node(i, j + 1)]);
            cells.push(&[node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)]);
        }
    }
    let connections = edges(&cells);
    let middle = (0..columns).map(|i| node(i, rows / 2)).collect();
    let muscles = vec![MuscleChain { name: "row".into(), nodes: middle }];
    Mesh { nodes, cells, connections, muscles, fixed: (0..columns).collect() }
}

/// A block of `n³` cubes of side `side`, m, six tetrahedra each; the bottom face is bone, one muscle runs along an upper edge.
pub fn block(n: usize, side: f64) -> Mesh<3> {
    let m = n + 1;
    let node = |i: usize, j: usize, k: usize| (k * m + j) * m + i;
    let mut nodes = Vec::new();
    for k in 0..m {
        for j in 0..m {
            for i in 0..m {
                nodes.push(SVector::from([i as f64 * side, j as f64 * side, k as f64 * side]));
            }
        }
    }
    // Kuhn's division: one tetrahedron for each order in which the three axes can be walked.
    let walks = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let mut cells = Cells::new();
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                for (w, walk) in walks.iter().enumerate() {
                    let mut at = [i, j, k];
                    let mut cell = vec![node(at[0], at[1], at[2])];
                    for &axis in walk {
                        at[axis] += 1;
                        cell.push(node(at[0], at[1], at[2]));
                    }
                    if w >= 3 {
                        cell.swap(2, 3);
                    }
                    cells.push(&cell);
                }
            }
        }
    }
    let connections = edges(&cells);
    let edge = (0..m).map(|i| node(i, 0, n)).collect();
    let muscles = vec![MuscleChain { name: "edge".into(), nodes: edge }];
    Mesh { nodes, cells, connections, muscles, fixed: (0..m * m).collect() }
}

/// The same body with every free node moved by a fixed pseudo-random amount of at most `size`, m.
pub fn shaken<const D: usize>(mesh: &Mesh<D>, size: f64) -> Vec<SVector<f64, D>> {
    let mut x = mesh.nodes.clone();
    for (i, p) in x.iter_mut().enumerate().filter(|(i, _)| mesh.fixed.binary_search(i).is_err()) {
        for d in 0..D {
            p[d] += size * ((7 * i + 13 * d) as f64 * 1.7).sin();
        }
    }
    x
}

/// Nodes that no face of a single cell touches: those not on the surface of the body.
pub fn inner_nodes<const D: usize>(mesh: &Mesh<D>) -> Vec<usize> {
    let mut faces = std::collections::BTreeMap::<Vec<usize>, usize>::new();
    for cell in mesh.cells.iter() {
        for left_out in 0..=D {
            let mut face: Vec<usize> = (0..=D).filter(|i| *i != left_out).map(|i| cell[i]).collect();
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
        }
    }
    let surface: BTreeSet<usize> =
        faces.into_iter().filter(|(_, n)| *n == 1).flat_map(|(face, _)| face).collect();
    (0..mesh.nodes.len()).filter(|n| !surface.contains(n)).collect()
}

/// One connection from a bone to a free node, along x: a muscle too. Length in m.
pub fn bar(length: f64) -> Mesh<2> {
    Mesh {
        nodes: vec![SVector::from([0.0, 0.0]), SVector::from([length, 0.0])],
        cells: Cells::new(),
        connections: vec![[0, 1]],
        muscles: vec![MuscleChain { name: "bar".into(), nodes: vec![0, 1] }],
        fixed: vec![0],
    }
}

/// Two connections in a row between two bones, along x; the first is a muscle. Length of each in m.
pub fn two_bars(length: f64) -> Mesh<2> {
    let nodes = (0..3).map(|i| SVector::from([f64::from(i) * length, 0.0])).collect();
    let muscles = vec![MuscleChain { name: "bar".into(), nodes: vec![0, 1] }];
    Mesh { nodes, cells: Cells::new(), connections: vec![[0, 1], [1, 2]], muscles, fixed: vec![0, 2] }
}

/// A sparse matrix written out, column by column; unknowns in the order of the pattern.
pub fn dense<const D: usize>(pattern: &Pattern, k: &BlockMatrix<D>) -> DMatrix<f64> {
    let n = pattern.unknowns();
    let mut out = DMatrix::zeros(n * D, n * D);
    let mut column = vec![SVector::zeros(); n];
    for j in 0..n * D {
        let mut unit = vec![SVector::<f64, D>::zeros(); n];
        unit[j / D][j % D] = 1.0;
        k.multiply(pattern, &unit, &mut column);
        for i in 0..n * D {
            out[(i, j)] = column[i / D][i % D];
        }
    }
    out
}
