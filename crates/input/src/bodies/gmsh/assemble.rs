//! Assembles a body (cells, chains, bones) from the elements of physical groups.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::SVector;

use super::chain::{NoChain, chain};
use super::error::{Found, Located, MshProblem};
use super::parse::{Element, Raw, check_simplex};
use super::{Bent, Content, File, Unit, Unused};
use crate::measured::muscles::Muscles;
use tongue_core::body::{Body, Bone, Mesh, MuscleChain};
use tongue_core::geometry::simplex;

/// Tolerance of the flatness of a body of triangles, as a part of its extent.
const FLAT: f64 = 1e-6;
/// Tolerance of points inside a cell: how far they may lie beyond a side, as a part of the cell.
const INSIDE: f64 = 1e-6;
/// Tolerance of straight sides: how far the middle may lie off the straight line, as a part of the side's
/// length.
const BENT: f64 = 1e-6;

/// Meaning of a physical group.
#[derive(Debug, PartialEq, Eq)]
enum Role {
    Tissue,
    Muscle(String),
    Bone(String),
    Unused,
}

impl Role {
    fn of(name: &str, dimension: usize, known: &Muscles) -> Self {
        let (kind, rest) = match name.split_once(':') {
            Some((kind, rest)) => (kind.trim(), Some(rest.trim()).filter(|r| !r.is_empty())),
            None => (name.trim(), None),
        };
        let is = |word: &str| kind.eq_ignore_ascii_case(word);
        let published = |name: &str| known.published(name).map(|(_, spelling)| spelling.to_owned());
        let muscle = |name: &str| published(name).unwrap_or_else(|| name.to_owned());
        match (dimension, rest) {
            (2 | 3, _) if is("tissue") => Self::Tissue,
            (0..=2, _) if is("bone") => Self::Bone(rest.unwrap_or("bone").to_owned()),
            (1, Some(rest)) if is("muscle") => Self::Muscle(muscle(rest)),
            (1, None) if published(kind).is_some() => Self::Muscle(muscle(kind)),
            _ => Self::Unused,
        }
    }
}

/// A physical group and its elements.
struct Group<'a> {
    dimension: usize,
    tag: i64,
    name: Option<&'a str>,
    /// The byte at which its name begins.
    at: Option<usize>,
    role: Role,
    elements: Vec<&'a Element>,
}

/// The body of a file, in the plane or in space.
pub(super) fn assemble(raw: &Raw, origin: &str, unit: Unit) -> Found<File> {
    let known = Muscles::built_in();
    let mut by_key: BTreeMap<(usize, i64), Vec<&Element>> = BTreeMap::new();
    // Named groups without elements count too, since the user meant them to have some.
    for key in raw.names.keys() {
        by_key.entry(*key).or_default();
    }
    for element in raw.elements.iter().filter(|e| e.group != 0) {
        by_key.entry((element.dimension, element.group)).or_default().push(element);
    }
    let mut groups: Vec<Group<'_>> = by_key
        .into_iter()
        .map(|((dimension, tag), elements)| {
            let named = raw.names.get(&(dimension, tag));
            let name = named.map(|(name, _)| name.as_str());
            let role = match name {
                Some(name) if !elements.is_empty() => Role::of(name, dimension, &known),
                _ => Role::Unused,
            };
            Group { dimension, tag, name, at: named.map(|(_, at)| *at), role, elements }
        })
        .collect();
    let tissue = groups.iter().filter(|g| g.role == Role::Tissue).map(|g| g.dimension).max();
    match tissue {
        Some(3) => {
            // The surface of the tissue may be called tissue too.
            groups.iter_mut().filter(|g| g.role == Role::Tissue && g.dimension == 2).for_each(|g| {
                g.role = Role::Unused;
            });
            Ok(File::Solid(body::<3>(raw, &groups, &known, origin, unit)?))
        }
        Some(_) => Ok(File::Flat(body::<2>(raw, &groups, &known, origin, unit)?)),
        None => {
            let empty = |g: &Group<'_>| if g.elements.is_empty() { " without elements" } else { "" };
            let names: Vec<String> = groups.iter().map(|g| format!("\"{}\"{}", shown(g), empty(g))).collect();
            let found = match names.is_empty() {
                true => "it has no physical groups".to_owned(),
                false => format!("it has {}", names.join(", ")),
            };
            Err(Located::whole(MshProblem::NoTissue { found }))
        }
    }
}

fn shown(group: &Group<'_>) -> String {
    group.name.map_or_else(|| format!("without name, number {}", group.tag), str::to_owned)
}

/// A cell by the tags of its nodes, and its element.
struct TaggedCell<'a> {
    nodes: Vec<u64>,
    element: &'a Element,
}

/// A muscle by the tags of its nodes, and its group.
struct TaggedChain<'a> {
    name: String,
    nodes: Vec<u64>,
    group: &'a Group<'a>,
}

fn body<const D: usize>(
    raw: &Raw,
    groups: &[Group<'_>],
    known: &Muscles,
    origin: &str,
    unit: Unit,
) -> Found<Content<D>> {
    let cells = cells(groups);
    cells.iter().try_for_each(|c| check_simplex(c.element))?;
    let chains = chains(groups, known)?;
    let kept: BTreeSet<u64> =
        cells.iter().map(|c| &c.nodes).chain(chains.iter().map(|c| &c.nodes)).flatten().copied().collect();
    let numbers: BTreeMap<u64, usize> = kept.iter().enumerate().map(|(number, tag)| (*tag, number)).collect();
    // Every tag of a cell or chain is in `numbers`, so the default is never used.
    let number = |tag: &u64| numbers.get(tag).copied().unwrap_or_default();
    let nodes = positions::<D>(raw, &kept, unit)?;

    let mut mesh = Mesh { nodes, ..Mesh::default() };
    for cell in &cells {
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
    let tag = |node: usize| tags.get(node).copied().unwrap_or_default();
    if let Some(&[a, b]) = mesh.connections.iter().find(|[a, b]| mesh.nodes[*a] == mesh.nodes[*b]) {
        return Err(Located::whole(MshProblem::SamePlace { a: tag(a), b: tag(b) }));
    }
    embedded(&mesh, &cells, &chains, tag)?;
    let bones = bones(groups, &numbers)?;
    mesh.fixed =
        bones.iter().flat_map(|b| b.nodes.iter().copied()).collect::<BTreeSet<_>>().into_iter().collect();
    mesh.check().map_err(|fault| match fault {
        tongue_core::body::MeshFault::Degenerate { cell }
        | tongue_core::body::MeshFault::Inverted { cell } => match cells.get(cell) {
            Some(TaggedCell { nodes, element }) => {
                Located::at(element.at, MshProblem::Degenerate { element: element.tag, nodes: nodes.clone() })
            }
            None => Located::whole(fault.into()),
        },
        other => Located::whole(other.into()),
    })?;
    let unused = groups.iter().filter(|g| g.role == Role::Unused);
    let unused = unused
        .map(|g| Unused { dimension: g.dimension, name: shown(g), elements: g.elements.len() })
        .collect();
    let body = Body { what: format!("the mesh of \"{origin}\""), mesh, bones, ..Body::default() };
    let bent = bent(raw, groups, unit);
    Ok(Content { format: raw.format, body, unused, tags, bent })
}

/// The two corners of each side, in Gmsh's order of the middle nodes.
const SIDES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]];

/// The sides of tissue and muscles that are curved in the file.
fn bent(raw: &Raw, groups: &[Group<'_>], unit: Unit) -> Option<Bent> {
    let is_used = |g: &&Group<'_>| matches!(g.role, Role::Tissue | Role::Muscle(_));
    let mut sides: BTreeMap<u64, f64> = BTreeMap::new();
    for element in groups.iter().filter(is_used).flat_map(|g| &g.elements) {
        for (middle, [i, j]) in element.middles.iter().zip(SIDES) {
            let place = |tag: &u64| raw.nodes.get(tag).map(|x| SVector::from(*x));
            let corners = element.nodes.get(i).and_then(place).zip(element.nodes.get(j).and_then(place));
            if let Some(((a, b), x)) = corners.zip(place(middle)) {
                let (way, to) = (b - a, x - a);
                let off = (to - way * (to.dot(&way) / way.norm_squared())).norm();
                if off > BENT * way.norm() {
                    sides.insert(*middle, off * unit.metres());
                }
            }
        }
    }
    let largest_m = sides.values().copied().fold(0.0, f64::max);
    (!sides.is_empty()).then_some(Bent { sides: sides.len(), largest_m })
}

/// The cells in the order of the file; a cell in several groups counts once.
fn cells<'a>(groups: &[Group<'a>]) -> Vec<TaggedCell<'a>> {
    let mut seen = BTreeSet::new();
    let mut cells: Vec<TaggedCell<'a>> = Vec::new();
    for &element in groups.iter().filter(|g| g.role == Role::Tissue).flat_map(|g| &g.elements) {
        let mut key = element.nodes.clone();
        key.sort_unstable();
        if seen.insert(key) {
            cells.push(TaggedCell { nodes: element.nodes.clone(), element });
        }
    }
    cells.sort_by_key(|c| c.element.at);
    cells
}

/// The muscles: those of the published tables in their order, then others in the order of their groups.
fn chains<'a>(groups: &'a [Group<'a>], known: &Muscles) -> Found<Vec<TaggedChain<'a>>> {
    let mut chains: Vec<TaggedChain<'a>> = Vec::new();
    for group in groups {
        let Role::Muscle(name) = &group.role else { continue };
        let name = name.clone();
        let earlier = chains.iter().find(|c| c.name == name && known.published(&name).is_some());
        if let Some(earlier) = earlier {
            let (first, second) = (shown(earlier.group), shown(group));
            return Err(located(group, MshProblem::MuscleTwice { name, first, second }));
        }
        let lines: Vec<[u64; 2]> =
            group.elements.iter().filter_map(|e| <[u64; 2]>::try_from(e.nodes.as_slice()).ok()).collect();
        let nodes = chain(&lines).map_err(|broken| {
            let name = name.clone();
            let problem = match broken {
                NoChain::Branch { node, lines } => MshProblem::Branch { name, node, lines },
                NoChain::Gap { ends } => MshProblem::Gap { name, ends },
                NoChain::Loop { node } => MshProblem::Loop { name, node },
            };
            located(group, problem)
        })?;
        chains.push(TaggedChain { name, nodes, group });
    }
    chains.sort_by_key(|c| known.published(&c.name).map_or(usize::MAX, |(place, _)| place));
    Ok(chains)
}

fn located(group: &Group<'_>, problem: MshProblem) -> Located {
    Located { at: group.at, problem }
}

/// Positions of the nodes `kept`, m.
fn positions<const D: usize>(raw: &Raw, kept: &BTreeSet<u64>, unit: Unit) -> Found<Vec<SVector<f64, D>>> {
    let given = || kept.iter().filter_map(|tag| raw.nodes.get(tag).map(|x| (*tag, x)));
    if D == 2 {
        let extent = given().flat_map(|(_, x)| [x[0].abs(), x[1].abs()]).fold(0.0, f64::max);
        if let Some((node, x)) = given().find(|(_, x)| x[2].abs() > FLAT * extent) {
            return Err(Located::whole(MshProblem::OutOfPlane { node, z: x[2] }));
        }
    }
    Ok(given().map(|(_, x)| SVector::from_iterator(x.iter().map(|c| c * unit.metres()))).collect())
}

/// Checks that every muscle shares nodes with the tissue and that none of its other nodes lies inside a cell.
fn embedded<const D: usize>(
    mesh: &Mesh<D>,
    cells: &[TaggedCell<'_>],
    chains: &[TaggedChain<'_>],
    tag: impl Fn(usize) -> u64,
) -> Found<()> {
    let in_tissue = mesh.in_tissue();
    for (muscle, TaggedChain { name, group, .. }) in mesh.muscles.iter().zip(chains) {
        let outside: Vec<usize> = muscle.nodes.iter().copied().filter(|n| !in_tissue[*n]).collect();
        for &node in &outside {
            let x = mesh.nodes[node];
            let around = mesh.cells.iter().position(|cell| inside(&simplex::corners(&mesh.nodes, cell), &x));
            if let Some(cell) = around.and_then(|c| cells.get(c)) {
                let (node, element) = (tag(node), cell.element.tag);
                return Err(located(group, MshProblem::NotEmbedded { name: name.clone(), node, element }));
            }
        }
        if outside.len() == muscle.nodes.len() {
            return Err(located(group, MshProblem::Apart { name: name.clone() }));
        }
    }
    Ok(())
}

/// Whether a point lies in a cell or on its side: the cell is not inverted if any one corner is moved to the
/// point.
fn inside<const D: usize>(corners: &[SVector<f64, D>; 4], x: &SVector<f64, D>) -> bool {
    let least = -INSIDE * simplex::measure(corners);
    (0..=D).all(|moved| {
        let mut with = *corners;
        with[moved] = *x;
        simplex::measure(&with) > least
    })
}

/// The bones in the order of their groups; groups of one name are one bone.
fn bones(groups: &[Group<'_>], numbers: &BTreeMap<u64, usize>) -> Found<Vec<Bone>> {
    let mut bones: Vec<(String, BTreeSet<usize>)> = Vec::new();
    for group in groups {
        let Role::Bone(name) = &group.role else { continue };
        let mut nodes = BTreeSet::new();
        for node in group.elements.iter().flat_map(|e| &e.nodes) {
            match numbers.get(node) {
                Some(&number) => nodes.insert(number),
                None => {
                    let problem = MshProblem::BoneHoldsNothing { name: name.clone(), node: *node };
                    return Err(located(group, problem));
                }
            };
        }
        match bones.iter_mut().find(|(n, _)| n == name) {
            Some((_, of)) => of.extend(nodes),
            None => bones.push((name.clone(), nodes)),
        }
    }
    Ok(bones.into_iter().map(|(name, nodes)| Bone { name, nodes: nodes.into_iter().collect() }).collect())
}
