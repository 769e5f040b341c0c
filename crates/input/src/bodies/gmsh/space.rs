//! Bodies in space of hexahedra from Gmsh: muscles are overlapping groups of volumes, with directions from views or curves.
//!
//! | physical group | on | is |
//! |---|---|---|
//! | `tissue`, `tissue:NAME` | volumes | hexahedra |
//! | `muscle:NAME 18.5 N`, `muscle:NAME 49.8 kPa` | volumes | the region of a muscle with its strength at full activation: force, or stress along the fibres |
//! | `fibre:NAME` | curves | fibres of that muscle: lines between nodes, outside the tissue too |
//! | `bone:NAME` | points, curves, surfaces, volumes | nodes that do not move |
//!
//! A view `fibre:NAME` of vectors on elements or nodes gives the directions of a muscle. Without one they follow from its curves. A name that
//! ends in `_L` or `_R` is one side (y below or above zero) of a muscle that must have the other side too. The file has the axes of other
//! bodies in space: x to the back, y to the right, z upwards.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::Unit;
use super::cursor::Cursor;
use super::error::{Found, Located, MshProblem};
use super::parse::{Element, Raw, parse};
use super::views::View;
use crate::bodies::BodyFileError;
use tongue_core::body::space::{Directions, Segment, Side};
use tongue_core::body::{Bone, Mesh, MuscleChain, SpaceBody, SpaceMuscle};
use tongue_core::geometry::hexahedron;

/// Reads a body in space of hexahedra. `origin` is its name in messages, usually its path.
///
/// # Errors
/// [`BodyFileError::Gmsh`] with the line (in binary files: the byte) and what to do.
pub fn read_space(bytes: &[u8], origin: &str, unit: Unit) -> Result<SpaceBody, BodyFileError> {
    let mut cursor = Cursor::new(bytes);
    let body = parse(&mut cursor).and_then(|raw| Assembly::new(&raw, unit)?.body(origin));
    body.map_err(|located| located.into_error(origin, bytes, cursor.is_binary()))
}

/// Strength of a muscle at full activation.
#[derive(Clone, Copy)]
enum Strength {
    Newtons(f64),
    Pascals(f64),
}

/// A muscle as the file has it.
struct Given<'a> {
    name: String,
    strength: Strength,
    region: BTreeSet<&'a [u64]>,
    at: usize,
}

struct Assembly<'a> {
    raw: &'a Raw,
    /// Physical groups with a name: kind (`tissue`, `muscle`, ..), the rest of the name, its byte, and its elements.
    groups: Vec<(&'a str, &'a str, usize, Vec<&'a Element>)>,
    nodes: Vec<Vector3<f64>>,
    numbers: BTreeMap<u64, usize>,
    /// Each hexahedron by its corners, once.
    cells: Vec<&'a Element>,
}

impl<'a> Assembly<'a> {
    fn new(raw: &'a Raw, unit: Unit) -> Found<Self> {
        let mut groups = Vec::new();
        for (key, (name, at)) in &raw.names {
            let of: Vec<&Element> = raw.elements.iter().filter(|e| (e.dimension, e.group) == *key).collect();
            let (kind, rest) = name.split_once(':').unwrap_or((name, ""));
            groups.push((kind.trim(), rest.trim(), *at, of));
        }
        let is = |kind: &str, word: &str| kind.eq_ignore_ascii_case(word);
        let (mut cells, mut seen): (Vec<&Element>, BTreeSet<Vec<u64>>) = (Vec::new(), BTreeSet::new());
        for (kind, _, _, elements) in &groups {
            if !(is(kind, "tissue") || is(kind, "muscle")) {
                continue;
            }
            for &element in elements.iter().filter(|e| e.dimension == 3) {
                if element.nodes.len() != hexahedron::CORNERS {
                    return Err(Located::at(element.at, MshProblem::NotHexahedron { element: element.tag }));
                }
                if seen.insert(sorted(&element.nodes)) {
                    cells.push(element);
                }
            }
        }
        if cells.is_empty() {
            return Err(Located::whole(MshProblem::NoHexahedra));
        }
        cells.sort_by_key(|c| c.at);
        let on_lines = groups.iter().filter(|(kind, ..)| is(kind, "fibre")).flat_map(|(.., e)| e);
        let kept: BTreeSet<u64> = cells.iter().chain(on_lines).flat_map(|e| &e.nodes).copied().collect();
        let numbers: BTreeMap<u64, usize> = kept.iter().enumerate().map(|(i, tag)| (*tag, i)).collect();
        let place = |tag: &u64| raw.nodes.get(tag).map(|x| Vector3::from(*x) * unit.metres());
        let nodes = kept.iter().filter_map(place).collect();
        Ok(Self { raw, groups, nodes, numbers, cells })
    }

    fn of<'b>(
        &'b self,
        wanted: &'b str,
    ) -> impl Iterator<Item = &'b (&'a str, &'a str, usize, Vec<&'a Element>)> {
        self.groups.iter().filter(move |(kind, ..)| kind.eq_ignore_ascii_case(wanted))
    }

    fn body(self, origin: &str) -> Found<SpaceBody> {
        // Every tag of a cell or line is in `numbers`, so the default is never used.
        let number = |tag: &u64| self.numbers.get(tag).copied().unwrap_or_default();
        let mut mesh = Mesh::<3> { nodes: self.nodes.clone(), ..Mesh::default() };
        for cell in &self.cells {
            let corners: [usize; 8] = std::array::from_fn(|i| number(&cell.nodes[i]));
            let x = hexahedron::corners(&mesh.nodes, &corners);
            if !hexahedron::points().iter().all(|&at| hexahedron::jacobian(&x, at).determinant() > 0.0) {
                return Err(Located::at(cell.at, MshProblem::InvertedHexahedron { element: cell.tag }));
            }
            mesh.hexahedra.push(corners);
        }
        let bones = self.bones()?;
        mesh.fixed =
            bones.iter().flat_map(|b| b.nodes.iter().copied()).collect::<BTreeSet<_>>().into_iter().collect();
        let mut muscles = Vec::new();
        for given in self.given()? {
            let (muscle, chain) = self.muscle(&given, &mesh)?;
            mesh.muscles.push(MuscleChain { name: muscle.name.clone(), nodes: chain.to_vec() });
            muscles.push(muscle);
        }
        mesh.connect();
        let body = SpaceBody {
            what: format!("the mesh of \"{origin}\""),
            mesh,
            bones,
            muscles,
            ..SpaceBody::default()
        };
        body.check().map_err(|fault| Located::whole(MshProblem::Space(fault)))?;
        Ok(body)
    }

    /// The muscles with their strengths; sides are checked to pair.
    fn given(&self) -> Found<Vec<Given<'a>>> {
        let mut out: Vec<Given<'a>> = Vec::new();
        for (_, rest, at, elements) in self.of("muscle") {
            let (name, strength) = strength(rest).map_err(|problem| Located::at(*at, problem))?;
            if out.iter().any(|g| g.name == name) {
                let (first, second) = (name.clone(), (*rest).to_owned());
                return Err(Located::at(*at, MshProblem::MuscleTwice { name, first, second }));
            }
            let region = elements.iter().filter(|e| e.dimension == 3).map(|e| e.nodes.as_slice()).collect();
            out.push(Given { name, strength, region, at: *at });
        }
        for given in &out {
            let Some((group, side)) = given.name.rsplit_once('_') else { continue };
            let other = match side {
                "L" => format!("{group}_R"),
                "R" => format!("{group}_L"),
                _ => continue,
            };
            if !out.iter().any(|g| g.name == other) {
                return Err(Located::at(
                    given.at,
                    MshProblem::NoOtherSide { name: given.name.clone(), other },
                ));
            }
        }
        let curves = self.of("fibre").map(|(_, rest, at, _)| (*rest, *at));
        let views = self.raw.views.iter().filter_map(|v| Some((fibre_of(v)?, v.at)));
        for (name, at) in curves.chain(views) {
            if !out.iter().any(|g| g.name == name) {
                return Err(Located::at(at, MshProblem::NoMuscleOfFibre { name: name.to_owned() }));
            }
        }
        Ok(out)
    }

    /// A muscle, and the ends of the fibre that measures it.
    fn muscle(&self, given: &Given<'a>, mesh: &Mesh<3>) -> Found<(SpaceMuscle, [usize; 2])> {
        let located = |problem| Located::at(given.at, problem);
        let name = || given.name.clone();
        let keys: BTreeSet<Vec<u64>> = given.region.iter().map(|nodes| sorted(nodes)).collect();
        let region: Vec<usize> =
            (0..self.cells.len()).filter(|&c| keys.contains(&sorted(&self.cells[c].nodes))).collect();
        if region.is_empty() {
            return Err(located(MshProblem::MuscleWithoutHexahedra { name: name() }));
        }
        let volume: f64 = region
            .iter()
            .map(|&e| hexahedron::volume(&hexahedron::corners(&mesh.nodes, &mesh.hexahedra[e])))
            .sum();
        let lines: Vec<[usize; 2]> = self
            .of("fibre")
            .filter(|(_, rest, ..)| *rest == given.name)
            .flat_map(|(.., elements)| elements)
            .filter_map(|e| <[u64; 2]>::try_from(e.nodes.as_slice()).ok())
            .map(|ends| ends.map(|tag| self.numbers.get(&tag).copied().unwrap_or_default()))
            .collect();
        let view = self.raw.views.iter().find(|v| fibre_of(v) == Some(given.name.as_str()));
        let directions =
            view.map(|v| self.directions(v, &region, mesh, &given.name)).transpose()?.unwrap_or_default();
        let inside = mesh.in_tissue();
        let length: f64 = lines.iter().map(|&l| mesh.distance(l)).sum();
        let (stress_pa, force_n) = match (given.strength, lines.is_empty()) {
            (Strength::Newtons(_), true) => {
                return Err(located(MshProblem::NoFibreForForce { name: name() }));
            }
            // The force of the muscle is that of all its fibres together.
            (Strength::Newtons(force), false) => {
                let fibres = chains(&lines) as f64;
                (force / fibres * length / volume, force / fibres)
            }
            (Strength::Pascals(stress), true) => (stress, 0.0),
            (Strength::Pascals(stress), false) => (stress, stress * volume / length),
        };
        if lines.is_empty() && directions.is_empty() {
            return Err(located(MshProblem::NoFibres { name: name() }));
        }
        let measure = match lines.is_empty() {
            true => farthest(&region, &directions, mesh),
            false => longest_chain(&lines, mesh),
        };
        let is_outside = |l: &[usize; 2]| !l.iter().all(|&n| inside[n]);
        let segment = |&nodes: &[usize; 2]| Segment { nodes, force_n, outside: is_outside(&nodes) };
        let mut segments: Vec<Segment> = lines.iter().map(segment).collect();
        if segments.is_empty() {
            let force_n = stress_pa * volume / mesh.distance(measure);
            segments.push(Segment { nodes: measure, force_n, outside: false });
        }
        let (group, side) = match given.name.rsplit_once('_') {
            Some((group, "L")) => (group.to_owned(), Side::Left),
            Some((group, "R")) => (group.to_owned(), Side::Right),
            _ => (name(), Side::Middle),
        };
        Ok((SpaceMuscle { name: name(), group, side, segments, region, stress_pa, directions }, measure))
    }

    /// Directions of a view at the points of Gauss of each element of a region.
    fn directions(
        &self,
        view: &View,
        region: &[usize],
        mesh: &Mesh<3>,
        name: &str,
    ) -> Found<Vec<Directions>> {
        let unit = |vector: Vector3<f64>| vector.try_normalize(1e-12);
        let at_nodes: BTreeMap<usize, Vector3<f64>> = match view.of_nodes {
            true => view
                .vectors
                .iter()
                .filter_map(|(t, v)| Some((*self.numbers.get(t)?, Vector3::from(*v))))
                .collect(),
            false => BTreeMap::new(),
        };
        // An element may be in the file once for each of its groups, and the view may name any of them.
        let of_elements: BTreeMap<Vec<u64>, Vector3<f64>> = match view.of_nodes {
            true => BTreeMap::new(),
            false => self
                .raw
                .elements
                .iter()
                .rev()
                .filter(|e| e.dimension == 3)
                .filter_map(|e| Some((sorted(&e.nodes), Vector3::from(*view.vectors.get(&e.tag)?))))
                .collect(),
        };
        let mut out = Vec::with_capacity(region.len());
        for &element in region {
            let directions: Directions = match view.of_nodes {
                false => {
                    let own = of_elements.get(&sorted(&self.cells[element].nodes)).copied();
                    [own.and_then(unit); hexahedron::POINTS]
                }
                true => hexahedron::points().map(|at| {
                    let shares = hexahedron::values(at);
                    let corners = mesh.hexahedra[element].iter().zip(shares);
                    unit(corners.filter_map(|(n, share)| Some(at_nodes.get(n)? * share)).sum())
                }),
            };
            if directions.iter().any(Option::is_none) {
                let problem =
                    MshProblem::NoDirection { name: name.to_owned(), element: self.cells[element].tag };
                return Err(Located::at(view.at, problem));
            }
            out.push(directions);
        }
        Ok(out)
    }

    fn bones(&self) -> Found<Vec<Bone>> {
        let mut bones: BTreeMap<String, BTreeSet<usize>> = BTreeMap::new();
        for (_, rest, at, elements) in self.of("bone") {
            let name = if rest.is_empty() { "bone" } else { rest };
            for node in elements.iter().flat_map(|e| &e.nodes) {
                let Some(&number) = self.numbers.get(node) else {
                    let problem = MshProblem::BoneHoldsNothing { name: name.to_owned(), node: *node };
                    return Err(Located::at(*at, problem));
                };
                bones.entry(name.to_owned()).or_default().insert(number);
            }
        }
        Ok(bones.into_iter().map(|(name, nodes)| Bone { name, nodes: nodes.into_iter().collect() }).collect())
    }
}

fn sorted(nodes: &[u64]) -> Vec<u64> {
    let mut nodes = nodes.to_vec();
    nodes.sort_unstable();
    nodes
}

/// The muscle whose fibres a view directs.
fn fibre_of(view: &View) -> Option<&str> {
    let (kind, name) = view.name.split_once(':')?;
    kind.trim().eq_ignore_ascii_case("fibre").then(|| name.trim())
}

/// `NAME 18.5 N` or `NAME 49.8 kPa`.
fn strength(rest: &str) -> Result<(String, Strength), MshProblem> {
    let words: Vec<&str> = rest.split_whitespace().collect();
    let wrong = || MshProblem::Strength { found: rest.to_owned() };
    let &[name, number, unit] = words.as_slice() else { return Err(wrong()) };
    let number = number.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0).ok_or_else(wrong)?;
    let strength = match unit {
        "N" => Strength::Newtons(number),
        "Pa" => Strength::Pascals(number),
        "kPa" => Strength::Pascals(1e3 * number),
        _ => return Err(wrong()),
    };
    Ok((name.to_owned(), strength))
}

/// Number of connected fibres.
fn chains(lines: &[[usize; 2]]) -> usize {
    parts(lines).len()
}

/// The lines of each connected fibre.
fn parts(lines: &[[usize; 2]]) -> Vec<Vec<[usize; 2]>> {
    let mut parts: Vec<(BTreeSet<usize>, Vec<[usize; 2]>)> = Vec::new();
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

/// The ends of the longest fibre: the two of its nodes that are farthest from each other.
fn longest_chain(lines: &[[usize; 2]], mesh: &Mesh<3>) -> [usize; 2] {
    let length = |part: &Vec<[usize; 2]>| part.iter().map(|&l| mesh.distance(l)).sum::<f64>();
    let longest = parts(lines).into_iter().max_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or_default();
    let nodes: Vec<usize> = longest.into_iter().flatten().collect();
    let pairs = nodes.iter().flat_map(|&a| nodes.iter().map(move |&b| [a, b]));
    pairs.max_by(|a, b| mesh.distance(*a).total_cmp(&mesh.distance(*b))).unwrap_or_default()
}

/// The two nodes of a region that are farthest from each other along its mean direction.
fn farthest(region: &[usize], directions: &[Directions], mesh: &Mesh<3>) -> [usize; 2] {
    let mean: Vector3<f64> = directions.iter().flatten().flatten().sum();
    let nodes: BTreeSet<usize> = region.iter().flat_map(|&e| mesh.hexahedra[e]).collect();
    let along = |n: &usize| mesh.nodes[*n].dot(&mean);
    let least = nodes.iter().copied().min_by(|a, b| along(a).total_cmp(&along(b)));
    let most = nodes.iter().copied().max_by(|a, b| along(a).total_cmp(&along(b)));
    [least.unwrap_or_default(), most.unwrap_or_default()]
}
