//! Assembles a body of triangles or tetrahedra, whose muscles are chains on curves.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::SVector;

use super::cursor::{Located, Parsed, wrong};
use super::fibres::chain;
use super::groups::{GroupParts, GroupRole, PhysicalGroup, positions};
use super::parse::{Form, Raw};
use super::review::review;
use super::{AnyBody, Content, Unit};
use crate::measured::muscles::Muscles;
use tongue_core::body::{Body, Mesh, MeshFault, MuscleChain};
use tongue_core::geometry::simplex;

/// How far a point may lie outside a cell and still count as inside: a difference of barycentric coordinates.
const MOST_OUTSIDE: f64 = 1e-6;
/// How far the middle node of a straight side may lie off the line of its ends, over the length of the side.
const MOST_BENT: f64 = 1e-6;

pub(super) fn assemble(raw: &Raw, origin: &str, unit: Unit) -> Parsed<Content> {
    let parts = GroupParts::new(raw, Form::Simplices)?;
    match parts.dimension {
        3 => body(raw, &parts, origin, unit, AnyBody::Solid),
        _ => body(raw, &parts, origin, unit, AnyBody::Flat),
    }
}

struct TaggedChain<'a> {
    name: String,
    nodes: Vec<u64>,
    group: &'a PhysicalGroup<'a>,
}

fn body<const D: usize>(
    raw: &Raw,
    parts: &GroupParts<'_>,
    origin: &str,
    unit: Unit,
    any: fn(Body<D>) -> AnyBody,
) -> Parsed<Content> {
    let cells = &parts.cells;
    let chains = chains(&parts.groups)?;
    let kept: BTreeSet<u64> =
        cells.iter().map(|c| &c.nodes).chain(chains.iter().map(|c| &c.nodes)).flatten().copied().collect();
    let numbers: BTreeMap<u64, usize> = kept.iter().enumerate().map(|(number, tag)| (*tag, number)).collect();
    // Every tag of a cell or chain is in `numbers`, so this cannot panic.
    let number = |tag: &u64| numbers[tag];
    let mut mesh = Mesh { nodes: positions::<D>(raw, &kept, unit)?, ..Mesh::default() };
    for cell in cells {
        let mut corners: Vec<usize> = cell.nodes.iter().map(number).collect();
        if simplex::measure(&simplex::corners::<D>(&mesh.nodes, &corners)) < 0.0 {
            corners.swap(D - 1, D);
        }
        mesh.cells.push(&corners);
    }
    for TaggedChain { name, nodes, .. } in &chains {
        mesh.muscles.push(MuscleChain { name: name.clone(), nodes: nodes.iter().map(number).collect() });
    }
    mesh.connect();
    let tags: Vec<u64> = kept.into_iter().collect();
    let tag = |node: usize| tags[node];
    if let Some(pair) = mesh.connections.iter().find(|[a, b]| mesh.nodes[*a] == mesh.nodes[*b]) {
        let [a, b] = pair.map(tag);
        return Err(wrong!(
            None,
            "nodes {a} and {b} lie at the same place but are joined; merge them (gmsh: Coherence Mesh) and mesh again"
        ));
    }
    embedded(&mesh, parts, &chains, tag)?;
    let (bones, fixed) = parts.bones(&numbers)?;
    mesh.fixed = fixed;
    mesh.check().map_err(|fault| match fault {
        MeshFault::Degenerate { cell } | MeshFault::Inverted { cell } if cell < cells.len() => wrong!(
            cells[cell].at,
            "element {} (nodes {:?}) has no area or volume; mesh again, or move the nodes apart",
            cells[cell].tag,
            cells[cell].nodes
        ),
        other => wrong!(None, "{other}"),
    })?;
    parts.check_held(mesh.connections.iter().copied(), &mesh.fixed, &numbers)?;
    let concerns = review(&mesh).into_iter().chain(curved_sides(raw, parts, unit)).collect();
    let body = Body { what: format!("the mesh of \"{origin}\""), mesh, bones, ..Body::default() };
    Ok(Content { body: any(body), tags, concerns })
}

/// The two corners of each side, in Gmsh's order of the middle nodes.
const SIDES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]];

/// The concern that sides of tissue or muscles are curved in the file, if any is.
fn curved_sides(raw: &Raw, parts: &GroupParts<'_>, unit: Unit) -> Option<String> {
    let of_muscles =
        parts.groups.iter().filter(|g| matches!(g.role, GroupRole::Muscle(_))).flat_map(|g| &g.elements);
    let mut sides: BTreeMap<u64, f64> = BTreeMap::new();
    for element in parts.cells.iter().chain(of_muscles) {
        for (middle, [i, j]) in element.middles.iter().zip(SIDES) {
            let place = |tag: &u64| raw.nodes.get(tag).map(|x| SVector::from(*x));
            let corners = element.nodes.get(i).and_then(place).zip(element.nodes.get(j).and_then(place));
            if let Some(((a, b), x)) = corners.zip(place(middle)) {
                let (way, to) = (b - a, x - a);
                let off = (to - way * (to.dot(&way) / way.norm_squared())).norm();
                if off > MOST_BENT * way.norm() {
                    sides.insert(*middle, off * unit.metres());
                }
            }
        }
    }
    let (count, mm) = (sides.len(), 1e3 * sides.into_values().fold(0.0, f64::max));
    (count > 0).then(|| {
        format!(
            "sides that are curved in the file are taken as straight ({count} of them, by up to {mm:.2} mm): mesh finer where that is too much"
        )
    })
}

/// The muscles of the published tables in the order of these, then others in the order of their groups.
fn chains<'a>(groups: &'a [PhysicalGroup<'a>]) -> Parsed<Vec<TaggedChain<'a>>> {
    let known = Muscles::built_in();
    let mut chains: Vec<TaggedChain<'a>> = Vec::new();
    for group in groups {
        let GroupRole::Muscle(name) = &group.role else { continue };
        let is_published = known.published(name).is_some();
        if let Some(earlier) = chains.iter().find(|c| c.name == *name && is_published) {
            return Err(given_twice(name, earlier.group.name, group.name, group.at));
        }
        let nodes = chain(&group.lines()).map_err(|broken| wrong!(group.at, "muscle {name} {broken}"))?;
        chains.push(TaggedChain { name: name.clone(), nodes, group });
    }
    chains.sort_by_key(|c| known.published(&c.name).map_or(usize::MAX, |(place, _)| place));
    Ok(chains)
}

pub(super) fn given_twice(muscle: &str, first: &str, second: &str, at: usize) -> Located {
    wrong!(
        at,
        "muscle {muscle} is given twice, as \"{first}\" and as \"{second}\"; join them to one physical curve"
    )
}

/// Checks that every muscle shares nodes with the tissue and that none of its other nodes lies inside a cell.
fn embedded<const D: usize>(
    mesh: &Mesh<D>,
    parts: &GroupParts<'_>,
    chains: &[TaggedChain<'_>],
    tag: impl Fn(usize) -> u64,
) -> Parsed<()> {
    let help =
        "embed its curve in the surface (Curve {...} In Surface {...}) or fragment both, and mesh again";
    let in_tissue = mesh.in_tissue();
    for (muscle, TaggedChain { name, group, .. }) in mesh.muscles.iter().zip(chains) {
        let outside: Vec<usize> = muscle.nodes.iter().copied().filter(|n| !in_tissue[*n]).collect();
        for &node in &outside {
            let around = mesh.cells.iter().position(|cell| {
                let corners = simplex::corners::<D>(&mesh.nodes, cell);
                let parts = simplex::barycentric(&corners, &mesh.nodes[node]);
                parts[..=D].iter().all(|part| *part > -MOST_OUTSIDE)
            });
            if let Some(element) = around.and_then(|c| parts.cells.get(c)) {
                return Err(wrong!(
                    group.at,
                    "node {} of muscle {name} lies in element {} without being one of its nodes, so the muscle would slide through the \
                     tissue; {help}",
                    tag(node),
                    element.tag
                ));
            }
        }
        if outside.len() == muscle.nodes.len() {
            return Err(wrong!(
                group.at,
                "muscle {name} shares no node with the tissue, so it would pull on nothing; {help}"
            ));
        }
    }
    Ok(())
}
