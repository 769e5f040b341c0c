//! Fibres of a muscle among hexahedra, from curves whose nodes need not be nodes of the mesh, or from views of vectors (`$ElementData`,
//! `$NodeData`).

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::chain::runs;
use super::cursor::{Cursor, Parsed, wrong};
use tongue_core::body::Mesh;
use tongue_core::body::space::{Directions, Segment, direction_at};
use tongue_core::geometry::{hexahedron, simplex};

/// How far a node of a curve may lie outside the tissue, as a part of an element: surfaces that are curved in the model are flat in the
/// mesh.
const MOST_OUTSIDE: f64 = 0.02;
const TETRAHEDRA_OF_HEXAHEDRON: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];

pub(super) struct MeshFibres {
    /// Pairs of nodes of the mesh.
    pub segments: Vec<[usize; 2]>,
    /// Lines inside the tissue that only give directions, m.
    pub guides: Vec<[Vector3<f64>; 2]>,
    pub length_m: f64,
}

impl MeshFibres {
    /// Makes fibres of lines, which are pairs of tags. Runs whose inner nodes are not of the mesh give directions where they are inside the
    /// tissue; outside of it a run becomes one straight segment. The error is the first node outside the tissue of a run that leaves it
    /// elsewhere than at a node of the mesh, or that does not end on bone.
    pub fn lay(
        mesh: &Mesh<3>,
        numbers: &BTreeMap<u64, usize>,
        lines: &[[u64; 2]],
        place: impl Fn(&u64) -> Option<Vector3<f64>>,
    ) -> Result<Self, u64> {
        let at = |tag: &u64| place(tag).unwrap_or_default();
        let length_m = lines.iter().map(|[a, b]| (at(b) - at(a)).norm()).sum();
        let number = |tag: &u64| numbers.get(tag).copied();
        let mut fibres = Self { segments: Vec::new(), guides: Vec::new(), length_m };
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

    /// Directions at the Gauss points of each element of a region; empty where they follow from the segments.
    pub fn directions(&self, mesh: &Mesh<3>, region: &[usize]) -> Vec<Directions> {
        if self.guides.is_empty() {
            return Vec::new();
        }
        let inside = mesh.in_tissue();
        let on_nodes = self.segments.iter().filter(|s| s.iter().all(|&n| inside[n]));
        let lines: Vec<[Vector3<f64>; 2]> =
            on_nodes.map(|s| s.map(|n| mesh.nodes[n])).chain(self.guides.iter().copied()).collect();
        let nodes: Vec<Vector3<f64>> = lines.iter().flatten().copied().collect();
        let segments: Vec<Segment> = (0..lines.len())
            .map(|i| Segment { nodes: [2 * i, 2 * i + 1], force_n: 0.0, outside: false })
            .collect();
        Vec::from_iter(region.iter().map(|&element| {
            let x = hexahedron::corners(&mesh.nodes, &mesh.hexahedra[element]);
            hexahedron::points().map(|at| {
                let place = x.iter().zip(hexahedron::values(at)).map(|(x, n)| x * n).sum();
                direction_at(&nodes, &segments, &place)
            })
        }))
    }
}

fn is_inside(mesh: &Mesh<3>, place: &Vector3<f64>) -> bool {
    mesh.hexahedra.iter().any(|corners| {
        let x = corners.map(|n| mesh.nodes[n]);
        let (low, high) = x.iter().fold((x[0], x[0]), |(low, high), p| (low.inf(p), high.sup(p)));
        let room = (high - low) * MOST_OUTSIDE;
        let in_box = (0..3).all(|d| (low[d] - room[d]..=high[d] + room[d]).contains(&place[d]));
        in_box
            && TETRAHEDRA_OF_HEXAHEDRON.iter().any(|t| {
                simplex::barycentric::<3>(&t.map(|i| x[i]), place).iter().all(|share| *share >= -MOST_OUTSIDE)
            })
    })
}

pub(super) struct FibreView {
    pub name: String,
    /// Whether vectors belong to nodes rather than to elements.
    pub of_nodes: bool,
    pub vectors: BTreeMap<u64, [f64; 3]>,
    pub at: usize,
}

/// Reads a view of vectors; `None` for one whose values do not have three components.
pub(super) fn view(cursor: &mut Cursor<'_>, section: &'static str, at: usize) -> Parsed<Option<FibreView>> {
    let mut name = String::new();
    for nth in 0..cursor.count_in_text("the number of names of a view")? {
        let line = cursor.line("the name of a view")?.trim();
        if nth == 0 {
            line.trim_matches('"').clone_into(&mut name);
        }
    }
    for _ in 0..cursor.count_in_text("the number of times of a view")? {
        cursor.line("the time of a view")?;
    }
    // These are the step, the number of components, the number of entries, and a partition.
    let count = cursor.count_in_text("the number of whole numbers of a view")?;
    let integers =
        (0..count).map(|_| cursor.count_in_text("a whole number of a view")).collect::<Parsed<Vec<_>>>()?;
    let (components, entries) =
        (integers.get(1).copied().unwrap_or(0), integers.get(2).copied().unwrap_or(0));
    if components != 3 {
        cursor.skip(section)?;
        return Ok(None);
    }
    let mut vectors = BTreeMap::new();
    for _ in 0..entries {
        let at = cursor.position();
        let tag = cursor.int("a node or element of a view")?;
        let mut vector = [0.0; 3];
        for c in &mut vector {
            *c = cursor.real("a component of a vector")?;
        }
        let tag =
            u64::try_from(tag).map_err(|_| wrong!(at, "entry {tag} is out of range; save the file again"))?;
        vectors.insert(tag, vector);
    }
    cursor.end(section)?;
    Ok(Some(FibreView { name, of_nodes: section == "NodeData", vectors, at }))
}
