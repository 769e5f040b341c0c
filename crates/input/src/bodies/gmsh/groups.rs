//! Physical groups and their meaning.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::SVector;

use super::Unit;
use super::cursor::{Located, Parsed, wrong};
use super::parse::{Form, GmshElement, Raw, check_cell};
use crate::measured::muscles::Muscles;
use tongue_core::body::Bone;
use tongue_core::choice;
use tongue_core::system::are_held;

/// Meaning of a physical group, with the NAME in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum GroupRole {
    Tissue,
    Muscle(String),
    Fibre(String),
    Bone(String),
    Other,
}

impl GroupRole {
    fn of(name: &str, dimension: usize, form: Form) -> Option<Self> {
        let (kind, rest) = split(name);
        let is = |word: &str| kind.eq_ignore_ascii_case(word);
        let published =
            |name: &str| Muscles::built_in().published(name).map(|(_, spelling)| spelling.to_owned());
        let muscle = |name: &str| published(name).unwrap_or_else(|| name.to_owned());
        match (form, dimension, rest) {
            (_, 2 | 3, _) if is("tissue") => Some(Self::Tissue),
            (_, _, rest) if is("bone") => Some(Self::Bone(rest.unwrap_or("bone").to_owned())),
            _ if is("other") => Some(Self::Other),
            (Form::Simplices, 1, Some(rest)) if is("muscle") => Some(Self::Muscle(muscle(rest))),
            (Form::Simplices, 1, None) => published(kind).map(Self::Muscle),
            (Form::Hexahedra, 3, Some(rest)) if is("muscle") => Some(Self::Muscle(rest.to_owned())),
            (Form::Hexahedra, 1, Some(rest)) if is("fibre") => Some(Self::Fibre(rest.to_owned())),
            _ => None,
        }
    }
}

/// `muscle:NAME` as `muscle` and `NAME`.
fn split(name: &str) -> (&str, Option<&str>) {
    match name.split_once(':') {
        Some((kind, rest)) => (kind.trim(), Some(rest.trim()).filter(|r| !r.is_empty())),
        None => (name.trim(), None),
    }
}

/// The words that names of groups may begin with, each with examples of whole names.
fn usual_names(dimension: usize, form: Form) -> Vec<(&'static str, &'static str)> {
    let bone = ("bone", "bone:NAME");
    let muscle = ("muscle", "GGa to HGp, muscle:NAME");
    match (form, dimension) {
        (Form::Simplices, 1) => vec![muscle, bone],
        (Form::Hexahedra, 1) => vec![("fibre", "fibre:NAME"), bone],
        (Form::Hexahedra, 3) => {
            vec![("tissue", "tissue"), ("muscle", "muscle:NAME 18.5 N or muscle:NAME 49.8 kPa"), bone]
        }
        (_, 0) => vec![bone],
        _ => vec![("tissue", "tissue"), bone],
    }
}

fn unknown(name: &str, dimension: usize, form: Form, at: usize) -> Located {
    let (kind, rest) = split(name);
    let usual_names = usual_names(dimension, form);
    let all = Muscles::built_in().all();
    let published = all.iter().map(|m| m.name.as_str()).filter(|_| form == Form::Simplices && dimension == 1);
    let meant = choice::nearest(kind, usual_names.iter().map(|(word, _)| *word).chain(published));
    let meant = meant.map_or_else(String::new, |near| {
        match rest.filter(|_| usual_names.iter().any(|(word, _)| *word == near)) {
            Some(rest) => format!("did you mean \"{near}:{rest}\"? "),
            None => format!("did you mean \"{near}\"? "),
        }
    });
    let usual = usual_names.iter().map(|(_, whole)| *whole).collect::<Vec<_>>().join(", ");
    let on = ["points", "curves", "surfaces", "volumes"].get(dimension).copied().unwrap_or("elements");
    wrong!(
        at,
        "the physical group \"{name}\" of {on} has no meaning here; {meant}{on} may be called {usual}; rename it, or call it \
         \"other:{name}\" to leave it out"
    )
}

pub(super) struct PhysicalGroup<'a> {
    pub dimension: usize,
    pub name: &'a str,
    pub at: usize,
    pub role: GroupRole,
    pub elements: Vec<&'a GmshElement>,
}

impl PhysicalGroup<'_> {
    pub fn lines(&self) -> Vec<[u64; 2]> {
        self.elements.iter().filter_map(|e| <[u64; 2]>::try_from(e.nodes.as_slice()).ok()).collect()
    }
}

pub(super) struct GroupParts<'a> {
    pub groups: Vec<PhysicalGroup<'a>>,
    /// Elements of the tissue, in the order of the file and each once.
    pub cells: Vec<&'a GmshElement>,
    pub dimension: usize,
}

impl<'a> GroupParts<'a> {
    pub fn new(raw: &'a Raw, form: Form) -> Parsed<Self> {
        let mut by_key: BTreeMap<(usize, i64), Vec<&GmshElement>> = BTreeMap::new();
        for element in raw.elements.iter().filter(|e| e.group != 0) {
            by_key.entry((element.dimension, element.group)).or_default().push(element);
        }
        // The form of the cells is checked before the names of groups, which differ between forms, so that a wrong form is reported as
        // such.
        let tissue = raw.names.iter().rev();
        let tissue = tissue.filter(|(_, (name, _))| split(name).0.eq_ignore_ascii_case("tissue"));
        let of_tissue = tissue.map(|(key, _)| key).filter(|(d, _)| form == Form::Simplices || *d == 3);
        for element in of_tissue.filter_map(|key| by_key.get(key)).flatten() {
            check_cell(element, form)?;
        }
        let mut groups = Vec::new();
        for (key, (name, at)) in &raw.names {
            let (dimension, at, elements) = (key.0, *at, by_key.remove(key).unwrap_or_default());
            let Some(role) = GroupRole::of(name, dimension, form) else {
                return Err(unknown(name, dimension, form, at));
            };
            if elements.is_empty() && role != GroupRole::Other {
                return Err(wrong!(
                    at,
                    "the physical group \"{name}\" has no elements; mesh what it is of, or remove the group"
                ));
            }
            groups.push(PhysicalGroup { dimension, name, at, role, elements });
        }
        let found = groups.iter().filter(|g| g.role == GroupRole::Tissue).map(|g| g.dimension).max();
        let dimension = found.filter(|d| *d == 3 || form == Form::Simplices).ok_or_else(|| {
            let names: Vec<String> = groups.iter().map(|g| format!("\"{}\"", g.name)).collect();
            let found = if names.is_empty() { "it has no named physical groups".to_owned() } else { format!("it has {}", names.join(", ")) };
            let (cells, advice) = match form {
                Form::Simplices => (
                    "triangle or tetrahedron",
                    "Physical Surface(\"tissue\") = {...}; in space Physical Volume(\"tissue\")",
                ),
                Form::Hexahedra => (
                    "hexahedron",
                    "Physical Volume(\"tissue\") = {...} of all volumes, which must be meshed with hexahedra (Transfinite Volume, Recombine)",
                ),
            };
            wrong!(None, "no {cells} is in a physical group called \"tissue\" ({found}); add {advice}")
        })?;
        let (mut cells, mut seen): (Vec<&GmshElement>, BTreeSet<Vec<u64>>) = (Vec::new(), BTreeSet::new());
        // In the plane no muscle is on surfaces. In space the surface of the tissue may be called tissue too, and is no cell.
        let of_cells = groups.iter().filter(|g| {
            g.dimension == dimension && matches!(g.role, GroupRole::Tissue | GroupRole::Muscle(_))
        });
        for &element in of_cells.flat_map(|g| &g.elements) {
            check_cell(element, form)?;
            if seen.insert(sorted(&element.nodes)) {
                cells.push(element);
            }
        }
        cells.sort_by_key(|c| c.at);
        Ok(Self { groups, cells, dimension })
    }

    /// The bones in the order of their groups (groups of one name are one bone), and the nodes of all bones.
    pub fn bones(&self, numbers: &BTreeMap<u64, usize>) -> Parsed<(Vec<Bone>, Vec<usize>)> {
        let mut bones: Vec<(&str, BTreeSet<usize>)> = Vec::new();
        for group in &self.groups {
            let GroupRole::Bone(name) = &group.role else { continue };
            let mut nodes = BTreeSet::new();
            for node in group.elements.iter().flat_map(|e| &e.nodes) {
                let nothing =
                    "which belongs to no element of the tissue and to no muscle; take a node of these";
                let fault = || wrong!(group.at, "bone \"{name}\" contains node {node}, {nothing}");
                nodes.insert(*numbers.get(node).ok_or_else(fault)?);
            }
            match bones.iter_mut().find(|(n, _)| n == name) {
                Some((_, of)) => of.extend(nodes),
                None => bones.push((name, nodes)),
            }
        }
        let fixed: BTreeSet<usize> = bones.iter().flat_map(|(_, nodes)| nodes).copied().collect();
        let bones = bones
            .into_iter()
            .map(|(name, nodes)| Bone { name: name.to_owned(), nodes: nodes.into_iter().collect() });
        Ok((bones.collect(), fixed.into_iter().collect()))
    }

    /// Checks that every cell is connected to a fixed node through the pairs in `joined`.
    pub fn check_held(
        &self,
        joined: impl Iterator<Item = [usize; 2]>,
        fixed: &[usize],
        numbers: &BTreeMap<u64, usize>,
    ) -> Parsed<()> {
        if fixed.is_empty() {
            return Err(wrong!(
                None,
                "no bone holds the body; add Physical Point(\"bone\") = {{...}}, or Curve or Surface, of what does not move"
            ));
        }
        let held = are_held(numbers.len(), joined, fixed);
        self.cells.iter().find(|c| c.nodes.iter().any(|tag| numbers.get(tag).is_some_and(|&n| !held[n]))).map_or(Ok(()), |cell| {
            Err(wrong!(
                cell.at,
                "the part with element {} is connected to no bone, so it could move freely: connect it to the rest (gmsh: Coherence), or give it a bone",
                cell.tag
            ))
        })
    }
}

/// How far a body of triangles may lie off the plane z = 0, over its largest coordinate.
const MOST_OFF_PLANE: f64 = 1e-6;

/// Positions in the order of the tags, m.
pub(super) fn positions<const D: usize>(
    raw: &Raw,
    kept: &BTreeSet<u64>,
    unit: Unit,
) -> Parsed<Vec<SVector<f64, D>>> {
    let given = kept.iter().filter_map(|tag| raw.nodes.get(tag).map(|x| (*tag, x)));
    if D == 2 {
        let extent = given.clone().flat_map(|(_, x)| [x[0].abs(), x[1].abs()]).fold(0.0, f64::max);
        if let Some((node, x)) = given.clone().find(|(_, x)| x[2].abs() > MOST_OFF_PLANE * extent) {
            return Err(wrong!(
                None,
                "node {node} lies at z = {}; a body of triangles lies in the midsagittal plane, z = 0 (x to the back, y up): turn or shift \
                 the model, or mesh a volume of tetrahedra (gmsh -3)",
                x[2]
            ));
        }
    }
    Ok(given.map(|(_, x)| SVector::from_iterator(x.iter().map(|c| c * unit.metres()))).collect())
}

pub(super) fn sorted(nodes: &[u64]) -> Vec<u64> {
    let mut nodes = nodes.to_vec();
    nodes.sort_unstable();
    nodes
}
