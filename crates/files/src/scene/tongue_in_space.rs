//! The tongue in space of a scene, before and after surgery.

use std::path::Path;

use super::file::{Scene, SceneBody, SceneSpace};
use crate::simulation::SimulationError;
use tongue_core::body::space::Operated;
use tongue_core::body::{Body, DEFAULT_SPACING_M};
use tongue_input::bodies::{artisynth, gmsh};
use tongue_input::files;

/// A tongue in space in the axes of scenes. The built-in one has the palate of the reference tongue, as a wall without end to both sides.
pub(super) fn in_space(given: &SceneSpace, tongue: Body<3>) -> Result<Body<3>, SimulationError> {
    let is_built_in = given.folder.is_none() && given.file.is_none();
    let palate = if is_built_in { Body::tongue(DEFAULT_SPACING_M)?.palate } else { None };
    Ok(Body { palate, ..tongue.in_scene() })
}

/// A tongue in space in its own axes, before any surgery.
pub(super) fn space_body(given: &SceneSpace) -> Result<Body<3>, SimulationError> {
    let body = match (&given.folder, &given.file) {
        (Some(_), Some(_)) => {
            let why = "each is a body; give one of them";
            return Err(SimulationError::contradiction(
                "body.tongue-in-space.folder",
                "body.tongue-in-space.file",
                why,
            ));
        }
        (None, None) => return Ok(Body::tongue_in_space(if given.refined { 2 } else { 1 })?),
        (Some(folder), None) => artisynth::read(Path::new(folder))?,
        (None, Some(file)) => {
            let bytes = files::read(Path::new(file))
                .map_err(|source| SimulationError::unread("body.tongue-in-space.file", file, &source))?;
            gmsh::read_space(&bytes, file, given.unit)?
        }
    };
    Ok(if given.refined { body.refined() } else { body })
}

/// A tongue before and after its surgery, in its own axes.
#[derive(Debug)]
pub struct Operation {
    pub(super) whole: Body<3>,
    pub(super) operated: Operated,
}

impl Operation {
    pub(super) fn of(scene: &Scene) -> Result<Option<Self>, SimulationError> {
        let Some(surgery) = &scene.surgery else { return Ok(None) };
        let SceneBody::TongueInSpace(given) = &scene.body else {
            return Err(SimulationError::contradiction(
                "[surgery]",
                scene.body_key(),
                "only a tongue in space is operated",
            ));
        };
        let whole = space_body(given)?;
        let operated = surgery.operate(&whole).map_err(SimulationError::in_surgery)?;
        Ok(Some(Self { whole, operated }))
    }
}

/// Activations of the muscles of a tongue, `left` by surgery if there was any.
pub(super) fn activations<const D: usize>(
    scene: &Scene,
    operation: Option<&Operation>,
    left: &Body<D>,
) -> Result<Vec<f64>, SimulationError> {
    let given: Vec<_> = scene.activations.iter().map(|(name, a)| (name, *a)).collect();
    let refused = |wrong| SimulationError::Refused(format!("activations: {wrong}"));
    let Some(Operation { whole, operated }) = operation else {
        return left.activations(&given).map_err(refused);
    };
    let all = whole.activations(&given).map_err(refused)?;
    Ok(operated.muscles.iter().map(|&m| all[m]).collect())
}
