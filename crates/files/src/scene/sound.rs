//! The sound of a scene: its formants, and their derivatives by tensions.

use std::any::Any;

use nalgebra::SVector;

use super::effects::{Hyoid, Jaw};
use super::file::{Scene, Want};
use super::prepare::Prepared;
use super::tract::SceneTract;
use crate::report::{FormantsByTension, SoundRecord};
use crate::simulation::SimulationError;
use tongue_core::statics::{Response, Workspace};
use tongue_infer::acoustics::{Articulation, VocalTract};

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
