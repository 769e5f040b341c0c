//! Reader of ArtiSynth's tongue from a folder of its files, which are not part of this program.
//!
//! | file | what is read |
//! |---|---|
//! | `*.node` | `id x y z`, m, ids from 1 |
//! | `*.elem` | eight ids of nodes for each hexahedron (ANSYS's order), five numbers, and its id |
//! | `CreateMuscles.mac` | `muscleName(i)='GGP_L'`; `ESEL,S` or `A`, `ELEM,,from[,to[,step]]` up to `CM,NAME,ELEM` |
//! | `Fibers.mac` | `FIBER(node,fibre,muscle)=id` |
//! | `MuscleMaxForce.txt` | `NAME newtons` of both sides together |
//! | `jawAttachments.txt`, `hyoidAttachments.txt` | nodes on bone, counted from 0 |
//!
//! The forces follow Buchaillard, Perrier and Payan (2009) and Stavness, Lloyd, Payan and Fels (2011): the force of a segment is the
//! strength of its muscle times the segment's volume over the sum of the largest volumes of all fibres. The volume of a segment is that of
//! the region's elements with both of its nodes or, if there are none, the mean volume of the elements with its first node.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::Path;
use std::str::FromStr;

use nalgebra::Vector3;

use tongue_core::body::space::{Segment, Side};
use tongue_core::body::{Body, BodyError, Bone, HYOID, MANDIBLE, Mesh, Muscle, MuscleChain};

use super::group_and_side;

/// Styloid processes, which the files lack and ArtiSynth's program places: id in `Fibers.mac`, and position, m.
const STYLOID: [(u64, [f64; 3]); 2] = [(4042, [0.14984, 0.03589, 0.125]), (4037, [0.14984, -0.0358, 0.125])];

#[derive(Debug, Clone, Default)]
pub struct ArtisynthFiles {
    pub nodes: Text,
    pub elements: Text,
    pub muscles: Text,
    pub fibres: Text,
    pub strengths: Text,
    pub jaw: Text,
    pub hyoid: Text,
}

#[derive(Debug, Clone, Default)]
pub struct Text {
    pub file: String,
    pub text: String,
}

impl Text {
    fn wrong(&self, line: Option<usize>, problem: String) -> BodyError {
        let place = line.map_or_else(String::new, |line| format!(":{line}"));
        BodyError(format!("{}{place}: {problem}", self.file))
    }
}

fn unreadable(file: &str, error: &std::io::Error) -> BodyError {
    BodyError(format!(
        "{file}: cannot be read: {error}; name a folder with ArtiSynth's tongue (.node, .elem, CreateMuscles.mac, Fibers.mac, \
         MuscleMaxForce.txt, jawAttachments.txt, hyoidAttachments.txt)"
    ))
}

pub fn read(folder: &Path) -> Result<Body<3>, BodyError> {
    let named = |name: &str| {
        let path = folder.join(name);
        let file = path.display().to_string();
        let bytes = crate::files::read(path).map_err(|e| unreadable(&file, &e))?;
        // Bytes that are not UTF-8 occur only in comments, which are in Latin-1.
        Ok(Text { file, text: String::from_utf8_lossy(&bytes).into_owned() })
    };
    let files = ArtisynthFiles {
        nodes: named(&only_file(folder, "node")?)?,
        elements: named(&only_file(folder, "elem")?)?,
        muscles: named("CreateMuscles.mac")?,
        fibres: named("Fibers.mac")?,
        strengths: named("MuscleMaxForce.txt")?,
        jaw: named("jawAttachments.txt")?,
        hyoid: named("hyoidAttachments.txt")?,
    };
    body(&files, &folder.display().to_string())
}

fn only_file(folder: &Path, ending: &str) -> Result<String, BodyError> {
    let origin = folder.display().to_string();
    let mut found: Vec<String> = std::fs::read_dir(folder)
        .map_err(|e| unreadable(&origin, &e))?
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| Path::new(n).extension().is_some_and(|e| e.eq_ignore_ascii_case(ending)))
        .collect();
    let problem = match (found.pop(), found.is_empty()) {
        (Some(one), true) => return Ok(one),
        (None, _) => format!("contains no file that ends in .{ending}; a body of ArtiSynth has one"),
        (Some(_), false) => format!("contains several files that end in .{ending}; keep one"),
    };
    Err(BodyError(format!("{origin}: {problem}")))
}

/// Refuses nodes that are attached to both bones, and files that are exchanged. The nodes are ascending.
fn check_attachments(
    files: &ArtisynthFiles,
    mesh: &Mesh<3>,
    [jaw, hyoid]: [&[usize]; 2],
) -> Result<(), BodyError> {
    if let Some(node) = hyoid.iter().find(|node| jaw.binary_search(node).is_ok()) {
        let problem = format!(
            "node {node} is attached to the jaw too, in {}; keep it in one of the two",
            files.jaw.file
        );
        return Err(files.hyoid.wrong(None, problem));
    }
    // x grows to the back of the head.
    let [jaw_x, hyoid_x] =
        [jaw, hyoid].map(|nodes| nodes.iter().map(|&n| mesh.nodes[n].x).sum::<f64>() / nodes.len() as f64);
    if jaw_x > hyoid_x {
        let behind_mm = 1e3 * (jaw_x - hyoid_x);
        let problem = format!(
            "the nodes on the jaw lie {behind_mm:.1} mm behind those on the hyoid (x grows to the back): exchange this file and {}",
            files.hyoid.file
        );
        return Err(files.jaw.wrong(None, problem));
    }
    Ok(())
}

pub fn body(files: &ArtisynthFiles, origin: &str) -> Result<Body<3>, BodyError> {
    let (places, mut ids) = nodes(&files.nodes)?;
    let in_tissue = places.len();
    let (hexahedra, element_ids) = elements(&files.elements, &ids)?;
    let mut mesh = Mesh { nodes: places, hexahedra, ..Mesh::default() };
    let mut bones = vec![
        Bone { name: MANDIBLE.to_owned(), nodes: numbers(&files.jaw, in_tissue)? },
        Bone { name: HYOID.to_owned(), nodes: numbers(&files.hyoid, in_tissue)? },
    ];
    check_attachments(files, &mesh, [&bones[0].nodes, &bones[1].nodes])?;
    let regions = regions(&files.muscles, &element_ids)?;
    let mut styloid = Vec::new();
    for (id, place) in STYLOID.into_iter().filter(|(id, _)| files.fibres.text.contains(&format!("={id}"))) {
        ids.entry(id).or_insert_with(|| {
            mesh.nodes.push(Vector3::from(place));
            styloid.push(mesh.nodes.len() - 1);
            mesh.nodes.len() - 1
        });
    }
    if !styloid.is_empty() {
        bones.push(Bone { name: "styloid_process".to_owned(), nodes: styloid });
    }
    let fibres = fibres(&files.fibres, &ids)?;
    let strengths = strengths(&files.strengths)?;
    let fixed: BTreeSet<usize> = bones.iter().flat_map(|b| b.nodes.iter().copied()).collect();
    mesh.fixed = fixed.into_iter().collect();
    let mut body = Body { what: format!("the tongue of {origin}"), mesh, bones, ..Body::default() };
    let volumes: Vec<f64> = body.mesh.hexahedron_volumes().collect();
    for (number, (name, line)) in &regions.names {
        let lacks = |what: &str| files.muscles.wrong(Some(*line), format!("muscle {name} has no {what}"));
        let (group, side) = group_and_side(name);
        let region = regions.of.get(name).ok_or_else(|| lacks("elements: no CM,NAME,ELEM follows"))?;
        let chains = fibres.get(number).ok_or_else(|| lacks("fibres in Fibers.mac"))?;
        let strength = strengths
            .get(group)
            .ok_or_else(|| lacks(&format!("strength: no line {group} in MuscleMaxForce.txt")))?;
        let strength_n = if side == Side::Middle { *strength } else { 0.5 * strength };
        let muscle = MuscleRegion { mesh: &body.mesh, volumes: &volumes, in_tissue, region, strength_n };
        let (segments, stress_pa) = muscle.segments(chains);
        let longest = chains.iter().max_by_key(|chain| chain.len()).cloned().unwrap_or_default();
        body.mesh.muscles.push(MuscleChain { name: name.clone(), nodes: longest });
        let (name, group, region, directions) = (name.clone(), group.to_owned(), region.clone(), Vec::new());
        body.muscles.push(Muscle { name, group, side, segments, region, stress_pa, directions });
    }
    body.mesh.connect();
    body.check().map_err(|fault| files.elements.wrong(None, format!("is not a valid body: {fault}")))?;
    Ok(body)
}

struct MuscleRegion<'a> {
    mesh: &'a Mesh<3>,
    volumes: &'a [f64],
    /// Number of nodes of the tissue, which come first; the others are on bone.
    in_tissue: usize,
    region: &'a [usize],
    strength_n: f64,
}

impl MuscleRegion<'_> {
    /// Volumes of the region's elements that have all of these nodes, m³.
    fn volumes_around(&self, nodes: &[usize]) -> Vec<f64> {
        let has_all = |e: &&usize| nodes.iter().all(|n| self.mesh.hexahedra[**e].contains(n));
        self.region.iter().filter(has_all).map(|&e| self.volumes[e]).collect()
    }

    /// Mean volume of the region's elements that have the first node or, if there are none, the second, m³.
    fn mean_volume_at(&self, nodes: [usize; 2]) -> Option<f64> {
        let mut around = nodes.iter().map(|n| self.volumes_around(&[*n]));
        around.find(|of| !of.is_empty()).map(|of| of.iter().sum::<f64>() / of.len() as f64)
    }

    /// The segments of fibres, and the stress (Pa) over the whole region that does the same work as their forces.
    fn segments(&self, fibres: &[Vec<usize>]) -> (Vec<Segment>, f64) {
        let mut segments = Vec::new();
        let mut whole = 0.0;
        for chain in fibres {
            let steps: Vec<[usize; 2]> = chain.windows(2).map(|w| [w[0], w[1]]).collect();
            let around: Vec<f64> = steps.iter().map(|s| self.volumes_around(s).iter().sum()).collect();
            let largest = around.iter().copied().fold(0.0, f64::max);
            whole += largest;
            for (nodes, around) in steps.into_iter().zip(around) {
                let outside = nodes.iter().any(|&n| n >= self.in_tissue);
                let volume =
                    if around > 0.0 { around } else { self.mean_volume_at(nodes).unwrap_or(largest) };
                segments.push(Segment { nodes, force_n: volume, outside });
            }
        }
        segments.iter_mut().for_each(|s| s.force_n *= self.strength_n / whole);
        let work: f64 = segments.iter().map(|s| s.force_n * self.mesh.distance(s.nodes)).sum();
        let volume: f64 = self.region.iter().map(|&e| self.volumes[e]).sum();
        (segments, work / volume)
    }
}

type ReadResult<T> = Result<T, BodyError>;

/// Position in the file of each node or element, by id.
type Ids = BTreeMap<u64, usize>;

/// Elements by name of the muscle; names by number of the muscle, each with its line.
#[derive(Default)]
struct Regions {
    names: BTreeMap<usize, (String, usize)>,
    of: BTreeMap<String, Vec<usize>>,
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

    fn once<K: Ord + Copy + Display, V>(
        &self,
        map: &mut BTreeMap<K, V>,
        what: &str,
        key: K,
        value: V,
    ) -> ReadResult<bool> {
        match map.insert(key, value) {
            None => Ok(true),
            Some(_) => Err(self.wrong(format!("{what} {key} comes twice"))),
        }
    }

    /// The rest of a line that begins with `word` in any case, up to a comment.
    fn after(&self, word: &str) -> Option<&'a str> {
        let head = self.row.get(..word.len()).filter(|head| head.eq_ignore_ascii_case(word))?;
        Some(self.row[head.len()..].split('!').next().unwrap_or_default().trim())
    }
}

fn nodes(text: &Text) -> ReadResult<(Vec<Vector3<f64>>, Ids)> {
    let (mut nodes, mut ids) = (Vec::new(), Ids::new());
    SourceLine::each(text, "nodes", |line| {
        let mut words = line.row.split_whitespace();
        let id: u64 = line.parsed(words.next(), "the id of a node")?;
        let mut coordinate = || line.finite(words.next(), "a coordinate");
        nodes.push(Vector3::new(coordinate()?, coordinate()?, coordinate()?));
        line.once(&mut ids, "node", id, nodes.len() - 1)
    })?;
    Ok((nodes, ids))
}

fn elements(text: &Text, nodes: &Ids) -> ReadResult<(Vec<[usize; 8]>, Ids)> {
    let (mut hexahedra, mut ids) = (Vec::new(), Ids::new());
    SourceLine::each(text, "hexahedra", |line| {
        let mut words = line.row.split_whitespace();
        let mut corners = [0; 8];
        for corner in &mut corners {
            *corner = line.known(nodes, "node", line.parsed(words.next(), "the id of a node")?)?;
        }
        hexahedra.push(corners);
        let id: u64 = line.parsed(words.last(), "the id of the element")?;
        line.once(&mut ids, "element", id, hexahedra.len() - 1)
    })?;
    Ok((hexahedra, ids))
}

/// Numbers of nodes, from 0, each below `count`; sorted, each once.
fn numbers(text: &Text, count: usize) -> ReadResult<Vec<usize>> {
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

fn regions(text: &Text, elements: &Ids) -> ReadResult<Regions> {
    let mut regions = Regions::default();
    let mut selected = Vec::new();
    SourceLine::each(text, "muscles", |line| {
        if let Some(rest) = line.after("muscleName(") {
            let wrong = || line.expected("a muscle like muscleName(1) = 'GGP_L'", line.row);
            let (number, name) = rest.split_once(')').ok_or_else(wrong)?;
            let number: usize = line.parsed(Some(number), "the number of a muscle")?;
            let name = name.split('\'').nth(1).ok_or_else(wrong)?.trim().to_owned();
            return line.once(&mut regions.names, "muscle", number, (name, line.number));
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
fn fibres(text: &Text, nodes: &Ids) -> ReadResult<BTreeMap<usize, Vec<Vec<usize>>>> {
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

fn strengths(text: &Text) -> ReadResult<BTreeMap<String, f64>> {
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
