//! Bodies in space of hexahedra from Gmsh: muscles are overlapping groups of volumes, with directions from views or curves.
//!
//! The physical groups are listed in `docs/space.md`. A view `fibre:NAME` of vectors on elements or nodes gives the directions of a muscle;
//! without it they follow from its curves, whose nodes need not be nodes of the mesh. Outside the tissue a curve runs from a node of the
//! tissue to one on bone and is taken as straight. A name that ends in `_L` or `_R` is one side (y below or above zero) of a muscle that
//! must have the other side, too. Axes: x to the back, y to the right, z upwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::Unit;
use super::assemble::given_twice;
use super::cursor::{Parsed, wrong};
use super::fibres::{FibreView, MeshFibres, connected_components};
use super::groups::{GroupParts, GroupRole, positions, sorted};
use super::parse::{Form, Raw};
use crate::bodies::group_and_side;
use tongue_core::body::space::{Directions, Segment, Side, mean_axis};
use tongue_core::body::{Body, Mesh, Muscle, MuscleChain};
use tongue_core::geometry::hexahedron;

/// A body beyond this has another unit than it was said to have.
const EXTENT_MM: std::ops::RangeInclusive<f64> = 5.0..=1000.0;

#[derive(Clone, Copy)]
enum Strength {
    Newtons(f64),
    Pascals(f64),
}

struct MuscleGroup<'a> {
    name: String,
    strength: Strength,
    region: BTreeSet<Vec<u64>>,
    lines: Vec<[u64; 2]>,
    view: Option<&'a FibreView>,
    at: usize,
}

struct SpaceAssembly<'a> {
    raw: &'a Raw,
    unit: Unit,
    parts: GroupParts<'a>,
    numbers: BTreeMap<u64, usize>,
    mesh: Mesh<3>,
}

pub(super) fn assemble(raw: &Raw, origin: &str, unit: Unit) -> Parsed<Body<3>> {
    let parts = GroupParts::new(raw, Form::Hexahedra)?;
    let mut kept: BTreeSet<u64> = parts.cells.iter().flat_map(|e| &e.nodes).copied().collect();
    let of = |is: fn(&GroupRole) -> bool| {
        let groups = parts.groups.iter().filter(move |g| is(&g.role));
        groups.flat_map(|g| &g.elements).flat_map(|e| &e.nodes).copied().collect::<BTreeSet<u64>>()
    };
    // Outside the tissue, fibres end on bone, so these nodes of bone are nodes of the mesh.
    let on_bone = of(|role| matches!(role, GroupRole::Bone(_)));
    kept.extend(of(|role| matches!(role, GroupRole::Fibre(_))).intersection(&on_bone));
    let numbers: BTreeMap<u64, usize> = kept.iter().enumerate().map(|(i, tag)| (*tag, i)).collect();
    let mut mesh = Mesh::<3> { nodes: positions(raw, &kept, unit)?, ..Mesh::default() };
    let (bones, fixed) = parts.bones(&numbers)?;
    mesh.fixed = fixed;
    for cell in &parts.cells {
        // Every tag of a cell is in `numbers`, so this cannot panic.
        let corners: [usize; 8] = std::array::from_fn(|i| numbers[&cell.nodes[i]]);
        let x = hexahedron::corners(&mesh.nodes, &corners);
        if !hexahedron::points().iter().all(|&at| hexahedron::jacobian(&x, at).determinant() > 0.0) {
            return Err(wrong!(
                cell.at,
                "hexahedron {} is turned inside out or flat at one of its points; repair the mesh, or reverse the order of its corners",
                cell.tag
            ));
        }
        mesh.hexahedra.push(corners);
    }
    let assembly = SpaceAssembly { raw, unit, parts, numbers, mesh };
    let (mut muscles, mut chains): (Vec<Muscle>, Vec<MuscleChain>) = (Vec::new(), Vec::new());
    for given in assembly.muscle_groups()? {
        let (muscle, ends) = assembly.muscle(&given)?;
        chains.push(MuscleChain { name: muscle.name.clone(), nodes: ends.to_vec() });
        muscles.push(muscle);
    }
    let SpaceAssembly { parts, numbers, mut mesh, .. } = assembly;
    let edges = mesh.hexahedra.iter().flat_map(|c| hexahedron::EDGES.map(|e| e.map(|i| c[i])));
    let outside = muscles.iter().flat_map(|m| &m.segments).filter(|s| s.outside).map(|s| s.nodes);
    parts.check_held(edges.chain(outside), &mesh.fixed, &numbers)?;
    mesh.muscles = chains;
    mesh.connect();
    let extent_mm = 1e3 * mesh.extent();
    if !EXTENT_MM.contains(&extent_mm) {
        let is = format!("the body is {} mm across, which no tongue is", (1e3 * extent_mm).round() / 1e3);
        let unit = "give the unit of its coordinates (--body-unit m or mm; in a scene: unit)";
        return Err(wrong!(None, "{is}; {unit}, or scale it"));
    }
    let body = Body { what: format!("the mesh of \"{origin}\""), mesh, bones, muscles, ..Body::default() };
    body.check().map_err(|fault| wrong!(None, "{fault}"))?;
    Ok(body)
}

impl<'a> SpaceAssembly<'a> {
    /// The muscles of the file. A muscle of one side without the other side is an error.
    fn muscle_groups(&self) -> Parsed<Vec<MuscleGroup<'a>>> {
        let mut out: Vec<MuscleGroup<'a>> = Vec::new();
        for group in &self.parts.groups {
            let GroupRole::Muscle(rest) = &group.role else { continue };
            let Some((name, strength)) = strength(rest) else {
                return Err(wrong!(
                    group.at,
                    "\"muscle:{rest}\": name the muscle and its strength with a unit, like `muscle:GGP_L 18.5 N` or `muscle:GGP_L 49.8 kPa`"
                ));
            };
            if out.iter().any(|g| g.name == name) {
                return Err(given_twice(&name, &name, rest, group.at));
            }
            let region = group.elements.iter().map(|e| sorted(&e.nodes)).collect();
            let view = self.raw.views.iter().find(|v| muscle_of_view(v) == Some(name.as_str()));
            out.push(MuscleGroup { name, strength, region, lines: Vec::new(), view, at: group.at });
        }
        let mean_y = |muscle: &MuscleGroup<'a>| {
            let tags = muscle.region.iter().flatten();
            let y = Vec::from_iter(tags.filter_map(|tag| self.raw.nodes.get(tag)).map(|x| x[1]));
            self.unit.metres() * y.iter().sum::<f64>() / y.len() as f64
        };
        for muscle in &out {
            let MuscleGroup { name, at, .. } = muscle;
            let other = match group_and_side(name) {
                (group, Side::Left) => format!("{group}_R"),
                (group, Side::Right) => format!("{group}_L"),
                (_, Side::Middle) => continue,
            };
            let Some(other) = out.iter().find(|g| g.name == other) else {
                return Err(wrong!(
                    *at,
                    "muscle {name} has no other side: no group is called \"muscle:{other} ..\"; add it, or give the muscle a name without a \
                     side"
                ));
            };
            let is_left = group_and_side(name).1 == Side::Left;
            if is_left && mean_y(muscle) - mean_y(other) > 1e-6 * self.mesh.extent() {
                return Err(wrong!(
                    *at,
                    "muscle {name} lies at larger y than {}, but y points to the right; exchange their names, or mirror the body",
                    other.name
                ));
            }
        }
        let nothing = |name: &str, at| {
            let help = "correct the name, or add the volume";
            wrong!(at, "fibres are given of {name}, but no volume is called \"muscle:{name} ..\"; {help}")
        };
        for group in &self.parts.groups {
            let GroupRole::Fibre(name) = &group.role else { continue };
            let muscle = out.iter_mut().find(|g| g.name == *name).ok_or_else(|| nothing(name, group.at))?;
            muscle.lines.extend(group.lines());
        }
        let mut views = self.raw.views.iter().filter_map(|v| Some((muscle_of_view(v)?, v.at)));
        match views.find(|(name, _)| !out.iter().any(|g| g.name == *name)) {
            Some((name, at)) => Err(nothing(name, at)),
            None => Ok(out),
        }
    }

    /// A muscle, and the two nodes between which its length is measured.
    fn muscle(&self, given: &MuscleGroup<'a>) -> Parsed<(Muscle, [usize; 2])> {
        let (mesh, cells) = (&self.mesh, &self.parts.cells);
        let MuscleGroup { name, lines, at, .. } = given;
        let region: Vec<usize> =
            (0..cells.len()).filter(|&c| given.region.contains(&sorted(&cells[c].nodes))).collect();
        let corners = region.iter().map(|&e| hexahedron::corners(&mesh.nodes, &mesh.hexahedra[e]));
        let volume: f64 = corners.map(|x| hexahedron::volume(&x)).sum();
        let place = |tag: &u64| self.raw.nodes.get(tag).map(|x| Vector3::from(*x) * self.unit.metres());
        let fibres = MeshFibres::lay(mesh, &self.numbers, lines, place).map_err(|node| {
            wrong!(
                *at,
                "a curve \"fibre:{name}\" lies outside the tissue at node {node}, where it must run from a node of the tissue to one of a \
                 bone; let it end inside the tissue, or give it a node of the mesh where it leaves and one on bone:NAME where it ends"
            )
        })?;
        let directions = match given.view {
            Some(view) => self.directions(view, &region, name)?,
            None => fibres.directions(mesh, &region),
        };
        let (stress_pa, force_n) = match (given.strength, lines.is_empty()) {
            (Strength::Newtons(_), true) => {
                return Err(wrong!(
                    *at,
                    "muscle {name} has a force, but no curves \"fibre:{name}\" whose length makes a stress of it; add them, or give the \
                     stress in kPa"
                ));
            }
            // The force of the muscle is shared equally by its fibres.
            (Strength::Newtons(force), false) => {
                let count = connected_components(lines).len() as f64;
                (force / count * fibres.length_m / volume, force / count)
            }
            (Strength::Pascals(stress), true) => (stress, 0.0),
            (Strength::Pascals(stress), false) => (stress, stress * volume / fibres.length_m),
        };
        if lines.is_empty() && directions.is_empty() {
            return Err(wrong!(
                *at,
                "muscle {name} has no directions; add a view \"fibre:{name}\" of vectors, or curves called \"fibre:{name}\""
            ));
        }
        let on_nodes = fibres.guides.is_empty() && !fibres.segments.is_empty();
        let measure = if on_nodes {
            longest_chain(&fibres.segments, mesh)
        } else {
            farthest_along_mean(&region, &directions, mesh)
        };
        let inside = mesh.in_tissue();
        let segment =
            |&nodes: &[usize; 2]| Segment { nodes, force_n, outside: !nodes.iter().all(|&n| inside[n]) };
        let mut segments: Vec<Segment> = fibres.segments.iter().map(segment).collect();
        if !on_nodes {
            let force_n = stress_pa * volume / mesh.distance(measure);
            segments.push(Segment { nodes: measure, force_n, outside: false });
        }
        let (group, side) = group_and_side(name);
        let (group, name) = (group.to_owned(), name.clone());
        Ok((Muscle { name, group, side, segments, region, stress_pa, directions }, measure))
    }

    fn directions(&self, view: &FibreView, region: &[usize], name: &str) -> Parsed<Vec<Directions>> {
        let unit = |vector: Vector3<f64>| vector.try_normalize(1e-12);
        let of_tag = |tag: &u64| view.vectors.get(tag).map(|v| Vector3::from(*v));
        // An element may be in the file once for each of its groups, and the view may name any of these copies.
        let elements = self.raw.elements.iter().rev().filter(|e| !view.of_nodes && e.dimension == 3);
        let of_elements: BTreeMap<Vec<u64>, Vector3<f64>> =
            elements.filter_map(|e| Some((sorted(&e.nodes), of_tag(&e.tag)?))).collect();
        let mut all = Vec::new();
        for &element in region {
            let cell = self.parts.cells[element];
            let of_point = |at| {
                let corners = cell.nodes.iter().zip(hexahedron::values(at));
                mean_axis(corners.filter_map(|(tag, share)| Some(of_tag(tag)? * share)))
            };
            let directions: Directions = if view.of_nodes {
                hexahedron::points().map(|at| unit(of_point(at)))
            } else {
                [of_elements.get(&sorted(&cell.nodes)).copied().and_then(unit); hexahedron::POINTS]
            };
            if directions.contains(&None) {
                return Err(wrong!(
                    view.at,
                    "the view \"fibre:{name}\" has no direction in element {}, or one of length zero; give every element of the muscle one",
                    cell.tag
                ));
            }
            all.push(directions);
        }
        Ok(all)
    }
}

fn muscle_of_view(view: &FibreView) -> Option<&str> {
    let (kind, name) = view.name.split_once(':')?;
    kind.trim().eq_ignore_ascii_case("fibre").then(|| name.trim())
}

/// Parses `NAME 18.5 N` or `NAME 49.8 kPa`.
fn strength(rest: &str) -> Option<(String, Strength)> {
    let &[name, number, unit] = rest.split_whitespace().collect::<Vec<_>>().as_slice() else { return None };
    let number = number.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0)?;
    let strength = match unit {
        "N" => Strength::Newtons(number),
        "Pa" => Strength::Pascals(number),
        "kPa" => Strength::Pascals(1e3 * number),
        _ => return None,
    };
    Some((name.to_owned(), strength))
}

/// The two nodes of the longest fibre that are farthest from each other.
fn longest_chain(lines: &[[usize; 2]], mesh: &Mesh<3>) -> [usize; 2] {
    let measured = connected_components(lines)
        .into_iter()
        .map(|part| (part.iter().map(|&l| mesh.distance(l)).sum::<f64>(), part));
    let longest = measured.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, part)| part).unwrap_or_default();
    let nodes: Vec<usize> = longest.into_iter().flatten().collect();
    let pairs = nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| [a, b]));
    pairs.max_by(|a, b| mesh.distance(*a).total_cmp(&mesh.distance(*b))).unwrap_or_default()
}

/// The two nodes of a region that are farthest from each other along its mean direction.
fn farthest_along_mean(region: &[usize], directions: &[Directions], mesh: &Mesh<3>) -> [usize; 2] {
    let mean = mean_axis(directions.iter().flatten().flatten().copied());
    let nodes: BTreeSet<usize> = region.iter().flat_map(|&e| mesh.hexahedra[e]).collect();
    let along = nodes.iter().map(|&n| (mesh.nodes[n].dot(&mean), n));
    let least = along.clone().min_by(|a, b| a.0.total_cmp(&b.0));
    let most = along.max_by(|a, b| a.0.total_cmp(&b.0));
    [least, most].map(|end| end.map_or(0, |(_, n)| n))
}
