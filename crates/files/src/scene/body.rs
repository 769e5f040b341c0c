//! The body of a scene.

use std::path::Path;

use super::file::{self, Block, Cylinder, Scene};
use super::tongue_in_space::{Operation, in_space, space_body};
use crate::run::{Kind, PlaneBody};
use crate::simulation::SimulationError;
use tongue_core::body::{Body, ContinuumSettings, solid};
use tongue_core::limits::{SIZE_MM, SPACING_MM};
use tongue_input::bodies::AnyBody;

const MOST_LAYERS: f64 = 60.0;
const MOST_NODES: usize = 12_000;

pub fn build(scene: &Scene) -> Result<AnyBody, SimulationError> {
    let body = &scene.body;
    let settings = ContinuumSettings::default();
    let made = match body {
        file::SceneBody::Tongue(tongue) => {
            let spacing_m = Some(tongue.h_mm * 1e-3);
            let made = PlaneBody { kind: tongue.kind, spacing_m, ..PlaneBody::default() };
            return Ok(AnyBody::Flat(made.make(&mut |_| ())?));
        }
        file::SceneBody::TongueInSpace(given) => {
            let left = Operation::of(scene)?.map(|operation| operation.operated.body);
            AnyBody::Solid(in_space(given, left.map_or_else(|| space_body(given), Ok)?)?)
        }
        file::SceneBody::Mesh(given) => AnyBody::read(Path::new(&given.file), given.unit)?,
        file::SceneBody::Cylinder(c) => AnyBody::Solid(cylinder(c)?),
        file::SceneBody::Block(b) => AnyBody::Solid(block(b)?),
    };
    if body.kind() == Kind::Springs {
        return Ok(made);
    }
    Ok(match made {
        AnyBody::Flat(flat) => AnyBody::Flat(flat.into_continuum(&settings)?),
        // Muscles of solids are given fibre by fibre.
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
    limited((3 * rings * (rings + 1) + 1) * (layers + 1), h)?;
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
    limited(counts.iter().map(|n| n + 1).product(), h)?;
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

fn limited(nodes: usize, h: f64) -> Result<(), SimulationError> {
    let must = "larger, so that the body has at most 12,000 nodes";
    if nodes > MOST_NODES { Err(SimulationError::value("body h_mm", h, must)) } else { Ok(()) }
}
