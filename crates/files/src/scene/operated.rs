//! Scenes with surgery: the body after it, and what it changed.

use std::any::Any;

use nalgebra::Vector3;

use super::body::space_body;
use super::file::{Scene, SceneBody};
use super::prepare::Prepared;
use super::run::simulate;
use super::{SceneError, contradiction};
use crate::report::OperationRecord;
use crate::surgery::Surgery;
use tongue_core::body::SpaceBody;
use tongue_core::body::space::Operated;
use tongue_core::system::System;

/// The body of a scene before and after its surgery, in its own axes.
fn operated(scene: &Scene, surgery: &Surgery) -> Result<(SpaceBody, Operated), SceneError> {
    let SceneBody::TongueInSpace(given) = &scene.body else {
        return Err(contradiction("[surgery]", scene.body_key(), "only a tongue in space is operated"));
    };
    let whole = space_body(given)?;
    let operated = surgery.operate(&whole)?;
    Ok((whole, operated))
}

/// The tongue of a scene in its own axes, after surgery if there is any.
pub(super) fn tongue(scene: &Scene, given: &super::file::SceneSpace) -> Result<SpaceBody, SceneError> {
    match &scene.surgery {
        Some(surgery) => Ok(operated(scene, surgery)?.1.body),
        None => space_body(given),
    }
}

/// Activations of the muscles that surgery left.
pub(super) fn activations(scene: &Scene, left: &SpaceBody) -> Result<Vec<f64>, SceneError> {
    let given: Vec<_> = scene.activations.iter().map(|(name, a)| (name, *a)).collect();
    let Some(surgery) = &scene.surgery else { return Ok(left.activations(&given)?) };
    let (whole, operated) = operated(scene, surgery)?;
    let all = whole.activations(&given)?;
    Ok(operated.muscles.into_iter().map(|m| all[m]).collect())
}

/// What surgery changed: the same scene without it is run too. `after` are the positions of all nodes, m, in the axes of the scene.
pub(super) fn compared<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    after: &[nalgebra::SVector<f64, D>],
) -> Result<Option<OperationRecord>, SceneError> {
    let Some(surgery) = &scene.surgery else { return Ok(None) };
    let system: &dyn Any = &*prepared.system;
    let (Some(system), Some(body)) = (system.downcast_ref::<System<3>>(), &prepared.body.space) else {
        return Ok(None);
    };
    let (whole, operated) = operated(scene, surgery)?;
    let before = simulate(&Scene { surgery: None, ..scene.clone() })?;
    if !before.converged {
        return Err(contradiction(
            "[surgery]",
            "the scene before it",
            "that did not converge, so there is nothing to compare with; make its activations or loads smaller",
        ));
    }
    let before: Vec<Vector3<f64>> =
        before.positions_m.iter().map(|p| Vector3::from_column_slice(p)).collect();
    let own = |x: &[Vector3<f64>]| x.iter().map(|p| Vector3::new(p.x, -p.z, p.y)).collect::<Vec<_>>();
    let after: Vec<Vector3<f64>> = after.iter().map(|p| Vector3::from_fn(|axis, _| p[axis])).collect();
    let mut record = surgery.record(&whole, &operated, [&own(&before), &own(&after)]);
    surgery.make_up(&mut record, whole.foremost(), (body, system), &before)?;
    Ok(Some(record))
}
