use std::fmt::Write as _;

use nalgebra::SVector;

use crate::measured::muscles::Muscles;
use tongue_core::body::{Bone, Mesh};

/// Writes a mesh at rest, m, with the physical groups of [`super::read`]; fixed nodes outside `bones` are in a group `bone`. Node `n` has
/// the tag `n + 1`. Elements are numbered from 1: cells (quadratic elements of a continuum), then the lines of one muscle after another,
/// then the points on bone. Reading the file gives the same mesh to the last bit if every node is used and published muscles come first, in
/// the order of the tables.
pub fn write<const D: usize>(mesh: &Mesh<D>, bones: &[Bone]) -> String {
    let mut out = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    let names: Vec<String> = mesh.muscles.iter().map(|m| group_name(&m.name)).collect();
    let nameless =
        mesh.fixed.iter().filter(|n| !bones.iter().any(|b| b.nodes.contains(n))).copied().collect();
    let nameless = Bone { name: "bone".to_owned(), nodes: nameless };
    let bones: Vec<&Bone> = bones.iter().chain([&nameless]).filter(|b| !b.nodes.is_empty()).collect();
    let _ = writeln!(out, "$PhysicalNames\n{}", bones.len() + names.len() + 1);
    for (nth, bone) in bones.iter().enumerate() {
        let of = if bone.name == "bone" { String::new() } else { format!(":{}", without_quotes(&bone.name)) };
        let _ = writeln!(out, "0 {} \"bone{of}\"", nth + 1);
    }
    for (nth, name) in names.iter().enumerate() {
        let _ = writeln!(out, "1 {} \"{name}\"", nth + 1);
    }
    let _ = writeln!(out, "{D} 1 \"tissue\"\n$EndPhysicalNames");
    entities(&mut out, mesh, &bones);

    let count = mesh.nodes.len();
    let _ = writeln!(out, "$Nodes\n1 {count} 1 {count}\n{D} 1 0 {count}");
    for tag in 1..=count {
        let _ = writeln!(out, "{tag}");
    }
    for x in &mesh.nodes {
        let _ = writeln!(out, "{}", point(x));
    }
    out += "$EndNodes\n";
    elements(&mut out, mesh);
    out
}

/// One entity for each group of cells or lines, and one point for each fixed node.
fn entities<const D: usize>(out: &mut String, mesh: &Mesh<D>, bones: &[&Bone]) {
    let (surfaces, volumes) = if D == 2 { (1, 0) } else { (0, 1) };
    let _ = writeln!(out, "$Entities\n{} {} {surfaces} {volumes}", mesh.fixed.len(), mesh.muscles.len());
    for (nth, &node) in mesh.fixed.iter().enumerate() {
        let x = mesh.nodes.get(node).map(point).unwrap_or_default();
        let on = (1..).zip(bones).filter(|(_, b)| b.nodes.contains(&node));
        let groups: Vec<String> = on.map(|(tag, _)| tag.to_string()).collect();
        let _ = writeln!(out, "{} {x} {} {}", nth + 1, groups.len(), groups.join(" "));
    }
    for (nth, muscle) in mesh.muscles.iter().enumerate() {
        let nodes = muscle.nodes.iter().filter_map(|&n| mesh.nodes.get(n));
        let _ = writeln!(out, "{tag} {} 1 {tag} 0", bounds(nodes), tag = nth + 1);
    }
    let _ = writeln!(out, "1 {} 1 1 0\n$EndEntities", bounds(mesh.nodes.iter()));
}

fn elements<const D: usize>(out: &mut String, mesh: &Mesh<D>) {
    let all_lines: usize = mesh.muscles.iter().map(|m| m.nodes.len().saturating_sub(1)).sum();
    let cells: Vec<&[usize]> = mesh.elements().collect();
    let total = cells.len() + all_lines + mesh.fixed.len();
    let blocks = 1 + mesh.muscles.len() + mesh.fixed.len();
    let _ = writeln!(out, "$Elements\n{blocks} {total} 1 {total}");
    let kind = if mesh.continuum.is_some() { [9, 11][D - 2] } else { [2, 4][D - 2] };
    let _ = writeln!(out, "{D} 1 {kind} {}", cells.len());
    let mut tag = 0;
    let mut element = |out: &mut String, nodes: &[usize]| {
        tag += 1;
        let nodes: String = nodes.iter().map(|n| format!(" {}", n + 1)).collect();
        let _ = writeln!(out, "{tag}{nodes}");
    };
    for cell in cells {
        let mut nodes = cell.to_vec();
        if kind == 11 {
            // In Gmsh's order the middle of side 2-3 comes before that of side 1-3.
            nodes.swap(8, 9);
        }
        element(out, &nodes);
    }
    for (nth, muscle) in mesh.muscles.iter().enumerate() {
        let _ = writeln!(out, "1 {} 1 {}", nth + 1, muscle.nodes.len().saturating_sub(1));
        muscle.nodes.windows(2).for_each(|pair| element(out, pair));
    }
    for (nth, &node) in mesh.fixed.iter().enumerate() {
        let _ = writeln!(out, "0 {} 15 1", nth + 1);
        element(out, &[node]);
    }
    *out += "$EndElements\n";
}

fn point<const D: usize>(x: &SVector<f64, D>) -> String {
    format!("{} {} {}", x[0], x[1], x.get(2).unwrap_or(&0.0))
}

fn bounds<'a, const D: usize>(nodes: impl Iterator<Item = &'a SVector<f64, D>> + Clone) -> String {
    let low = nodes.clone().copied().reduce(|low, x| low.inf(&x)).unwrap_or(SVector::zeros());
    let high = nodes.copied().reduce(|high, x| high.sup(&x)).unwrap_or(SVector::zeros());
    format!("{} {}", point(&low), point(&high))
}

/// A name with `_` in place of quotes and control characters, which Gmsh cannot read.
fn without_quotes(name: &str) -> String {
    name.chars().map(|c| if c == '"' || c.is_control() { '_' } else { c }).collect()
}

fn group_name(muscle: &str) -> String {
    let name = without_quotes(muscle);
    match Muscles::built_in().published(&name) {
        Some((_, spelling)) => spelling.to_owned(),
        None => format!("muscle:{name}"),
    }
}
