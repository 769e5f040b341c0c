//! The body that a scene names, made into a mesh.

use nalgebra::{SVector, Vector2};
use serde::Deserialize;

use super::SceneError;
use super::file::{Block, Body, Cylinder, MeshFile};
use crate::body::gmsh::{self, Unit};
use crate::body::{self, Anatomy, Cells, Mesh, MuscleChain, solid};
use crate::muscle::Muscle;
use crate::system;

/// The palate of the reference tongue, as text.
const PALATE: &str = include_str!("../../targets/palate.toml");
/// Most cells along an edge of a solid: finer ones are a slip of the pen.
const MOST_LAYERS: f64 = 60.0;
/// Most nodes of a solid: more take minutes to order and factorise.
const MOST_NODES: usize = 12_000;

/// A mesh, and what is known of it beyond the mesh.
#[derive(Debug, Clone)]
pub struct Built<const D: usize> {
    /// What it is, in words.
    pub what: String,
    /// The mesh.
    pub mesh: Mesh<D>,
    /// Fixed nodes that the mandible carries.
    pub mandible: Vec<usize>,
    /// Fixed nodes on the hyoid bone.
    pub hyoid: Vec<usize>,
    /// The wall that goes with the body, m, if one does.
    pub palate: Option<Vec<Vector2<f64>>>,
}

/// A body in the plane or in space.
#[derive(Debug, Clone)]
pub enum AnyBody {
    /// In the midsagittal plane.
    Flat(Built<2>),
    /// In space.
    Solid(Built<3>),
}

/// Makes the mesh of a scene's body.
///
/// # Errors
/// Sizes out of range, a mesh file that cannot be read or does not hang together.
pub fn build(body: &Body) -> Result<AnyBody, SceneError> {
    Ok(match body {
        Body::Tongue(tongue) => AnyBody::Flat(reference_tongue(tongue.h_mm)?),
        Body::Mesh(given) => match given.file.to_ascii_lowercase().ends_with(".msh") {
            true => from_gmsh(&given.file, given.unit)?,
            false => AnyBody::Flat(from_json(given)?),
        },
        Body::Cylinder(c) => AnyBody::Solid(cylinder(c)?),
        Body::Block(b) => AnyBody::Solid(block(b)?),
    })
}

fn reference_tongue(h_mm: f64) -> Result<Built<2>, SceneError> {
    let anatomy = Anatomy::reference()?;
    let mesh = body::build(&anatomy, h_mm * 1e-3)?;
    let bones = gmsh::Bone::of(&anatomy, &mesh);
    let [mandible, hyoid] = ["mental_spine", "hyoid"].map(|name| gmsh::on_bone(&bones, name));
    let what = format!("the reference tongue at {h_mm} mm");
    Ok(Built { what, mandible, hyoid, palate: Some(palate()?), mesh })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Palate {
    outline_mm: Vec<[f64; 2]>,
}

fn palate() -> Result<Vec<Vector2<f64>>, SceneError> {
    let palate: Palate = toml::from_str(PALATE).map_err(|e| SceneError::Syntax {
        origin: "targets/palate.toml (embedded)".into(),
        line: 1,
        column: 1,
        problem: e.message().to_owned(),
    })?;
    Ok(palate.outline_mm.iter().map(|&[x, y]| Vector2::new(x, y) * 1e-3).collect())
}

/// What a scene needs of the output of `tongue-fit mesh --json`.
#[derive(Deserialize)]
struct MeshText {
    nodes_m: Vec<[f64; 2]>,
    triangles: Vec<Vec<usize>>,
    connections: Vec<ConnectionText>,
    fixed: Vec<usize>,
    muscles: std::collections::BTreeMap<String, Vec<usize>>,
}

#[derive(Deserialize)]
struct ConnectionText {
    nodes: [usize; 2],
}

fn from_gmsh(file: &str, unit: Unit) -> Result<AnyBody, SceneError> {
    let wrong = |problem: String| SceneError::MeshFile { file: file.to_owned(), problem };
    let bytes = std::fs::read(file).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    Ok(match gmsh::read(&bytes, file, unit)? {
        gmsh::File::Flat(body) => AnyBody::Flat(with_bones(file, body)?),
        gmsh::File::Solid(body) => AnyBody::Solid(with_bones(file, body)?),
    })
}

/// A body from Gmsh: its groups say which nodes the mandible carries and which are on the hyoid bone.
fn with_bones<const D: usize>(file: &str, body: gmsh::Body<D>) -> Result<Built<D>, SceneError> {
    system::check_size(&body.mesh).map_err(|error| SceneError::MeshFile {
        file: file.to_owned(),
        problem: format!("is of no use: {error}, or read them with [body.mesh] unit = \"mm\""),
    })?;
    let (mandible, hyoid) = (body.bone("mental_spine"), body.bone("hyoid"));
    let what = format!("the mesh of \"{file}\"");
    Ok(Built { what, mesh: body.mesh, mandible, hyoid, palate: None })
}

fn from_json(given: &MeshFile) -> Result<Built<2>, SceneError> {
    let file = given.file.as_str();
    let wrong = |problem: String| SceneError::MeshFile { file: file.to_owned(), problem };
    if given.unit != Unit::M {
        return Err(wrong("holds metres, as its keys say; leave out [body.mesh] unit".to_owned()));
    }
    let text = std::fs::read_to_string(file).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    let what = format!("the mesh of \"{file}\"");
    let mesh = mesh_from_json(&text, file)?;
    Ok(Built { what, mesh, mandible: Vec::new(), hyoid: Vec::new(), palate: None })
}

/// Reads a mesh in the plane from what `tongue-fit mesh --json` prints; `file` is what messages call the text.
///
/// # Errors
/// [`SceneError::MeshFile`] where it is no such text, [`SceneError::Fault`] where the mesh does not hang together.
pub fn mesh_from_json(text: &str, file: &str) -> Result<Mesh<2>, SceneError> {
    let wrong = |problem: String| SceneError::MeshFile { file: file.to_owned(), problem };
    let text: MeshText = serde_json::from_str(text)
        .map_err(|e| wrong(format!("is not as `tongue-fit mesh --json` prints it: {e}")))?;
    let mut mesh = Mesh {
        nodes: text.nodes_m.into_iter().map(SVector::from).collect(),
        connections: text.connections.into_iter().map(|c| c.nodes).collect(),
        fixed: text.fixed,
        ..Mesh::default()
    };
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
    mesh.cells = cells;
    mesh.muscles = text.muscles.into_iter().map(|(name, nodes)| MuscleChain { name, nodes }).collect();
    // In the order of the tables; muscles of other names after them, by name.
    mesh.muscles.sort_by_key(|m| m.name.parse::<Muscle>().map_or(usize::MAX, Muscle::index));
    mesh.check()?;
    Ok(mesh)
}

fn cylinder(c: &Cylinder) -> Result<Built<3>, SceneError> {
    let radius = positive("body.cylinder.radius_mm", c.radius_mm)?;
    let length = positive("body.cylinder.length_mm", c.length_mm)?;
    let h = positive("body.cylinder.h_mm", c.h_mm)?;
    let (rings, layers) = (divisions(radius, h)?, divisions(length, h)?);
    limited((3 * rings * (rings + 1) + 1) * (layers + 1), h)?;
    let mesh = solid::cylinder(radius * 1e-3, length * 1e-3, rings, layers);
    Ok(solid_of(mesh, format!("a cylinder of {radius} mm radius and {length} mm length at {h} mm")))
}

fn block(b: &Block) -> Result<Built<3>, SceneError> {
    let h = positive("body.block.h_mm", b.h_mm)?;
    let mut counts = [0; 3];
    for (count, size) in counts.iter_mut().zip(b.size_mm) {
        *count = divisions(positive("body.block.size_mm", size)?, h)?;
    }
    limited(counts.iter().map(|n| n + 1).product(), h)?;
    let [x, y, z] = b.size_mm;
    Ok(solid_of(
        solid::block(b.size_mm.map(|s| s * 1e-3), counts),
        format!("a block of {x} x {y} x {z} mm at {h} mm"),
    ))
}

fn solid_of(mesh: Mesh<3>, what: String) -> Built<3> {
    Built { what, mesh, mandible: Vec::new(), hyoid: Vec::new(), palate: None }
}

fn divisions(size: f64, h: f64) -> Result<usize, SceneError> {
    let count = (size / h).round().max(1.0);
    if count > MOST_LAYERS {
        let must = "at least a sixtieth of the body's extent";
        return Err(SceneError::Value { key: "body h_mm", value: h, must });
    }
    Ok(count as usize)
}

/// Refuses a solid of too many nodes.
fn limited(nodes: usize, h: f64) -> Result<(), SceneError> {
    let must = "larger, so that the body has at most 12,000 nodes";
    if nodes > MOST_NODES { Err(SceneError::Value { key: "body h_mm", value: h, must }) } else { Ok(()) }
}

/// The value, if it is positive and finite.
pub(super) fn positive(key: &'static str, value: f64) -> Result<f64, SceneError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(SceneError::Value { key, value, must: "positive and finite" })
    }
}

/// The value, if it is finite and not negative.
pub(super) fn not_negative(key: &'static str, value: f64) -> Result<f64, SceneError> {
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(SceneError::Value { key, value, must: "finite and not negative" })
    }
}

/// The value, if it is finite.
pub(super) fn finite(key: &'static str, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() { Ok(value) } else { Err(SceneError::Value { key, value, must: "finite" }) }
}
