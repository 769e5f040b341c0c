//! The sound of a tongue in the plane or in space.

use std::collections::BTreeMap;

use nalgebra::SVector;
use serde::Serialize;
use tongue_core::body::{Body, Mesh};
use tongue_core::statics::SolveStatus;
use tongue_core::system::{SpaceModel, TissueModel};
use tongue_infer::acoustics::{Articulation, MeanVowel, SpaceVocalTract, Tract, nearest_vowel};
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_input::bodies::AnyBody;
use tongue_input::measured::{ByMuscle, Dataset, Vowel};

use super::equilibrium::Solved;
use crate::report::{Pulls, SoundRecord};
use crate::scene::prepare::prepare;
use crate::scene::{Scene, body, run};
use crate::simulation::SimulationError;

/// The sound of a tongue, with its midsagittal section at rest and in the shape that makes the sound.
#[derive(Debug, Clone, Serialize)]
pub struct TongueSound {
    #[serde(skip)]
    pub tissue: TissueModel,
    #[serde(skip)]
    pub mesh: Mesh<2>,
    /// Positions of the nodes of the section, m.
    #[serde(skip)]
    pub positions: Vec<SVector<f64, 2>>,
    pub subject: Option<String>,
    pub vowel: Option<String>,
    pub converged: bool,
    pub alarms: Vec<Alarm>,
    #[serde(flatten)]
    pub pulls: Pulls<ByMuscle<f64>>,
    #[serde(flatten)]
    pub sound: SoundRecord,
    /// Published mean of the first two formants of the vowel.
    pub published_hz: Option<[f64; 2]>,
    /// The vowel whose published mean is nearest to the first two formants.
    pub nearest_vowel: Option<String>,
    pub wall_s: f64,
}

fn nearest_name(means: &[MeanVowel], sound: &SoundRecord) -> Option<String> {
    let [f1, f2, ..] = sound.formants_hz[..] else { return None };
    nearest_vowel(means, f1, f2).map(|m| m.vowel.clone())
}

impl TongueSound {
    /// The sound of a tongue in the plane, from a scene that wants it; `spoken` are the subject and the vowel that the scene shows.
    pub fn of_scene(
        scene: &Scene,
        spoken: Option<(&str, &Vowel)>,
        means: &[MeanVowel],
    ) -> Result<Self, SimulationError> {
        if let Some((subject, vowel)) = spoken.filter(|_| scene.fit.is_none()) {
            Dataset::reference()?.baseline_vowel(subject, vowel)?;
        }
        let AnyBody::Flat(body) = body::build(scene, &mut |_| ())? else {
            return Err(SimulationError::Refused("only a body in the plane has a tract".to_owned()));
        };
        let mut prepared = prepare(scene, body)?;
        let answer = run::run(scene, &mut prepared)?;
        let Some(sound) = answer.sound else {
            return Err(SimulationError::Refused("this scene has no sound".to_owned()));
        };
        let tensions = answer.muscles.iter().map(|m| (m.muscle.clone(), m.pull.value()));
        let tensions: BTreeMap<String, f64> = tensions.collect();
        let own = spoken.and_then(|(_, v)| means.iter().find(|m| m.vowel == v.label()));
        Ok(Self {
            tissue: prepared.system.tissue(),
            mesh: prepared.body.mesh,
            positions: answer.positions_m.iter().map(|p| SVector::from_column_slice(p)).collect(),
            subject: spoken.map(|(subject, _)| subject.to_owned()),
            vowel: spoken.map(|(_, v)| v.label().to_owned()),
            converged: answer.converged,
            alarms: answer.alarms,
            pulls: Pulls::TensionsN(tensions.into()),
            published_hz: own.map(|m| [m.f1_hz, m.f2_hz]),
            nearest_vowel: nearest_name(means, &sound),
            sound,
            wall_s: answer.wall_s,
        })
    }

    /// The sound of a tongue in space, from cross-sections between tongue and tract. For `tell` see [`Solved::in_space`].
    pub fn in_space(
        (body, model): (&Body<3>, &SpaceModel),
        activations: Vec<f64>,
        (tract, posture, means): (&Tract, Articulation, &[MeanVowel]),
        tell: &dyn Fn(&str),
    ) -> Result<Self, SimulationError> {
        let airway = SpaceVocalTract::round(body, tract.clone())?;
        let solved = Solved::in_space(body, model, &activations, false, tell)?;
        let sound = airway.sound(&solved.positions, &posture)?;
        let mut sound = SoundRecord::new(&airway.tract, &airway.acoustics, &sound, posture);
        sound.areas_from = Some("cross-sections of the tongue between walls of the tract's width");
        let names = body.muscles.iter().map(|m| m.name.clone());
        Ok(Self {
            tissue: solved.system.tissue(),
            mesh: body.midsagittal_mesh(),
            positions: solved.midsagittal_positions(),
            subject: None,
            vowel: None,
            converged: solved.equilibrium.solution.status == SolveStatus::Converged,
            alarms: solved.alarms(body).into_iter().chain(alarms::of_tract(sound.tract_length_mm)).collect(),
            pulls: Pulls::Activations(ByMuscle(names.zip(activations).collect())),
            published_hz: None,
            nearest_vowel: nearest_name(means, &sound),
            sound,
            wall_s: solved.wall_s,
        })
    }
}
