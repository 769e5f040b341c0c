//! The tract around the tongue of a scene with its jaw, hyoid and lips, and its formants with their derivatives by tensions.

use std::any::Any;
use std::io;

use nalgebra::SVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::JOINT_MM;
use super::effects::{Hyoid, Jaw};
use super::file::{Scene, Want};
use super::prepare::Prepared;
use crate::report::{FormantsByTension, SoundRecord};
use crate::simulation::SimulationError;
use tongue_core::body::Body;
use tongue_core::statics::{Response, Workspace};
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

/// The tract around the body of a scene; `None` if no sound is wanted.
pub(super) fn airway<const D: usize>(
    scene: &Scene,
    body: &Body<D>,
) -> Result<Option<VocalTract>, SimulationError> {
    let Some(wanted) =
        scene.tract.as_ref().filter(|_| scene.want != Want::Shape && scene.want != Want::Lengths)
    else {
        return Ok(None);
    };
    let mut tract = match &wanted.file {
        None => VocalTract::drawn()?,
        Some(path) => {
            let text = files::read(path).and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other));
            let text = text.map_err(|source| SimulationError::unread("tract.file", path, &source))?;
            VocalTract::read(&text, path)?
        }
    };
    tract.jaw.joint_mm = scene.effects.jaw.as_ref().map_or(JOINT_MM, |j| j.joint_mm);
    let flat = (body as &dyn Any).downcast_ref::<Body<2>>();
    let round = flat.map(|body| VocalTract::round(body, tract));
    match round {
        Some(Err(VocalTractError::NoSurface)) | None => {
            let why = VocalTractError::NoSurface.to_string();
            Err(SimulationError::contradiction("[tract]", scene.body_key(), why))
        }
        Some(airway) => Ok(Some(airway?)),
    }
}

/// The tract around the tongue. `effects.jaw` and `effects.hyoid` move its jaw and larynx.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneTract {
    /// Its file, from the current folder; by default the tract of the reference tongue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Height of the opening between the lips, mm.
    #[serde(default = "default_opening")]
    pub lip_opening_mm: f64,
    /// Protrusion of the lips, mm.
    #[serde(default)]
    pub lip_protrusion_mm: f64,
}

impl Default for SceneTract {
    fn default() -> Self {
        Self { file: None, lip_opening_mm: default_opening(), lip_protrusion_mm: 0.0 }
    }
}

fn default_opening() -> f64 {
    Articulation::default().lip_opening_mm
}

impl Scene {
    /// The same scene with jaw, hyoid and lips of speech, whose sound is wanted.
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

/// The sound of the last equilibrium in a workspace.
pub(super) fn hear<const D: usize>(
    prepared: &Prepared<D>,
    posture: Articulation,
    workspace: &mut Workspace<D>,
) -> Result<Option<SoundRecord>, SimulationError> {
    let (prepared, workspace) = (prepared as &dyn Any, workspace as &mut dyn Any);
    let plane = prepared.downcast_ref::<Prepared<2>>().zip(workspace.downcast_mut::<Workspace<2>>());
    let Some((prepared, workspace)) = plane else { return Ok(None) };
    let Some(airway) = &prepared.airway else { return Ok(None) };
    let sound = airway.sound(workspace.positions(), &posture)?;
    let mut record = SoundRecord::new(airway.tract(), &airway.acoustics, &sound, posture);
    let rates = airway.rates(&sound);
    // An equilibrium that is not stable has no derivatives.
    if let Ok(mut response) = Response::new(&prepared.system, workspace) {
        for &chain in prepared.system.contracting() {
            let muscle = &prepared.body.mesh.muscles[chain].name;
            let own = VocalTract::by_tension(&rates, &mut response, chain);
            match record.by_tension.iter_mut().find(|b| b.muscle == *muscle) {
                Some(same) => same.hz_per_n.iter_mut().zip(own).for_each(|(sum, x)| *sum += x),
                None => record.by_tension.push(FormantsByTension { muscle: muscle.clone(), hz_per_n: own }),
            }
        }
    }
    Ok(Some(record))
}

/// Formants of a shape of a trajectory, Hz; `None` if walls meet.
pub(super) fn formants<const D: usize>(
    prepared: &Prepared<D>,
    posture: &Articulation,
    positions: &[SVector<f64, D>],
) -> Option<Vec<f64>> {
    let airway = prepared.airway.as_ref()?;
    let flat: Vec<SVector<f64, 2>> = positions.iter().map(|p| SVector::from([p[0], p[1]])).collect();
    let sound = airway.sound(&flat, posture).ok()?;
    Some(sound.formants.iter().map(|f| f.frequency_hz).collect())
}
