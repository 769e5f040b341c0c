//! The vocal tract around the tongue of a scene, with jaw, hyoid and lips.

use std::any::Any;

use super::JOINT_MM;
use super::effects::{Hyoid, Jaw};
use super::file::{Scene, SceneTract, Want};
use crate::simulation::SimulationError;
use tongue_core::body::Body;
use tongue_infer::acoustics::{Articulation, VocalTract, VocalTractError};
use tongue_input::files;

pub(super) fn posture(scene: &Scene) -> Articulation {
    let tract = scene.tract.clone().unwrap_or_default();
    Articulation {
        jaw_deg: scene.effects.jaw.as_ref().map_or(0.0, |j| j.opening_deg),
        hyoid_mm: scene.effects.hyoid.as_ref().map_or([0.0; 2], |h| h.shift_mm),
        lip_opening_mm: tract.lip_opening_mm,
        lip_protrusion_mm: tract.lip_protrusion_mm,
    }
}

/// The tract around the body of a scene; `None` if the scene has none, or wants only a shape or lengths.
pub(super) fn vocal_tract<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
) -> Result<Option<VocalTract>, SimulationError> {
    let Some(wanted) =
        scene.tract.as_ref().filter(|_| scene.want != Want::Shape && scene.want != Want::Lengths)
    else {
        return Ok(None);
    };
    let mut tract = match &wanted.file {
        None => VocalTract::reference()?,
        Some(path) => {
            let text = files::read_text(path)
                .map_err(|e| SimulationError::Refused(format!("tract.file: cannot read \"{path}\": {e}")))?;
            VocalTract::read(&text, path)?
        }
    };
    tract.jaw.joint_mm = scene.effects.jaw.as_ref().map_or(JOINT_MM, |j| j.joint_mm);
    let flat = (body as &dyn Any).downcast_ref::<Body<2>>();
    match flat.map_or(Err(VocalTractError::NoSurface), |body| VocalTract::round(body, tract)) {
        Err(why @ VocalTractError::NoSurface) => {
            Err(SimulationError::contradiction("[tract]", scene.body_key(), why))
        }
        airway => Ok(Some(airway?)),
    }
}

impl Scene {
    /// The same scene with the jaw, hyoid and lips of `posture`, and with sound as its wanted result.
    #[must_use]
    pub fn spoken(mut self, posture: &Articulation, joint_mm: [f64; 2]) -> Self {
        self.want = Want::Sound;
        self.effects.incompressibility = Some(true);
        self.effects.jaw = (posture.jaw_deg != 0.0).then_some(Jaw { opening_deg: posture.jaw_deg, joint_mm });
        self.effects.hyoid = (posture.hyoid_mm != [0.0; 2]).then_some(Hyoid { shift_mm: posture.hyoid_mm });
        self.tract = Some(SceneTract {
            lip_opening_mm: posture.lip_opening_mm,
            lip_protrusion_mm: posture.lip_protrusion_mm,
            ..self.tract.unwrap_or_default()
        });
        self
    }
}
