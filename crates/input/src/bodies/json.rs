//! Bodies in the plane as JSON: reads and writes the format of `tongue-fit mesh --json`.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::measured::ByMuscle;
use crate::measured::muscles::Muscles;
use tongue_core::body::{Body, BodyError, Bone, Cells, Mesh, MuscleChain, Quality};
use tongue_core::material::Constants;
use tongue_core::statistics;
use tongue_core::system::{self, Model, SystemError};
use tongue_core::toml_text::reworded;

#[derive(Serialize)]
struct JsonConnection {
    nodes: [usize; 2],
    rest_length_m: f64,
    stiffness_n_per_m: f64,
}

#[derive(Serialize)]
pub struct MeshRecord {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<JsonConnection>,
    fixed: Vec<usize>,
    muscles: ByMuscle<Vec<usize>>,
    bones: ByMuscle<Vec<usize>>,
    kappa_s_j: f64,
    node_mass_kg: f64,
    rest_lengths_mm: ByMuscle<f64>,
    quality: Quality,
}

impl MeshRecord {
    /// The record of a body of this material, with its spring constants, areal stiffness and masses.
    pub fn of(body: &Body<2>, model: &Model) -> Result<Self, SystemError> {
        let mesh = &body.mesh;
        let coefficients = system::coefficients(mesh, model)?;
        let stiffness = system::connection_stiffness(mesh, &coefficients);
        let connections = mesh.connections.iter().zip(&stiffness).map(|(&nodes, &stiffness_n_per_m)| {
            JsonConnection { nodes, rest_length_m: mesh.distance(nodes), stiffness_n_per_m }
        });
        let lengths = mesh.muscles.iter().map(|m| (m.name.clone(), mesh.distance(m.ends()) * 1e3));
        Ok(Self {
            nodes_m: mesh.nodes.iter().map(|p| [p.x, p.y]).collect(),
            triangles: mesh.cells.iter().map(<[usize]>::to_vec).collect(),
            connections: connections.collect(),
            fixed: mesh.fixed.clone(),
            muscles: ByMuscle(mesh.muscles.iter().map(|m| (m.name.clone(), m.nodes.clone())).collect()),
            bones: ByMuscle(body.bones.iter().map(|b| (b.name.clone(), b.nodes.clone())).collect()),
            kappa_s_j: coefficients.kappa,
            node_mass_kg: coefficients.node_mass,
            rest_lengths_mm: ByMuscle(lengths.collect()),
            quality: Quality::of(mesh),
        })
    }
}

/// The parts that are read. The optional ones are computed from the others, and must be those of the body.
#[derive(Deserialize)]
struct MeshText {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<ConnectionText>,
    fixed: Vec<usize>,
    muscles: BTreeMap<String, Vec<usize>>,
    #[serde(default)]
    bones: BTreeMap<String, Vec<usize>>,
    kappa_s_j: Option<f64>,
    node_mass_kg: Option<f64>,
    #[serde(default)]
    rest_lengths_mm: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
struct ConnectionText {
    nodes: [usize; 2],
    rest_length_m: Option<f64>,
    stiffness_n_per_m: Option<f64>,
}

/// The largest relative difference of a value from that of the body.
const ROUNDING: f64 = 1e-6;

fn is_near(given: f64, own: f64) -> bool {
    (given - own).abs() <= ROUNDING * own.abs()
}

/// Values of a file that the program computes itself, each with its name and that of the body of these constants.
struct ComputedValues {
    rest_lengths_m: Vec<Option<f64>>,
    stiffness: Vec<Option<f64>>,
    kappa: Option<f64>,
    node_mass: Option<f64>,
    muscles_mm: BTreeMap<String, f64>,
}

impl ComputedValues {
    /// The constants of the file: its spring constant (of most connections) says which Poisson's ratio it was written with.
    fn constants(&self, mesh: &Mesh<2>) -> Constants {
        let usual = Constants::TONGUE;
        let given = statistics::upper_median(self.stiffness.iter().flatten().copied());
        let of = |constants| system::coefficients(mesh, &Model { constants }).ok();
        // On equilateral triangles the spring constant is a multiple of the shear modulus E / 2(1 + nu).
        let ratio = |k: f64| of(usual).map(|c| (1.0 + usual.poisson_ratio) * c.tissue_stiffness / k - 1.0);
        let own = given.and_then(ratio).map(|poisson_ratio| Constants { poisson_ratio, ..usual });
        let is_of_kappa =
            |own: &Constants| of(*own).is_some_and(|c| self.kappa.is_none_or(|k| is_near(k, c.kappa)));
        own.filter(is_of_kappa).unwrap_or(usual)
    }

    /// The first value that is not that of the body.
    fn fault(&self, mesh: &Mesh<2>) -> Option<String> {
        let coefficients = system::coefficients(mesh, &Model { constants: self.constants(mesh) }).ok()?;
        let stiffness = system::connection_stiffness(mesh, &coefficients);
        let lengths = mesh.connections.iter().map(|&nodes| mesh.distance(nodes));
        let of_connection = |key: &'static str| {
            move |(i, (given, own)): (usize, (&Option<f64>, f64))| {
                Some((format!("{key} of connection {i}"), (*given)?, own))
            }
        };
        let lengths = self.rest_lengths_m.iter().zip(lengths).enumerate();
        let stiffness = self.stiffness.iter().zip(stiffness).enumerate();
        let muscles = mesh.muscles.iter().filter_map(|m| {
            let own = mesh.distance(m.ends()) * 1e3;
            Some((format!("rest_lengths_mm of {}", m.name), *self.muscles_mm.get(&m.name)?, own))
        });
        let whole = [
            ("kappa_s_j", self.kappa, coefficients.kappa),
            ("node_mass_kg", self.node_mass, coefficients.node_mass),
        ];
        let whole = whole.into_iter().filter_map(|(key, given, own)| Some((key.to_owned(), given?, own)));
        let all = lengths.filter_map(of_connection("rest_length_m"));
        let all =
            all.chain(stiffness.filter_map(of_connection("stiffness_n_per_m"))).chain(muscles).chain(whole);
        let is_other = |(_, given, own): &(String, f64, f64)| !is_near(*given, *own);
        let (what, given, own) = { all }.find(is_other)?;
        Some(format!(
            "has {what} = {given}, but that of this body is {own}, and the program computes it; leave it out, or correct what it follows from"
        ))
    }
}

/// Reads a body; `file` is its name in messages.
pub fn read(text: &str, file: &str) -> Result<Body<2>, BodyError> {
    let wrong = |problem: String| BodyError::file(file, problem);
    let text: MeshText = serde_json::from_str(text).map_err(|e| {
        wrong(format!("is not as `tongue-fit mesh --json` prints it: {}", reworded(&e.to_string())))
    })?;
    if text.triangles.is_empty() {
        return Err(wrong(
            "has no triangles, so there is no tissue; list them under \"triangles\"".to_owned(),
        ));
    }
    let mut cells = Cells::new();
    for (number, triangle) in text.triangles.iter().enumerate() {
        if !cells.push(triangle) {
            return Err(wrong(format!("gives triangle {number} {} nodes; give it three", triangle.len())));
        }
    }
    let mut muscles: Vec<MuscleChain> =
        text.muscles.into_iter().map(|(name, nodes)| MuscleChain { name, nodes }).collect();
    // Published muscles in the order of the tables, then others by name.
    let known = Muscles::built_in();
    muscles.sort_by_key(|m| known.published(&m.name).map_or(usize::MAX, |(place, _)| place));
    let given = ComputedValues {
        rest_lengths_m: text.connections.iter().map(|c| c.rest_length_m).collect(),
        stiffness: text.connections.iter().map(|c| c.stiffness_n_per_m).collect(),
        kappa: text.kappa_s_j,
        node_mass: text.node_mass_kg,
        muscles_mm: text.rest_lengths_mm,
    };
    let mesh = Mesh {
        nodes: text.nodes_m.into_iter().map(Vector2::from).collect(),
        cells,
        connections: text.connections.into_iter().map(|c| c.nodes).collect(),
        muscles,
        fixed: text.fixed,
        continuum: None,
        hexahedra: Vec::new(),
    };
    mesh.check().map_err(|fault| wrong(format!("is faulty: {fault}")))?;
    if let Some(fault) = given.fault(&mesh) {
        return Err(wrong(fault));
    }
    let bones: Vec<Bone> = text.bones.into_iter().map(|(name, nodes)| Bone { name, nodes }).collect();
    for bone in &bones {
        if let Some(node) = bone.nodes.iter().find(|n| mesh.fixed.binary_search(n).is_err()) {
            return Err(wrong(format!("has node {node} on bone \"{}\", but not under \"fixed\"", bone.name)));
        }
    }
    Ok(Body { what: format!("the mesh of \"{file}\""), mesh, bones, ..Body::default() })
}
