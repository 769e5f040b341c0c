//! The sound of a tongue in the plane or in space.

use std::collections::BTreeMap;

use nalgebra::SVector;
use serde::Serialize;
use tongue_core::body::{Body, Mesh};
use tongue_core::statics::SolveStatus;
use tongue_core::system::{SpaceModel, TissueModel};
use tongue_infer::acoustics::{Articulation, MeanVowel, SpaceVocalTract, Tract, nearest_vowel};
use tongue_infer::inverse::alarms::Alarm;
use tongue_input::bodies::AnyBody;
use tongue_input::measured::{ByMuscle, Dataset, Vowel};

use super::equilibrium::Solved;
use crate::report::SoundRecord;
use crate::scene::effects::Effects;
use crate::scene::file::{FitTarget, Material, Scene, SceneBody, SceneTongue, SceneTract, Want};
use crate::scene::prepare::prepare;
use crate::scene::{body, run};
use crate::simulation::SimulationError;

const BASELINE: &str = "ɯ";

#[derive(Debug, Clone, Serialize)]
pub struct TongueSoundRecord {
    pub subject: Option<String>,
    pub vowel: Option<String>,
    pub converged: bool,
    pub alarms: Vec<Alarm>,
    /// N per metre of thickness; for a body in the plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tensions_n: Option<BTreeMap<String, f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub activations: Option<ByMuscle<f64>>,
    #[serde(flatten)]
    pub sound: SoundRecord,
    /// Published mean of the first two formants of the vowel.
    pub published_hz: Option<[f64; 2]>,
    /// The vowel whose published mean is nearest to the first two formants.
    pub nearest_vowel: Option<String>,
    pub wall_s: f64,
}

/// The sound of a tongue, with its midsagittal section at rest and in the shape that makes the sound.
pub struct TongueSound {
    pub title: String,
    pub tissue: TissueModel,
    pub mesh: Mesh<2>,
    /// Positions of the nodes of the section, m.
    pub positions: Vec<SVector<f64, 2>>,
    pub record: TongueSoundRecord,
}

/// The sound of the tongue in the plane: of a vowel, whose lengths are fitted with the baseline at rest, or of given tensions.
#[derive(Debug, Clone)]
pub struct SoundRun<'a> {
    pub title: String,
    pub subject: &'a str,
    pub vowel: Option<&'a Vowel>,
    /// `ratio` or `stretch`.
    pub target: &'a str,
    /// N per metre of thickness; used if there is no vowel.
    pub tensions_n: BTreeMap<String, f64>,
    pub tract: &'a Tract,
    /// `None` for the built-in tract.
    pub tract_file: Option<String>,
    pub posture: Articulation,
    pub means: &'a [MeanVowel],
    pub h_mm: f64,
}

impl SoundRun<'_> {
    /// The scene that is run; an error for values that a scene does not take.
    pub fn scene(&self) -> Result<Scene, SimulationError> {
        let fitted = self.vowel.filter(|v| v.label() != BASELINE);
        let scene = Scene {
            title: self.title.clone(),
            note: String::new(),
            want: Want::Sound,
            body: SceneBody::Tongue(SceneTongue { h_mm: self.h_mm, kind: Default::default() }),
            material: Material::default(),
            tensions_n: self.tensions_n.clone(),
            fit: fitted.map(|v| FitTarget {
                subject: self.subject.to_owned(),
                vowel: v.label().to_owned(),
                target: self.target.to_owned(),
            }),
            activations: BTreeMap::new(),
            surgery: None,
            points: None,
            effects: Effects::default(),
            trajectory: None,
            tract: Some(SceneTract { file: self.tract_file.clone(), ..Default::default() }),
        };
        let scene = scene.spoken(&self.posture, self.tract.jaw.joint_mm);
        scene.check()?;
        Ok(scene)
    }

    pub fn run(&self) -> Result<TongueSound, SimulationError> {
        if let Some(vowel) = self.vowel.filter(|v| v.label() == BASELINE) {
            Dataset::reference()?.baseline_vowel(self.subject, vowel)?;
        }
        let scene = self.scene()?;
        let AnyBody::Flat(body) = body::build(&scene)? else {
            return Err(SimulationError::Refused("only a body in the plane has a tract".to_owned()));
        };
        let mut prepared = prepare(&scene, body)?;
        let answer = run::run(&scene, &mut prepared)?;
        let Some(sound) = answer.sound else {
            return Err(SimulationError::Refused("this scene has no sound".to_owned()));
        };
        let tensions = answer.muscles.iter().map(|m| (m.muscle.clone(), m.pull.value())).collect();
        let own = self.vowel.and_then(|v| self.means.iter().find(|m| m.vowel == v.label()));
        let record = TongueSoundRecord {
            subject: self.vowel.map(|_| self.subject.to_owned()),
            vowel: self.vowel.map(|v| v.label().to_owned()),
            tensions_n: Some(tensions),
            published_hz: own.map(|m| [m.f1_hz, m.f2_hz]),
            ..TongueSoundRecord::new((answer.converged, answer.alarms), sound, answer.wall_s, self.means)
        };
        let positions = answer.positions_m.iter().map(|p| SVector::from_column_slice(p)).collect();
        let (tissue, mesh) = (prepared.system.tissue(), prepared.body.mesh);
        Ok(TongueSound { title: scene.title, tissue, mesh, positions, record })
    }
}

impl TongueSoundRecord {
    fn new(
        (converged, alarms): (bool, Vec<Alarm>),
        sound: SoundRecord,
        wall_s: f64,
        means: &[MeanVowel],
    ) -> Self {
        let nearest = match sound.formants_hz[..] {
            [f1, f2, ..] => nearest_vowel(means, f1, f2),
            _ => None,
        };
        Self {
            subject: None,
            vowel: None,
            converged,
            alarms,
            tensions_n: None,
            activations: None,
            published_hz: None,
            nearest_vowel: nearest.map(|m| m.vowel.clone()),
            sound,
            wall_s,
        }
    }
}

impl TongueSound {
    /// The sound of a tongue in space, from cross-sections between tongue and tract. For `tell` see [`Solved::in_space`].
    pub fn in_space(
        title: String,
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
        let converged = solved.found.solution.status == SolveStatus::Converged;
        let names = body.muscles.iter().map(|m| m.name.clone());
        let record = TongueSoundRecord {
            activations: Some(ByMuscle(names.zip(activations).collect())),
            ..TongueSoundRecord::new((converged, solved.alarms(body)), sound, solved.wall_s, means)
        };
        let (tissue, positions) = (solved.system.tissue(), solved.midsagittal_positions());
        Ok(Self { title, tissue, mesh: body.midsagittal_mesh(), positions, record })
    }
}
