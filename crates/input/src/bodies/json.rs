//! Bodies in the plane as JSON, in the format of `tongue-fit mesh --json`.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::measured::ByMuscle;
use crate::measured::muscles::Muscles;
use tongue_core::body::{Body, BodyError, Bone, Cells, Mesh, MuscleChain, Quality};
use tongue_core::statistics;
use tongue_core::system::{self, Model, SystemError};
use tongue_core::toml_text::reworded;

/// A connection of two nodes. Optional values are compared with those of the body if the file has them.
#[derive(Serialize, Deserialize)]
struct ConnectionRecord {
    nodes: [usize; 2],
    rest_length_m: Option<f64>,
    stiffness_n_per_m: Option<f64>,
}

/// A body with the stiffness and masses of its material. Values that the program computes may be left out of a file; those that it has are
/// compared with the body's.
#[derive(Serialize, Deserialize)]
pub struct MeshRecord {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<ConnectionRecord>,
    fixed: Vec<usize>,
    muscles: ByMuscle<Vec<usize>>,
    #[serde(default)]
    bones: ByMuscle<Vec<usize>>,
    kappa_s_j: Option<f64>,
    node_mass_kg: Option<f64>,
    #[serde(default)]
    rest_lengths_mm: ByMuscle<f64>,
    #[serde(skip_deserializing)]
    quality: Option<Quality>,
}

/// Largest relative difference between a value of the file and that of the body.
const ROUNDING: f64 = 1e-6;

fn is_near(given: f64, own: f64) -> bool {
    (given - own).abs() <= ROUNDING * own.abs()
}

impl MeshRecord {
    pub fn of(body: &Body<2>, model: &Model) -> Result<Self, SystemError> {
        let mesh = &body.mesh;
        let coefficients = system::coefficients(mesh, model)?;
        let stiffness = system::connection_stiffness(mesh, &coefficients);
        let connections = mesh.connections.iter().zip(stiffness).map(|(&nodes, stiffness)| {
            let rest_length_m = Some(mesh.distance(nodes));
            ConnectionRecord { nodes, rest_length_m, stiffness_n_per_m: Some(stiffness) }
        });
        let lengths = mesh.muscles.iter().map(|m| (m.name.clone(), mesh.distance(m.ends()) * 1e3));
        Ok(Self {
            nodes_m: mesh.nodes.iter().map(|p| [p.x, p.y]).collect(),
            triangles: mesh.cells.iter().map(<[usize]>::to_vec).collect(),
            connections: connections.collect(),
            fixed: mesh.fixed.clone(),
            muscles: ByMuscle(mesh.muscles.iter().map(|m| (m.name.clone(), m.nodes.clone())).collect()),
            bones: ByMuscle(body.bones.iter().map(|b| (b.name.clone(), b.nodes.clone())).collect()),
            kappa_s_j: Some(coefficients.kappa),
            node_mass_kg: Some(coefficients.node_mass),
            rest_lengths_mm: ByMuscle(lengths.collect()),
            quality: Some(Quality::of(mesh)),
        })
    }

    /// The values that the program computes, each with its name in messages.
    fn computed(&self) -> impl Iterator<Item = (String, f64)> {
        let of_connections = |key: &'static str, of: fn(&ConnectionRecord) -> Option<f64>| {
            let all = self.connections.iter().enumerate();
            all.filter_map(move |(i, c)| Some((format!("{key} of connection {i}"), of(c)?)))
        };
        let muscles = self.rest_lengths_mm.0.iter().map(|(m, mm)| (format!("rest_lengths_mm of {m}"), *mm));
        let whole = [("kappa_s_j", self.kappa_s_j), ("node_mass_kg", self.node_mass_kg)];
        of_connections("rest_length_m", |c| c.rest_length_m)
            .chain(of_connections("stiffness_n_per_m", |c| c.stiffness_n_per_m))
            .chain(muscles)
            .chain(whole.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))))
    }

    /// The material of a file: Poisson's ratio follows from the median of the spring constants unless the file's kappa contradicts it;
    /// then, or without spring constants, it is that of [`Model::default()`].
    fn model(&self, mesh: &Mesh<2>) -> Model {
        let usual = Model::default();
        let given = statistics::median(self.connections.iter().filter_map(|c| c.stiffness_n_per_m));
        let of = |model| system::coefficients(mesh, &model).ok();
        // On equilateral triangles the spring constant is proportional to the shear modulus E / (2 (1 + nu)).
        let ratio = |k: f64| of(usual).map(|c| (1.0 + usual.poisson_ratio) * c.tissue_stiffness / k - 1.0);
        let own = given.and_then(ratio).map(|poisson_ratio| Model { poisson_ratio, ..usual });
        let is_of_kappa =
            |own: &Model| of(*own).is_some_and(|c| self.kappa_s_j.is_none_or(|k| is_near(k, c.kappa)));
        own.filter(is_of_kappa).unwrap_or(usual)
    }

    /// The first value of the file that is not that of the body, as a message.
    fn fault(&self, body: &Body<2>) -> Option<String> {
        let given: BTreeMap<String, f64> = self.computed().collect();
        let own = Self::of(body, &self.model(&body.mesh)).ok()?;
        let mut both = own.computed().filter_map(|(what, own)| Some((*given.get(&what)?, own, what)));
        let (given, own, what) = both.find(|(given, own, _)| !is_near(*given, *own))?;
        Some(format!(
            "has {what} = {given}, but that of this body is {own}, and the program computes it; leave it out, or correct what it follows from"
        ))
    }
}

/// `file` is the name of the body in messages.
pub fn read(text: &str, file: &str) -> Result<Body<2>, BodyError> {
    let wrong = |problem: String| BodyError::file(file, problem);
    let given: MeshRecord = serde_json::from_str(text).map_err(|e| {
        wrong(format!("is not as `tongue-fit mesh --json` prints it: {}", reworded(&e.to_string())))
    })?;
    if given.triangles.is_empty() {
        let problem = "has no triangles, so there is no tissue; list them under \"triangles\"";
        return Err(wrong(problem.to_owned()));
    }
    let mut cells = Cells::new();
    for (number, triangle) in given.triangles.iter().enumerate() {
        if !cells.push(triangle) {
            return Err(wrong(format!("gives triangle {number} {} nodes; give it three", triangle.len())));
        }
    }
    let named = |all: &ByMuscle<Vec<usize>>| all.0.clone().into_iter();
    let mut muscles: Vec<MuscleChain> =
        named(&given.muscles).map(|(name, nodes)| MuscleChain { name, nodes }).collect();
    // The published muscles come first, in the order of the tables, then others by name.
    let known = Muscles::built_in();
    muscles.sort_by_key(|m| known.published(&m.name).map_or(usize::MAX, |(place, _)| place));
    let mesh = Mesh {
        nodes: given.nodes_m.iter().copied().map(Vector2::from).collect(),
        cells,
        connections: given.connections.iter().map(|c| c.nodes).collect(),
        muscles,
        fixed: given.fixed.clone(),
        ..Mesh::default()
    };
    mesh.check().map_err(|fault| wrong(format!("is faulty: {fault}")))?;
    let bones = named(&given.bones).map(|(name, nodes)| Bone { name, nodes }).collect();
    let body = Body { what: format!("the mesh of \"{file}\""), mesh, bones, ..Body::default() };
    if let Some(fault) = given.fault(&body) {
        return Err(wrong(fault));
    }
    for bone in &body.bones {
        if let Some(node) = bone.nodes.iter().find(|n| body.mesh.fixed.binary_search(n).is_err()) {
            return Err(wrong(format!("has node {node} on bone \"{}\", but not under \"fixed\"", bone.name)));
        }
    }
    Ok(body)
}
