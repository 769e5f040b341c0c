//! Parser of the sections of Gmsh files: formats 4.1 and 2.2, text and binary.

use std::collections::{BTreeMap, BTreeSet};

use super::cursor::{Cursor, Parsed, wrong};
use super::fibres::{FibreView, view};

/// Content of a file; tags are Gmsh's numbers of nodes and elements.
pub(super) struct Raw {
    /// Names of the physical groups by dimension and tag, each with its byte.
    pub names: BTreeMap<(usize, i64), (String, usize)>,
    /// Positions by tag, in the unit of the file.
    pub nodes: GmshNodes,
    /// Elements in the order of the file; an element in several physical groups is repeated for each.
    pub elements: Vec<GmshElement>,
    pub views: Vec<FibreView>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Triangles or tetrahedra, with muscles on curves.
    Simplices,
    /// Hexahedra, with muscles on volumes and fibres on curves.
    Hexahedra,
}

#[derive(Debug, Clone)]
pub(super) struct GmshElement {
    pub tag: u64,
    pub dimension: usize,
    /// Tag of its physical group; 0 for none.
    pub group: i64,
    pub nodes: Vec<u64>,
    /// Nodes in the middles of the sides of an element of the second order.
    pub middles: Vec<u64>,
    /// Byte at which the element begins.
    pub at: usize,
}

type GmshNodes = BTreeMap<u64, [f64; 3]>;

/// Physical groups by dimension and tag of the geometric entity.
type Entities = BTreeMap<(i64, i64), Vec<i64>>;

/// Dimension, number of corners and number of nodes of an element of Gmsh's type `kind`, whose corners come first.
fn shape(kind: i64, element: u64, at: usize) -> Parsed<[usize; 3]> {
    let linear = "only lines, triangles and tetrahedra of the first and second order and hexahedra of the first order are read: set Mesh.ElementOrder = 1 or 2";
    let (what, remedy) = match kind {
        15 => return Ok([0, 1, 1]),
        1 => return Ok([1, 2, 2]),
        2 => return Ok([2, 3, 3]),
        3 => return Ok([2, 4, 4]),
        4 => return Ok([3, 4, 4]),
        5 => return Ok([3, 8, 8]),
        8 => return Ok([1, 2, 3]),
        9 => return Ok([2, 3, 6]),
        11 => return Ok([3, 4, 10]),
        10 | 16 => ("quadrangle of the second order".to_owned(), ONLY_FIRST_ORDER),
        12 | 17 => ("hexahedron of the second order".to_owned(), ONLY_FIRST_ORDER),
        6 | 13 | 18 => ("prism".to_owned(), ONLY_SIMPLICES),
        7 | 14 | 19 => ("pyramid".to_owned(), ONLY_SIMPLICES),
        26..=28 => ("line of a higher order".to_owned(), linear),
        20..=25 => ("triangle of a higher order".to_owned(), linear),
        29..=31 => ("tetrahedron of a higher order".to_owned(), linear),
        other => (format!("cell of Gmsh's type {other}"), linear),
    };
    Err(wrong!(at, "element {element} is a {what}; {remedy}"))
}

const ONLY_SIMPLICES: &str =
    "only triangles and tetrahedra are read: switch off Recombine (Mesh.RecombineAll = 0)";

const ONLY_FIRST_ORDER: &str = "bodies in space are made of hexahedra with eight nodes: set Mesh.ElementOrder = 1 (triangles and tetrahedra may be \
                           of the second order)";

/// Refuses an element of the tissue that is of another form.
pub(super) fn check_cell(element: &GmshElement, form: Form) -> Parsed<()> {
    let (what, remedy) = match (form, element.dimension, element.nodes.len()) {
        (Form::Simplices, 2, 4) => ("quadrangle", ONLY_SIMPLICES),
        (Form::Simplices, 3, 8) => (
            "hexahedron",
            "name a body of hexahedra with --body FILE.msh, or switch off Recombine (Mesh.RecombineAll = 0)",
        ),
        (Form::Hexahedra, 3, 4) => (
            "tetrahedron",
            "a body in space with muscles in its volumes is made of hexahedra: mesh them with Transfinite and Recombine, or simulate \
             tetrahedra as a scene ([body.mesh] file = ..)",
        ),
        _ => return Ok(()),
    };
    Err(wrong!(element.at, "element {element} is a {what}; {remedy}", element = element.tag))
}

pub(super) fn parse(cursor: &mut Cursor<'_>) -> Parsed<Raw> {
    if !matches!(cursor.section(), Ok(Some(("MeshFormat", _)))) {
        return Err(wrong!(
            0,
            "this is not a Gmsh mesh: it does not begin with $MeshFormat; save it as .msh (gmsh my.geo -2)"
        ));
    }
    let is_new = header(cursor)?;
    let (mut names, mut views, mut entities) = (BTreeMap::new(), Vec::new(), Entities::new());
    let (mut nodes, mut elements) = (None, None);
    let mut once = BTreeSet::new();
    while let Some((section, at)) = cursor.section()? {
        if ["Entities", "Nodes", "Elements"].contains(&section) && !once.insert(section) {
            return Err(wrong!(at, "the section ${section} comes twice; keep one"));
        }
        match section {
            "PhysicalNames" => physical_names(cursor, &mut names)?,
            "PartitionedEntities" => {
                return Err(wrong!(at, "the mesh is partitioned; save it whole (Mesh.NbPartitions = 0)"));
            }
            "Entities" if is_new => entities = entities_4(cursor)?,
            "Nodes" => nodes = Some(if is_new { nodes_4(cursor)? } else { nodes_2(cursor)? }),
            "Elements" => elements = Some(if is_new { elements_4(cursor)? } else { elements_2(cursor)? }),
            "NodeData" => views.extend(view(cursor, "NodeData", at)?),
            "ElementData" => views.extend(view(cursor, "ElementData", at)?),
            other => cursor.skip(other)?,
        }
    }
    let missing = |section| {
        wrong!(
            None,
            "there is no section ${section}; mesh the model before it is saved (gmsh my.geo -2, or -3 in space)"
        )
    };
    let nodes: GmshNodes = nodes.ok_or_else(|| missing("Nodes"))?;
    let mut elements = elements.ok_or_else(|| missing("Elements"))?;
    if is_new {
        elements = in_groups(elements, &entities);
    }
    for GmshElement { tag, nodes: corners, middles, at, .. } in &elements {
        if let Some(&node) = corners.iter().chain(middles).find(|n| !nodes.contains_key(n)) {
            let missing = "which is not in $Nodes; save the file again";
            return Err(wrong!(*at, "element {tag} refers to node {node}, {missing}"));
        }
    }
    Ok(Raw { names, nodes, elements, views })
}

/// Returns whether the format is 4.1 rather than 2.2.
fn header(cursor: &mut Cursor<'_>) -> Parsed<bool> {
    let at = cursor.position();
    let version = cursor.token("the version of the format")?;
    if !matches!(version, "4.1" | "2.2") {
        return Err(wrong!(
            at,
            "the format is {version:.10}, but only 4.1 and 2.2 are read: save it with -format msh41, or with Mesh.MshFileVersion = 4.1"
        ));
    }
    let kind = cursor.int("0 for text or 1 for binary")?;
    if !matches!(kind, 0 | 1) {
        return Err(wrong!(at, "file type {kind} is out of range; save the file again"));
    }
    let size = cursor.line("the size of numbers")?.trim();
    if size != "8" {
        return Err(wrong!(
            at,
            "numbers have {size:.10} bytes, but must have 8: save it with -format msh41 by Gmsh on a 64-bit computer"
        ));
    }
    if kind == 1 {
        cursor.begin_binary()?;
    }
    cursor.end("MeshFormat")?;
    Ok(version == "4.1")
}

fn physical_names(
    cursor: &mut Cursor<'_>,
    names: &mut BTreeMap<(usize, i64), (String, usize)>,
) -> Parsed<()> {
    for _ in 0..cursor.count_in_text("the number of physical groups")? {
        let at = cursor.position();
        let line = cursor.line("a physical group")?.trim();
        let parsed = || {
            let (dimension, rest) = line.split_once(char::is_whitespace)?;
            let (tag, name) = rest.trim().split_once(char::is_whitespace)?;
            let name = name.trim().strip_prefix('"')?.strip_suffix('"')?;
            let dimension = dimension.parse().ok().filter(|d| *d <= 3)?;
            Some(((dimension, tag.parse().ok()?), (name.to_owned(), at)))
        };
        let Some((key, name)) = parsed() else {
            return Err(wrong!(
                at,
                "physical group without dimension, number and quoted name, like `1 2 \"GGa\"`: \"{line:.60}\""
            ));
        };
        names.insert(key, name);
    }
    cursor.end("PhysicalNames")
}

/// A tag or a count of format 2.2, which is at least 1.
fn positive(cursor: &mut Cursor<'_>, what: &'static str) -> Parsed<u64> {
    let at = cursor.position();
    let number = cursor.int(what)?;
    match u64::try_from(number) {
        Ok(n) if n > 0 => Ok(n),
        _ => Err(wrong!(at, "{what} {number} is out of range; save the file again")),
    }
}

/// Reads the position of a node whose tag begins at the byte `tag_at`.
fn position(cursor: &mut Cursor<'_>, nodes: &mut GmshNodes, node: u64, tag_at: usize) -> Parsed<()> {
    let at = cursor.position();
    let x = cursor.reals("a coordinate")?;
    if !x.iter().all(|c| c.is_finite()) {
        return Err(wrong!(
            at,
            "a coordinate of node {node} is not finite; correct the model and mesh it again"
        ));
    }
    match nodes.insert(node, x) {
        None => Ok(()),
        Some(_) => Err(wrong!(tag_at, "node {node} is defined twice; keep one")),
    }
}

fn nodes_2(cursor: &mut Cursor<'_>) -> Parsed<GmshNodes> {
    let mut nodes = BTreeMap::new();
    for _ in 0..cursor.count_in_text("the number of nodes")? {
        let at = cursor.position();
        let node = positive(cursor, "node")?;
        position(cursor, &mut nodes, node, at)?;
    }
    cursor.end("Nodes")?;
    Ok(nodes)
}

fn element(
    [kind, group]: [i64; 2],
    tag: u64,
    at: usize,
    mut node: impl FnMut() -> Parsed<u64>,
) -> Parsed<GmshElement> {
    let [dimension, corners, count] = shape(kind, tag, at)?;
    let mut nodes = (0..count).map(|_| node()).collect::<Parsed<Vec<_>>>()?;
    let middles = nodes.split_off(corners);
    Ok(GmshElement { tag, dimension, group, nodes, middles, at })
}

fn elements_2(cursor: &mut Cursor<'_>) -> Parsed<Vec<GmshElement>> {
    let count = cursor.count_in_text("the number of elements")?;
    let mut elements: Vec<GmshElement> = Vec::new();
    while (elements.len() as u64) < count {
        // In binary, elements of one type follow a common header.
        let first = if cursor.is_binary { None } else { Some(positive(cursor, "element")?) };
        let kind = cursor.int("the type of an element")?;
        let follow = if first.is_none() { positive(cursor, "number of elements")? } else { 1 };
        let tags = cursor.int("the number of tags")?;
        for _ in 0..follow {
            let at = cursor.position();
            let tag = first.map_or_else(|| positive(cursor, "element"), Ok)?;
            let mut group = 0;
            for nth in 0..tags {
                let value = cursor.int("a tag of an element")?;
                group = if nth == 0 { value.saturating_abs() } else { group };
            }
            elements.push(element([kind, group], tag, at, || positive(cursor, "node"))?);
        }
    }
    cursor.end("Elements")?;
    Ok(elements)
}

fn entities_4(cursor: &mut Cursor<'_>) -> Parsed<Entities> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = cursor.size("the number of entities")?;
    }
    let mut entities = Entities::new();
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = cursor.int("an entity")?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                cursor.real("a coordinate of an entity")?;
            }
            let groups = cursor.size("the number of physical groups")?;
            let groups: Vec<i64> = (0..groups)
                .map(|_| Ok(cursor.int("a physical group")?.saturating_abs()))
                .collect::<Parsed<_>>()?;
            if dimension > 0 {
                for _ in 0..cursor.size("the number of bounding entities")? {
                    cursor.int("a bounding entity")?;
                }
            }
            entities.insert((dimension as i64, tag), groups);
        }
    }
    cursor.end("Entities")?;
    Ok(entities)
}

fn nodes_4(cursor: &mut Cursor<'_>) -> Parsed<GmshNodes> {
    let blocks = cursor.size("the number of blocks")?;
    for what in ["the number of nodes", "the lowest node", "the highest node"] {
        cursor.size(what)?;
    }
    let mut nodes = BTreeMap::new();
    for _ in 0..blocks {
        let dimension = cursor.int("the dimension of an entity")?;
        cursor.int("an entity")?;
        let parametric = cursor.int("0, or 1 for parametric coordinates")?;
        let mut tags = Vec::new();
        for _ in 0..cursor.size("the number of nodes of a block")? {
            tags.push((cursor.position(), cursor.size("a node")?));
        }
        for (at, node) in tags {
            position(cursor, &mut nodes, node, at)?;
            for _ in 0..if parametric == 0 { 0 } else { dimension.clamp(0, 3) } {
                cursor.real("a parametric coordinate")?;
            }
        }
    }
    cursor.end("Nodes")?;
    Ok(nodes)
}

/// The elements, whose `group` is the tag of their entity until `in_groups` replaces it.
fn elements_4(cursor: &mut Cursor<'_>) -> Parsed<Vec<GmshElement>> {
    let blocks = cursor.size("the number of blocks")?;
    for what in ["the number of elements", "the lowest element", "the highest element"] {
        cursor.size(what)?;
    }
    let mut elements = Vec::new();
    for _ in 0..blocks {
        cursor.int("the dimension of an entity")?;
        let entity = cursor.int("an entity")?;
        let kind = cursor.int("the type of the elements")?;
        for _ in 0..cursor.size("the number of elements of a block")? {
            let at = cursor.position();
            let tag = cursor.size("an element")?;
            elements.push(element([kind, entity], tag, at, || cursor.size("a node"))?);
        }
    }
    cursor.end("Elements")?;
    Ok(elements)
}

/// Repeats every element for each physical group of its entity.
fn in_groups(elements: Vec<GmshElement>, entities: &Entities) -> Vec<GmshElement> {
    let mut out = Vec::with_capacity(elements.len());
    for element in elements {
        match entities.get(&(element.dimension as i64, element.group)).map(Vec::as_slice) {
            None | Some([]) => out.push(GmshElement { group: 0, ..element }),
            Some(groups) => out.extend(groups.iter().map(|&group| GmshElement { group, ..element.clone() })),
        }
    }
    out
}
