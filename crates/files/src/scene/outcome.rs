//! The result of a scene: lengths, forces, times, positions and sound.

use std::any::Any;

use nalgebra::SVector;
use serde::Serialize;

use super::loads::PointsFit;
use super::plan::ScenePlan;
use super::prepare::Prepared;
use crate::report::{FormantsByTension, Pulls, SoundRecord};
use crate::simulation::SimulationError;
use crate::surgery::OperationRecord;
use tongue_core::dynamics::MotionOutcome;
use tongue_core::statics::{Response, Solution, Workspace};
use tongue_infer::acoustics::{Articulation, VocalTract};
use tongue_infer::inverse::{self, alarms::Alarm};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pull {
    /// N; in the plane per metre of thickness.
    TensionN(f64),
    Activation(f64),
}

impl Pull {
    pub fn value(self) -> f64 {
        match self {
            Self::TensionN(value) | Self::Activation(value) => value,
        }
    }
}

/// Lengths are means over the muscles of one name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MuscleLength {
    pub muscle: String,
    #[serde(flatten)]
    pub pull: Pull,
    /// 95 % interval of the tension, if points were fitted. It holds if the speaker's tongue has the shape of this body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_n: Option<[f64; 2]>,
    pub rest_mm: f64,
    pub length_mm: f64,
    pub stretch: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactForce {
    /// Force of the body on the wall, N (2D: per metre of thickness).
    pub on_wall_n: Vec<f64>,
    pub largest_n: f64,
    pub touching: usize,
    pub closest_mm: f64,
    /// Whether a corner of the wall lies between two nodes: the wall acts on nodes, not on the lines between them.
    pub edge_through_wall: bool,
}

/// Measured time of one evaluation of an effect's energy, force and stiffness, and the total of all evaluations in a solve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectTime {
    pub effect: &'static str,
    pub energy_us: f64,
    pub force_us: f64,
    pub stiffness_us: f64,
    pub total_us: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moment {
    pub time_s: f64,
    /// Length of every muscle; for muscles of one name the mean.
    pub lengths_mm: Vec<f64>,
    /// Formants, if the scene has a tract; null if its walls meet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub formants_hz: Option<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneMotion {
    #[serde(flatten)]
    pub outcome: MotionOutcome,
    /// Part of the way to its equilibrium that the body has moved; null if it has no equilibrium to go to.
    pub part_of_way_to_equilibrium: Option<f64>,
    pub moments: Vec<Moment>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneOutcome {
    pub plan: ScenePlan,
    pub converged: bool,
    #[serde(flatten)]
    pub pulls: Pulls,
    /// Each name once.
    pub muscles: Vec<MuscleLength>,
    /// Smallest ratio of a cell's area or volume to that at rest.
    pub min_cell_ratio: f64,
    pub max_cell_ratio: f64,
    /// Total area, m², or volume, m³, over that at rest.
    pub measure_ratio: f64,
    pub contact: Option<ContactForce>,
    /// Force of the body on the bones, N, by dimension; null at the end of a trajectory, where dampers and masses act on them too.
    pub on_bones_n: Option<Vec<f64>>,
    pub solution: Option<Solution>,
    pub fit: Option<inverse::FitStatus>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<PointsFit>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sound: Option<SoundRecord>,
    /// What surgery changed, if there was any; everything else in this record is after it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub operation: Option<OperationRecord>,
    pub trajectory: Option<SceneMotion>,
    /// Doubts about the shape: it is not known to lie on the branch from rest, a barrier keeps it, or it is strained too far.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alarms: Vec<Alarm>,
    pub wall_s: f64,
    /// Time that each effect took in a trajectory or in the last direct solve. Most of the remaining time is linear algebra and, for an
    /// equilibrium, following the branch from rest.
    pub time_by_effect: Vec<EffectTime>,
    pub positions_m: Vec<Vec<f64>>,
}

/// The sound of the last equilibrium in a workspace; `None` in space or without a tract.
pub(super) fn sound_record<const D: usize>(
    prepared: &Prepared<D>,
    posture: Articulation,
    workspace: &mut Workspace<D>,
) -> Result<Option<SoundRecord>, SimulationError> {
    let (prepared, workspace) = (prepared as &dyn Any, workspace as &mut dyn Any);
    let plane = prepared.downcast_ref::<Prepared<2>>().zip(workspace.downcast_mut::<Workspace<2>>());
    let Some((prepared, workspace)) = plane else { return Ok(None) };
    let Some(airway) = &prepared.airway else { return Ok(None) };
    let sound = airway.sound(workspace.positions(), &posture)?;
    let mut record = SoundRecord::new(&airway.tract, &airway.acoustics, &sound, posture);
    let rates = airway.rates(&sound);
    // An equilibrium that is not stable has no derivatives.
    if let Some(mut response) = Response::new(&prepared.system, workspace) {
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
