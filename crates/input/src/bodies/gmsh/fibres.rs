//! Curves, which Gmsh stores as lines of two nodes in any order and direction, joined to chains; and fibres of a muscle among hexahedra, from
//! curves whose nodes need not be nodes of the mesh, or from views of vectors (`$ElementData`, `$NodeData`).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::cursor::{Cursor, Parsed, wrong};
use tongue_core::body::Mesh;
use tongue_core::body::space::{Directions, directions_along};
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
        let on_nodes = on_nodes.map(|s| s.map(|n| mesh.nodes[n]));
        let lines: Vec<[Vector3<f64>; 2]> = on_nodes.chain(self.guides.iter().copied()).collect();
        let corners = region.iter().map(|&e| hexahedron::corners(&mesh.nodes, &mesh.hexahedra[e]));
        corners.map(|x| directions_along(&lines, &x)).collect()
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
        let vector = cursor.reals("a component of a vector")?;
        let tag =
            u64::try_from(tag).map_err(|_| wrong!(at, "entry {tag} is out of range; save the file again"))?;
        vectors.insert(tag, vector);
    }
    cursor.end(section)?;
    Ok(Some(FibreView { name, of_nodes: section == "NodeData", vectors, at }))
}

/// The neighbours of each node; a line from a node to itself is left out.
fn neighbours(lines: &[[u64; 2]]) -> BTreeMap<u64, BTreeSet<u64>> {
    let mut meeting: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for &[a, b] in lines.iter().filter(|[a, b]| a != b) {
        meeting.entry(a).or_default().insert(b);
        meeting.entry(b).or_default().insert(a);
    }
    meeting
}

/// Joins lines to runs, which end at nodes of the mesh and where one line or more than two meet.
fn runs(lines: &[[u64; 2]], is_of_mesh: impl Fn(&u64) -> bool) -> Vec<Vec<u64>> {
    let meeting = neighbours(lines);
    let is_stop = |tag: &u64| is_of_mesh(tag) || meeting[tag].len() != 2;
    let mut seen: BTreeSet<[u64; 2]> = BTreeSet::new();
    let mut runs = Vec::new();
    let (stops, others): (Vec<u64>, Vec<u64>) = meeting.keys().copied().partition(&is_stop);
    // The lines that are on no run from a stop form circles, which may begin at any node.
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

/// The nodes of a muscle from one end to the other. The chain begins at the end where a line starts; if that is none or both of them, at
/// the end with the lower tag. The error is the rest of a sentence that begins with the name of the muscle.
pub(super) fn chain(lines: &[[u64; 2]]) -> Result<Vec<u64>, String> {
    let help = "a muscle is one chain with two ends: leave out one curve";
    let in_circle = |node: u64| Err(format!("runs in a circle through node {node}; {help}"));
    if let Some([node, _]) = lines.iter().find(|[a, b]| a == b) {
        return in_circle(*node);
    }
    let meeting = neighbours(lines);
    if let Some((node, of)) = meeting.iter().find(|(_, of)| of.len() > 2) {
        let count = of.len();
        return Err(format!(
            "branches at node {node}, where {count} of its lines meet; a muscle is one chain: leave out the curves that branch off"
        ));
    }
    let ends: Vec<u64> = meeting.iter().filter(|(_, of)| of.len() == 1).map(|(n, _)| *n).collect();
    let mut runs = runs(lines, |_| false).into_iter();
    let (mut chain, second) = match (runs.next(), &ends[..]) {
        (Some(chain), [_, second]) => (chain, *second),
        (_, []) => return in_circle(meeting.keys().next().copied().unwrap_or_default()),
        _ => {
            return Err(format!(
                "has gaps: it ends at the nodes {ends:?}; a muscle is one chain with two ends: add the curves between, or make two groups"
            ));
        }
    };
    if lines.iter().any(|[a, _]| *a == second) && !lines.iter().any(|[a, _]| *a == chain[0]) {
        chain.reverse();
    }
    match runs.flatten().min() {
        Some(node) => in_circle(node),
        None => Ok(chain),
    }
}

pub(super) fn connected_components<T: Copy + Ord>(lines: &[[T; 2]]) -> Vec<Vec<[T; 2]>> {
    let mut components: Vec<(BTreeSet<T>, Vec<[T; 2]>)> = Vec::new();
    for &line in lines {
        let (joined, apart): (Vec<_>, Vec<_>) =
            components.into_iter().partition(|(nodes, _)| line.iter().any(|n| nodes.contains(n)));
        let mut component = (BTreeSet::from(line), vec![line]);
        for (nodes, lines) in joined {
            component.0.extend(nodes);
            component.1.extend(lines);
        }
        components = apart;
        components.push(component);
    }
    components.into_iter().map(|(_, lines)| lines).collect()
}
