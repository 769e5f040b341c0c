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

mod read;

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;

use tongue_core::body::space::{Segment, Side};
use tongue_core::body::{Body, BodyError, Bone, HYOID, MANDIBLE, Mesh, Muscle, MuscleChain};

use self::read::{elements, fibres, nodes, numbers, regions, strengths};
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
