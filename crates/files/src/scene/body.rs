//! The body of a scene, with its surgery.

use std::path::Path;

use super::file::{Block, Cylinder, Scene, SceneBody, SceneSpace};
use crate::run::{Kind, PlaneBody, SpaceSource};
use crate::simulation::SimulationError;
use crate::surgery::Operation;
use tongue_core::body::{Body, ContinuumSettings, DEFAULT_SPACING_M, solid};
use tongue_core::limits::{SIZE_MM, SPACING_MM};
use tongue_input::bodies::{AnyBody, MeshContent};

const MOST_LAYERS: f64 = 60.0;
const MOST_NODES: usize = 12_000;

/// Checks a scene and makes its body; `tell` gets what a mesh file gives reason to doubt.
pub fn build(scene: &Scene, tell: &mut dyn FnMut(String)) -> Result<AnyBody, SimulationError> {
    scene.check()?;
    let body = &scene.body;
    let settings = ContinuumSettings::default();
    let made = match body {
        SceneBody::Tongue(tongue) => {
            let spacing_m = Some(tongue.h_mm * 1e-3);
            let made = PlaneBody { kind: tongue.kind, spacing_m, ..PlaneBody::default() };
            return Ok(AnyBody::Flat(made.make(&mut |_| ())?));
        }
        SceneBody::TongueInSpace(given) => {
            let operated = operation(scene)?.map(|operation| operation.body().clone());
            AnyBody::Solid(in_space(given, operated.map_or_else(|| space_body(given), Ok)?)?)
        }
        SceneBody::Mesh(given) => {
            MeshContent::read(Path::new(&given.file), given.unit)?.body(&given.file, tell)?
        }
        SceneBody::Cylinder(c) => AnyBody::Solid(cylinder(c)?),
        SceneBody::Block(b) => AnyBody::Solid(block(b)?),
    };
    if body.kind() == Kind::Springs {
        return Ok(made);
    }
    Ok(match made {
        AnyBody::Flat(flat) => AnyBody::Flat(flat.into_continuum(&settings)?),
        // In a solid each fibre is a muscle of its own, without a width.
        AnyBody::Solid(solid) => {
            let settings = ContinuumSettings { bundle_width_m: 0.0, ..settings };
            AnyBody::Solid(solid.into_continuum(&settings)?)
        }
    })
}

fn cylinder(c: &Cylinder) -> Result<Body<3>, SimulationError> {
    let &Cylinder { radius_mm: radius, length_mm: length, h_mm: h, .. } = c;
    SIZE_MM.check(radius)?;
    SIZE_MM.check(length)?;
    SPACING_MM.check(h)?;
    let (rings, layers) = (divisions(radius, h)?, divisions(length, h)?);
    check_node_count((3 * rings * (rings + 1) + 1) * (layers + 1), h)?;
    let mesh = solid::cylinder(radius * 1e-3, length * 1e-3, rings, layers);
    Ok(Body::new(format!("a cylinder of {radius} mm radius and {length} mm length at {h} mm"), mesh))
}

fn block(b: &Block) -> Result<Body<3>, SimulationError> {
    let h = b.h_mm;
    SPACING_MM.check(h)?;
    let mut counts = [0; 3];
    for (count, size) in counts.iter_mut().zip(b.size_mm) {
        SIZE_MM.check(size)?;
        *count = divisions(size, h)?;
    }
    check_node_count(counts.iter().map(|n| n + 1).product(), h)?;
    let [x, y, z] = b.size_mm;
    let mesh = solid::block(b.size_mm.map(|s| s * 1e-3), counts);
    Ok(Body::new(format!("a block of {x} x {y} x {z} mm at {h} mm"), mesh))
}

fn divisions(size: f64, h: f64) -> Result<usize, SimulationError> {
    let count = (size / h).round().max(1.0);
    if count > MOST_LAYERS {
        let must = "at least a sixtieth of the body's extent";
        return Err(SimulationError::value("body h_mm", h, must));
    }
    Ok(count as usize)
}

fn check_node_count(nodes: usize, h: f64) -> Result<(), SimulationError> {
    let must = "larger, so that the body has at most 12,000 nodes";
    if nodes > MOST_NODES { Err(SimulationError::value("body h_mm", h, must)) } else { Ok(()) }
}

/// A tongue in space in the axes of scenes. The built-in one gets the palate of the reference tongue, unbounded to both sides.
pub(super) fn in_space(given: &SceneSpace, tongue: Body<3>) -> Result<Body<3>, SimulationError> {
    let is_built_in = given.folder.is_none() && given.file.is_none();
    let palate = if is_built_in { Body::tongue(DEFAULT_SPACING_M)?.palate } else { None };
    Ok(Body { palate, ..tongue.in_scene() })
}

/// A tongue in space in its own axes, before any surgery.
pub(super) fn space_body(given: &SceneSpace) -> Result<Body<3>, SimulationError> {
    let source = match (&given.folder, &given.file) {
        (Some(_), Some(_)) => {
            let [folder, file] = ["body.tongue-in-space.folder", "body.tongue-in-space.file"];
            return Err(SimulationError::contradiction(folder, file, "each is a body; give one of them"));
        }
        (None, None) => SpaceSource::BuiltIn,
        (Some(folder), None) => SpaceSource::Folder(folder.into()),
        (None, Some(file)) => SpaceSource::Mesh(file.into()),
    };
    Ok(source.make(given.unit, given.refined)?)
}

/// The surgery of a scene; `None` if it has none. [`Scene::check`] allows it for tongues in space only.
pub(super) fn operation(scene: &Scene) -> Result<Option<Operation>, SimulationError> {
    let (Some(surgery), SceneBody::TongueInSpace(given)) = (&scene.surgery, &scene.body) else {
        return Ok(None);
    };
    Operation::new(surgery, space_body(given)?).map(Some).map_err(SimulationError::in_surgery)
}
