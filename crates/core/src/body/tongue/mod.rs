//! The mesher of tongues: from an outline, muscle lines and bones ([`Anatomy`]) to nodes, connections and triangles.

mod anatomy;
mod anchors;
mod build;
mod frame;
mod smooth;

use serde::Deserialize;

use super::{BodyError, Bone, Mesh};
use crate::geometry::Point;

pub use anatomy::{Anatomy, AnatomyBone, MuscleLine, OutsidePart, REFERENCE};
pub use build::{DEFAULT_SPACING_M, build};

/// The bones of a mesh from an anatomy: the fixed nodes at the points of each.
pub(super) fn bones(anatomy: &Anatomy, mesh: &Mesh<2>) -> Vec<Bone> {
    let bones = anatomy.bones().iter().map(|bone| {
        let at = |n: &usize| bone.points.iter().any(|p| (mesh.nodes[*n] - *p).norm() < anatomy::SAME_POINT_M);
        Bone { name: bone.name.clone(), nodes: mesh.fixed.iter().copied().filter(at).collect() }
    });
    bones.collect()
}

/// The palate of the reference tongue, m.
pub(super) fn palate() -> Result<Vec<Point>, BodyError> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Palate {
        outline_mm: Vec<[f64; 2]>,
    }
    let palate: Palate = toml::from_str(include_str!("../../../../../targets/palate.toml"))
        .map_err(|e| BodyError::file("targets/palate.toml", e.message()))?;
    Ok(palate.outline_mm.iter().map(|&[x, y]| Point::new(x, y) * 1e-3).collect())
}
