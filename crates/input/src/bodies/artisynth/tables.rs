//! Parsers of ArtiSynth's files.

use std::collections::BTreeMap;
use std::str::FromStr;

use nalgebra::Vector3;

use super::{Fibres, Text, fail};
use crate::bodies::BodyFileError;

pub(super) struct Table<T> {
    pub of: Vec<T>,
    /// Index of each id in the list.
    pub numbers: BTreeMap<u64, usize>,
}

/// Regions by muscle name, and muscles by number with the line of their name.
#[derive(Default)]
pub(super) struct Regions {
    pub names: BTreeMap<usize, (String, usize)>,
    pub of: BTreeMap<String, Vec<usize>>,
}

/// Lines that are neither empty nor comments, with their numbers from 1.
fn lines(text: &Text) -> impl Iterator<Item = (usize, &str)> {
    let whole = text.text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    whole.filter(|(_, line)| !line.is_empty() && !line.starts_with('!') && !line.starts_with('#'))
}

fn nothing(text: &Text, what: &str) -> BodyFileError {
    fail(text, None, format!("it contains nothing that could be read as {what}"))
}

fn expected(text: &Text, line: usize, what: &str, found: impl std::fmt::Display) -> BodyFileError {
    fail(text, Some(line), format!("\"{found}\" stands where {what} was expected"))
}

fn number<T: FromStr>(
    text: &Text,
    line: usize,
    word: Option<&str>,
    what: &'static str,
) -> Result<T, BodyFileError> {
    let found = word.unwrap_or("nothing").trim();
    found.parse().map_err(|_| expected(text, line, what, found))
}

fn finite(text: &Text, line: usize, word: Option<&str>, what: &'static str) -> Result<f64, BodyFileError> {
    let value: f64 = number(text, line, word, what)?;
    value.is_finite().then_some(value).ok_or_else(|| expected(text, line, what, value))
}

pub(super) fn nodes(text: &Text) -> Result<Table<Vector3<f64>>, BodyFileError> {
    let mut table = Table { of: Vec::new(), numbers: BTreeMap::new() };
    for (line, row) in lines(text) {
        let mut words = row.split_whitespace();
        let id: u64 = number(text, line, words.next(), "the id of a node")?;
        let mut coordinate = || finite(text, line, words.next(), "a coordinate");
        table.of.push(Vector3::new(coordinate()?, coordinate()?, coordinate()?));
        if table.numbers.insert(id, table.of.len() - 1).is_some() {
            return Err(fail(text, Some(line), format!("node {id} comes twice")));
        }
    }
    match table.of.is_empty() {
        true => Err(nothing(text, "nodes")),
        false => Ok(table),
    }
}

/// The hexahedra, and the index of each id.
#[allow(clippy::type_complexity, reason = "a list and its index")]
pub(super) fn elements(
    text: &Text,
    nodes: &BTreeMap<u64, usize>,
) -> Result<(Vec<[usize; 8]>, BTreeMap<u64, usize>), BodyFileError> {
    let (mut hexahedra, mut ids) = (Vec::new(), BTreeMap::new());
    for (line, row) in lines(text) {
        let mut words = row.split_whitespace();
        let mut corners = [0; 8];
        for corner in &mut corners {
            let id: u64 = number(text, line, words.next(), "the id of a node")?;
            *corner =
                *nodes.get(&id).ok_or_else(|| fail(text, Some(line), format!("node {id} does not exist")))?;
        }
        let id: u64 = number(text, line, words.last(), "the id of the element")?;
        hexahedra.push(corners);
        if ids.insert(id, hexahedra.len() - 1).is_some() {
            return Err(fail(text, Some(line), format!("element {id} comes twice")));
        }
    }
    match hexahedra.is_empty() {
        true => Err(nothing(text, "hexahedra")),
        false => Ok((hexahedra, ids)),
    }
}

/// Node numbers from 0, each below `count`.
pub(super) fn numbers(text: &Text, count: usize) -> Result<Vec<usize>, BodyFileError> {
    let mut all = Vec::new();
    for (line, row) in lines(text) {
        for word in row.split_whitespace() {
            let node: usize = number(text, line, Some(word), "the number of a node, from 0")?;
            if node >= count {
                return Err(fail(text, Some(line), format!("node {node} does not exist")));
            }
            all.push(node);
        }
    }
    all.sort_unstable();
    all.dedup();
    match all.is_empty() {
        true => Err(nothing(text, "numbers of nodes on bone")),
        false => Ok(all),
    }
}

/// The rest of a line that begins with a word (in any case), up to a comment.
fn after<'a>(line: &'a str, word: &str) -> Option<&'a str> {
    let head = line.get(..word.len()).filter(|head| head.eq_ignore_ascii_case(word))?;
    Some(line[head.len()..].split('!').next().unwrap_or_default().trim())
}

pub(super) fn regions(text: &Text, elements: &BTreeMap<u64, usize>) -> Result<Regions, BodyFileError> {
    let mut regions = Regions::default();
    let mut selected = Vec::new();
    for (line, row) in lines(text) {
        let expected = |what, found: &str| expected(text, line, what, found);
        if let Some(rest) = after(row, "muscleName(") {
            let what = "a muscle like muscleName(1) = 'GGP_L'";
            let (number, name) = rest.split_once(')').ok_or_else(|| expected(what, row))?;
            let number: usize = self::number(text, line, Some(number), "the number of a muscle")?;
            let name = name.split('\'').nth(1).ok_or_else(|| expected(what, row))?.trim();
            if regions.names.insert(number, (name.to_owned(), line)).is_some() {
                return Err(fail(text, Some(line), format!("muscle {number} comes twice")));
            }
        } else if let Some(rest) = after(row, "ESEL,") {
            let words: Vec<&str> = rest.split(',').map(str::trim).collect();
            match words.first() {
                Some(w) if w.eq_ignore_ascii_case("S") => selected.clear(),
                Some(w) if w.eq_ignore_ascii_case("A") => {}
                _ => continue,
            }
            if !words.get(1).is_some_and(|w| w.eq_ignore_ascii_case("ELEM")) {
                return Err(expected("ELEM", row));
            }
            let from: u64 = number(text, line, words.get(3).copied(), "the id of an element")?;
            let given = |at: usize| words.get(at).copied().filter(|w| !w.is_empty());
            let optional = |at: usize, or: u64| match given(at) {
                None => Ok(or),
                word => number(text, line, word, "the id of an element, or a step"),
            };
            let (to, step) = (optional(4, from)?, optional(5, 1)?);
            if step == 0 || to < from || (to - from) / step > elements.len() as u64 {
                return Err(expected("from,to,step in ascending order", rest));
            }
            for id in (from..=to).step_by(step as usize) {
                let found = elements.get(&id);
                selected.push(
                    *found.ok_or_else(|| fail(text, Some(line), format!("element {id} does not exist")))?,
                );
            }
        } else if let Some(rest) = after(row, "CM,") {
            let name = rest.split(',').next().unwrap_or_default().trim();
            let mut region = selected.clone();
            region.sort_unstable();
            region.dedup();
            regions.of.insert(name.to_owned(), region);
        }
    }
    match regions.names.is_empty() {
        true => Err(nothing(text, "muscles")),
        false => Ok(regions),
    }
}

pub(super) fn fibres(text: &Text, nodes: &BTreeMap<u64, usize>) -> Result<Fibres, BodyFileError> {
    let mut places: BTreeMap<usize, BTreeMap<usize, BTreeMap<usize, usize>>> = BTreeMap::new();
    for (line, row) in lines(text) {
        let Some(rest) = after(row, "FIBER(") else { continue };
        let wrong = || expected(text, line, "a node of a fibre like FIBER(1,2,3)=398", row);
        let (inside, id) = rest.split_once(')').ok_or_else(wrong)?;
        let id = id.trim().strip_prefix('=').ok_or_else(wrong)?;
        let mut three = inside.split(',');
        let mut next = |what| number::<usize>(text, line, three.next(), what);
        let (node, fibre, muscle) =
            (next("the number of a node")?, next("the number of a fibre")?, next("the number of a muscle")?);
        let id: u64 = number(text, line, Some(id), "the id of a node")?;
        let at =
            *nodes.get(&id).ok_or_else(|| fail(text, Some(line), format!("node {id} does not exist")))?;
        places.entry(muscle).or_default().entry(fibre).or_default().insert(node, at);
    }
    if places.is_empty() {
        return Err(nothing(text, "fibres"));
    }
    let mut all = Fibres::new();
    for (muscle, fibres) in places {
        for (fibre, chain) in fibres {
            if let Some(missing) = (1..=chain.len().max(2)).find(|i| !chain.contains_key(i)) {
                return Err(fail(
                    text,
                    None,
                    format!("fibre {fibre} of muscle number {muscle} has no node number {missing}"),
                ));
            }
            all.entry(muscle).or_default().insert(fibre, chain.into_values().collect());
        }
    }
    Ok(all)
}

pub(super) fn strengths(text: &Text) -> Result<BTreeMap<String, f64>, BodyFileError> {
    let mut strengths = BTreeMap::new();
    for (line, row) in lines(text) {
        let mut words = row.split_whitespace();
        let name = words.next().unwrap_or_default();
        let force = finite(text, line, words.next(), "a force in newtons")?;
        if force <= 0.0 {
            return Err(expected(text, line, "a force in newtons above 0", force));
        }
        strengths.insert(name.to_owned(), force);
    }
    Ok(strengths)
}
