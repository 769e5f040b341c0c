//! Fibres of a muscle among hexahedra, from curves whose nodes need not be nodes of the mesh.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use tongue_core::body::Mesh;
use tongue_core::body::space::{Directions, Segment, direction_at};
use tongue_core::geometry::{hexahedron, simplex};

/// How far a node of a curve may lie outside an element that holds it, as a part of the element: surfaces that
/// are curved in the model are flat in the mesh.
const INSIDE: f64 = 0.02;
/// Six tetrahedra that fill a hexahedron.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];

pub(super) struct Fibres {
    /// Parts between two nodes of the mesh.
    pub segments: Vec<[usize; 2]>,
    /// Lines inside the tissue that give directions only, m.
    pub guides: Vec<[Vector3<f64>; 2]>,
    /// Length of all lines, m.
    pub length: f64,
}

impl Fibres {
    /// Lays lines between nodes with these tags. Runs of lines whose inner nodes are no nodes of the mesh give
    /// directions where they are inside the tissue; outside of it a run is one straight part.
    ///
    /// # Errors
    /// The first node of a run that leaves the tissue without a node of the mesh, or ends outside of it on no bone.
    pub fn lay(
        mesh: &Mesh<3>,
        numbers: &BTreeMap<u64, usize>,
        lines: &[[u64; 2]],
        place: impl Fn(&u64) -> Option<Vector3<f64>>,
    ) -> Result<Self, u64> {
        let at = |tag: &u64| place(tag).unwrap_or_default();
        let length = lines.iter().map(|[a, b]| (at(b) - at(a)).norm()).sum();
        let number = |tag: &u64| numbers.get(tag).copied();
        let mut fibres = Self { segments: Vec::new(), guides: Vec::new(), length };
        let of_mesh = |[a, b]: &[u64; 2]| Some([number(a)?, number(b)?]);
        if let Some(segments) = lines.iter().map(of_mesh).collect::<Option<Vec<_>>>() {
            return Ok(Self { segments, ..fibres });
        }
        for run in runs(lines, |tag| number(tag).is_some()) {
            let free: Vec<u64> = run.iter().copied().filter(|tag| number(tag).is_none()).collect();
            let outside = free.iter().find(|tag| !is_inside(mesh, &at(tag)));
            let ends = of_mesh(&[run[0], run[run.len() - 1]]);
            match (ends, outside) {
                (Some(ends), _) if free.is_empty() => fibres.segments.push(ends),
                (_, None) => fibres.guides.extend(run.windows(2).map(|l| [at(&l[0]), at(&l[1])])),
                (Some(ends), Some(_)) if free.iter().all(|tag| !is_inside(mesh, &at(tag))) => {
                    fibres.segments.push(ends);
                }
                (_, Some(node)) => return Err(*node),
            }
        }
        Ok(fibres)
    }

    /// Directions at the points of Gauss of each element of a region; none where they follow from the segments.
    pub fn directions(&self, mesh: &Mesh<3>, region: &[usize]) -> Vec<Directions> {
        if self.guides.is_empty() {
            return Vec::new();
        }
        let inside = mesh.in_tissue();
        let on_nodes = self.segments.iter().filter(|s| s.iter().all(|&n| inside[n]));
        let lines: Vec<[Vector3<f64>; 2]> =
            on_nodes.map(|s| s.map(|n| mesh.nodes[n])).chain(self.guides.iter().copied()).collect();
        let nodes: Vec<Vector3<f64>> = lines.iter().flatten().copied().collect();
        let segment = |i: usize| Segment { nodes: [2 * i, 2 * i + 1], force_n: 0.0, outside: false };
        let segments: Vec<Segment> = (0..lines.len()).map(segment).collect();
        let of_element = |&element: &usize| {
            let x = hexahedron::corners(&mesh.nodes, &mesh.hexahedra[element]);
            hexahedron::points().map(|at| {
                let place = x.iter().zip(hexahedron::values(at)).map(|(x, n)| x * n).sum();
                direction_at(&nodes, &segments, &place)
            })
        };
        region.iter().map(of_element).collect()
    }
}

/// Lines joined to runs between nodes of the mesh, ends, and nodes where other than two lines meet.
fn runs(lines: &[[u64; 2]], is_of_mesh: impl Fn(&u64) -> bool) -> Vec<Vec<u64>> {
    let mut meeting: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for &[a, b] in lines.iter().filter(|[a, b]| a != b) {
        meeting.entry(a).or_default().insert(b);
        meeting.entry(b).or_default().insert(a);
    }
    let is_stop = |tag: &u64| is_of_mesh(tag) || meeting[tag].len() != 2;
    let mut seen: BTreeSet<[u64; 2]> = BTreeSet::new();
    let mut runs = Vec::new();
    let (stops, others): (Vec<u64>, Vec<u64>) = meeting.keys().copied().partition(&is_stop);
    // What is left after the runs from stops are circles, which begin anywhere.
    for start in stops.into_iter().chain(others) {
        for &next in &meeting[&start] {
            let mut run = vec![start];
            let (mut from, mut to) = (start, next);
            while seen.insert([from.min(to), from.max(to)]) {
                run.push(to);
                let on = meeting[&to].iter().copied().find(|n| *n != from);
                match on.filter(|_| !is_stop(&to)) {
                    Some(on) => (from, to) = (to, on),
                    None => break,
                }
            }
            if run.len() > 1 {
                runs.push(run);
            }
        }
    }
    runs
}

/// Whether a place lies in an element.
fn is_inside(mesh: &Mesh<3>, place: &Vector3<f64>) -> bool {
    mesh.hexahedra.iter().any(|corners| {
        let x = corners.map(|n| mesh.nodes[n]);
        let (low, high) = x.iter().fold((x[0], x[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        let room = (high - low) * INSIDE;
        let in_box = (0..3).all(|d| (low[d] - room[d]..=high[d] + room[d]).contains(&place[d]));
        in_box
            && TETRAHEDRA.iter().any(|t| {
                simplex::barycentric::<3>(&t.map(|i| x[i]), place).iter().all(|share| *share >= -INSIDE)
            })
    })
}

/// The lines of each connected fibre.
pub(super) fn parts<T: Copy + Ord>(lines: &[[T; 2]]) -> Vec<Vec<[T; 2]>> {
    let mut parts: Vec<(BTreeSet<T>, Vec<[T; 2]>)> = Vec::new();
    for &line in lines {
        let (joined, apart): (Vec<_>, Vec<_>) =
            parts.into_iter().partition(|(nodes, _)| line.iter().any(|n| nodes.contains(n)));
        let mut part = (BTreeSet::from(line), vec![line]);
        for (nodes, lines) in joined {
            part.0.extend(nodes);
            part.1.extend(lines);
        }
        parts = apart;
        parts.push(part);
    }
    parts.into_iter().map(|(_, lines)| lines).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_in_any_order_are_runs_between_nodes_of_the_mesh() {
        let mut found = runs(&[[3, 2], [1, 2], [3, 9], [9, 7], [7, 8]], |tag| [1, 9].contains(tag));
        found.sort();
        assert_eq!(found, [vec![1, 2, 3, 9], vec![8, 7, 9]]);
        assert_eq!(runs(&[[1, 2], [2, 3], [3, 1]], |_| false), [vec![1, 2, 3, 1]]);
    }
}
