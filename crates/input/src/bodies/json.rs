//! Bodies in the plane as JSON: reads and writes the format of `tongue-fit mesh --json`.

use std::collections::BTreeMap;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::measured::ByMuscle;
use crate::measured::muscles::Muscles;
use tongue_core::body::{Body, BodyError, Bone, Cells, Mesh, MuscleChain, Quality};
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

/// The parts that are read; the rest is computed from them.
#[derive(Deserialize)]
struct MeshText {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<Ends>,
    fixed: Vec<usize>,
    muscles: BTreeMap<String, Vec<usize>>,
    #[serde(default)]
    bones: BTreeMap<String, Vec<usize>>,
}

#[derive(Deserialize)]
struct Ends {
    nodes: [usize; 2],
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
    let bones: Vec<Bone> = text.bones.into_iter().map(|(name, nodes)| Bone { name, nodes }).collect();
    for bone in &bones {
        if let Some(node) = bone.nodes.iter().find(|n| mesh.fixed.binary_search(n).is_err()) {
            return Err(wrong(format!("has node {node} on bone \"{}\", but not under \"fixed\"", bone.name)));
        }
    }
    Ok(Body { what: format!("the mesh of \"{file}\""), mesh, bones, ..Body::default() })
}
