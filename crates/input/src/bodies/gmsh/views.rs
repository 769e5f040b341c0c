//! Vectors of views (`$ElementData`, `$NodeData`), as Gmsh saves them behind a mesh.

use std::collections::BTreeMap;

use super::cursor::Cursor;
use super::error::{Found, wrong};

pub(super) struct View {
    pub name: String,
    /// Whether nodes have the vectors; otherwise elements.
    pub of_nodes: bool,
    /// The vectors by the tag of a node or an element.
    pub vectors: BTreeMap<u64, [f64; 3]>,
    /// The byte at which it begins.
    pub at: usize,
}

/// Reads a view of vectors. One with other than three components is read past.
pub(super) fn view(cursor: &mut Cursor<'_>, section: &'static str, at: usize) -> Found<Option<View>> {
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
    // The step, the number of components, the number of entries, and a partition.
    let count = cursor.count_in_text("the number of whole numbers of a view")?;
    let integers =
        (0..count).map(|_| cursor.count_in_text("a whole number of a view")).collect::<Found<Vec<_>>>()?;
    let (components, entries) =
        (integers.get(1).copied().unwrap_or(0), integers.get(2).copied().unwrap_or(0));
    if components != 3 {
        cursor.skip(section)?;
        return Ok(None);
    }
    let mut vectors = BTreeMap::new();
    for _ in 0..entries {
        let at = cursor.at();
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
    Ok(Some(View { name, of_nodes: section == "NodeData", vectors, at }))
}
