//! The lines of ArtiSynth's files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::str::FromStr;

use nalgebra::Vector3;

use tongue_core::body::BodyError;

use super::Text;

type ReadResult<T> = Result<T, BodyError>;

/// Position in the file of each node or element, by id.
type Ids = BTreeMap<u64, usize>;

/// Elements by name of the muscle; names by number of the muscle, each with its line.
#[derive(Default)]
pub(super) struct Regions {
    pub names: BTreeMap<usize, (String, usize)>,
    pub of: BTreeMap<String, Vec<usize>>,
}

struct SourceLine<'a> {
    text: &'a Text,
    number: usize,
    row: &'a str,
}

impl<'a> SourceLine<'a> {
    /// Reads every line. It is an error if `read` returns true for none: then the text contains no `wanted`.
    fn each(text: &'a Text, wanted: &str, mut read: impl FnMut(&Self) -> ReadResult<bool>) -> ReadResult<()> {
        let mut is_any = false;
        for (line, row) in text.text.lines().enumerate().map(|(n, line)| (n + 1, line.trim())) {
            if !row.is_empty() && !row.starts_with('!') && !row.starts_with('#') {
                is_any |= read(&Self { text, number: line, row })?;
            }
        }
        let nothing = format!("it contains nothing that could be read as {wanted}");
        if is_any { Ok(()) } else { Err(text.wrong(None, nothing)) }
    }

    fn wrong(&self, problem: String) -> BodyError {
        self.text.wrong(Some(self.number), problem)
    }

    fn expected(&self, what: &str, found: impl Display) -> BodyError {
        self.wrong(format!("\"{found}\" stands where {what} was expected"))
    }

    fn parsed<T: FromStr>(&self, word: Option<&str>, what: &str) -> ReadResult<T> {
        let found = word.unwrap_or("nothing").trim();
        found.parse().map_err(|_| self.expected(what, found))
    }

    fn finite(&self, word: Option<&str>, what: &str) -> ReadResult<f64> {
        let value: f64 = self.parsed(word, what)?;
        value.is_finite().then_some(value).ok_or_else(|| self.expected(what, value))
    }

    fn known(&self, ids: &Ids, what: &str, id: u64) -> ReadResult<usize> {
        ids.get(&id).copied().ok_or_else(|| self.wrong(format!("{what} {id} does not exist")))
    }

    fn once(&self, is_new: bool, what: &str, id: impl Display) -> ReadResult<bool> {
        if is_new { Ok(true) } else { Err(self.wrong(format!("{what} {id} comes twice"))) }
    }

    /// The rest of a line that begins with `word` in any case, up to a comment.
    fn after(&self, word: &str) -> Option<&'a str> {
        let head = self.row.get(..word.len()).filter(|head| head.eq_ignore_ascii_case(word))?;
        Some(self.row[head.len()..].split('!').next().unwrap_or_default().trim())
    }
}

pub(super) fn nodes(text: &Text) -> ReadResult<(Vec<Vector3<f64>>, Ids)> {
    let (mut nodes, mut ids) = (Vec::new(), Ids::new());
    SourceLine::each(text, "nodes", |line| {
        let mut words = line.row.split_whitespace();
        let id: u64 = line.parsed(words.next(), "the id of a node")?;
        let mut coordinate = || line.finite(words.next(), "a coordinate");
        nodes.push(Vector3::new(coordinate()?, coordinate()?, coordinate()?));
        line.once(ids.insert(id, nodes.len() - 1).is_none(), "node", id)
    })?;
    Ok((nodes, ids))
}

pub(super) fn elements(text: &Text, nodes: &Ids) -> ReadResult<(Vec<[usize; 8]>, Ids)> {
    let (mut hexahedra, mut ids) = (Vec::new(), Ids::new());
    SourceLine::each(text, "hexahedra", |line| {
        let mut words = line.row.split_whitespace();
        let mut corners = [0; 8];
        for corner in &mut corners {
            *corner = line.known(nodes, "node", line.parsed(words.next(), "the id of a node")?)?;
        }
        hexahedra.push(corners);
        let id: u64 = line.parsed(words.last(), "the id of the element")?;
        line.once(ids.insert(id, hexahedra.len() - 1).is_none(), "element", id)
    })?;
    Ok((hexahedra, ids))
}

/// Numbers of nodes, from 0, each below `count`; sorted, each once.
pub(super) fn numbers(text: &Text, count: usize) -> ReadResult<Vec<usize>> {
    let mut all = BTreeSet::new();
    SourceLine::each(text, "numbers of nodes on bone", |line| {
        for word in line.row.split_whitespace() {
            let node: usize = line.parsed(Some(word), "the number of a node, from 0")?;
            if node >= count {
                return Err(line.wrong(format!("node {node} does not exist")));
            }
            all.insert(node);
        }
        Ok(true)
    })?;
    // About fewer nodes a bone could turn.
    if all.len() < 3 {
        let problem =
            format!("a bone needs three nodes or more, and this file has {}: is it cut off?", all.len());
        return Err(text.wrong(None, problem));
    }
    Ok(all.into_iter().collect())
}

pub(super) fn regions(text: &Text, elements: &Ids) -> ReadResult<Regions> {
    let mut regions = Regions::default();
    let mut selected = Vec::new();
    SourceLine::each(text, "muscles", |line| {
        if let Some(rest) = line.after("muscleName(") {
            let wrong = || line.expected("a muscle like muscleName(1) = 'GGP_L'", line.row);
            let (number, name) = rest.split_once(')').ok_or_else(wrong)?;
            let number: usize = line.parsed(Some(number), "the number of a muscle")?;
            let name = name.split('\'').nth(1).ok_or_else(wrong)?.trim().to_owned();
            let is_new = regions.names.insert(number, (name, line.number)).is_none();
            return line.once(is_new, "muscle", number);
        }
        if let Some(rest) = line.after("ESEL,") {
            let words: Vec<&str> = rest.split(',').map(str::trim).collect();
            match words[0] {
                w if w.eq_ignore_ascii_case("S") => selected.clear(),
                w if w.eq_ignore_ascii_case("A") => {}
                _ => return Ok(false),
            }
            if !words.get(1).is_some_and(|w| w.eq_ignore_ascii_case("ELEM")) {
                return Err(line.expected("ELEM", line.row));
            }
            let from: u64 = line.parsed(words.get(3).copied(), "the id of an element")?;
            let [to, step] =
                [(4, from), (5, 1)].map(|(at, or)| match words.get(at).filter(|w| !w.is_empty()) {
                    None => Ok(or),
                    Some(word) => line.parsed(Some(word), "the id of an element, or a step"),
                });
            let (to, step) = (to?, step?);
            if step == 0 || to < from || (to - from) / step > elements.len() as u64 {
                return Err(line.expected("from,to,step in ascending order", rest));
            }
            for id in (from..=to).step_by(step as usize) {
                selected.push(line.known(elements, "element", id)?);
            }
        } else if let Some(rest) = line.after("CM,") {
            let name = rest.split(',').next().unwrap_or_default().trim();
            let region: BTreeSet<usize> = selected.iter().copied().collect();
            regions.of.insert(name.to_owned(), region.into_iter().collect());
        }
        Ok(false)
    })?;
    Ok(regions)
}

/// The chains of nodes of each muscle, by its number.
pub(super) fn fibres(text: &Text, nodes: &Ids) -> ReadResult<BTreeMap<usize, Vec<Vec<usize>>>> {
    let mut places: BTreeMap<usize, BTreeMap<usize, BTreeMap<usize, usize>>> = BTreeMap::new();
    SourceLine::each(text, "fibres", |line| {
        let Some(rest) = line.after("FIBER(") else { return Ok(false) };
        let wrong = || line.expected("a node of a fibre like FIBER(1,2,3)=398", line.row);
        let (inside, id) = rest.split_once(')').ok_or_else(wrong)?;
        let id = id.trim().strip_prefix('=').ok_or_else(wrong)?;
        let mut three = inside.split(',');
        let mut next = |what| line.parsed::<usize>(three.next(), what);
        let (node, fibre, muscle) =
            (next("the number of a node")?, next("the number of a fibre")?, next("the number of a muscle")?);
        let at = line.known(nodes, "node", line.parsed(Some(id), "the id of a node")?)?;
        places.entry(muscle).or_default().entry(fibre).or_default().insert(node, at);
        Ok(true)
    })?;
    let mut all = BTreeMap::<usize, Vec<Vec<usize>>>::new();
    for (muscle, fibres) in places {
        for (fibre, chain) in fibres {
            if let Some(missing) = (1..=chain.len().max(2)).find(|i| !chain.contains_key(i)) {
                let problem = format!("fibre {fibre} of muscle number {muscle} has no node number {missing}");
                return Err(text.wrong(None, problem));
            }
            all.entry(muscle).or_default().push(chain.into_values().collect());
        }
    }
    Ok(all)
}

pub(super) fn strengths(text: &Text) -> ReadResult<BTreeMap<String, f64>> {
    let mut strengths = BTreeMap::new();
    SourceLine::each(text, "strengths", |line| {
        let mut words = line.row.split_whitespace();
        let name = words.next().unwrap_or_default();
        let force = line.finite(words.next(), "a force in newtons")?;
        if force <= 0.0 {
            return Err(line.expected("a force in newtons above 0", force));
        }
        strengths.insert(name.to_owned(), force);
        Ok(true)
    })?;
    Ok(strengths)
}
