//! `tongue-fit sound --body space`: the sound of a tongue in space.

use std::collections::BTreeMap;

use miette::{IntoDiagnostic, miette};
use nalgebra::SVector;
use serde::Serialize;
use tongue_fit::acoustics::{Articulation, SpaceVocalTract, Tract, VocalTract};
use tongue_fit::body::Mesh;
use tongue_fit::measured::ByMuscle;
use tongue_fit::report::SoundRecord;
use tongue_fit::run::SpaceSource;
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::TissueModel;

use super::body::space_name;
use super::space;

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Body in space")]
pub struct Arguments {
    /// Tongue in space instead of a vowel: the built-in one, a folder with ArtiSynth's, or hexahedra from Gmsh [space, FOLDER,
    /// FILE.msh]
    #[arg(long, value_name = "BODY", value_parser = space_name, conflicts_with_all = ["vowel", "tension"])]
    pub body: Option<SpaceSource>,
    /// Activation of a muscle, from 0 to 1: of both sides (GGP=0.1) or of one (GGP_L=0.1); may be given
    /// several times
    #[arg(long, value_name = "MUSCLE=A", requires = "body")]
    activation: Vec<String>,
    #[command(flatten)]
    model: space::ModelArguments,
}

impl Arguments {
    pub fn sound(
        &self,
        source: &SpaceSource,
        tract: &Tract,
        posture: &Articulation,
    ) -> miette::Result<HeardTongue> {
        let body = self.model.body(source)?;
        let activations = space::activations(&self.activation, &body)?;
        let airway = SpaceVocalTract::round(&body, tract.clone()).into_diagnostic()?;
        let solved = space::solve(&body, &self.model.model()?, &activations, false)?;
        let sound = airway.sound(&solved.positions, posture).into_diagnostic()?;
        let mut sound = SoundRecord::new(airway.tract(), &airway.acoustics, &sound, *posture);
        sound.areas_from = Some("cross-sections of the tongue between walls of the tract's width");
        let names = body.muscles.iter().map(|m| m.name.clone());
        let record = HeardRecord {
            subject: None,
            vowel: None,
            converged: solved.found.solution.status == SolveStatus::Converged
                && solved.alarms(&body).is_empty(),
            tensions_n: None,
            activations: Some(ByMuscle(names.zip(activations).collect())),
            sound,
            published_hz: None,
            nearest_vowel: None,
            wall_s: solved.wall_s,
        };
        let title = if self.activation.is_empty() {
            format!("{}, at rest", body.what)
        } else {
            format!("{}, {}", body.what, self.activation.join(", "))
        };
        let (tissue, mesh, positions) =
            (solved.system.tissue(), body.midsagittal_mesh(), solved.midsagittal_positions());
        Ok(HeardTongue { title, tissue, mesh, positions, record })
    }
}

pub fn drawn(source: &SpaceSource) -> miette::Result<Tract> {
    match source {
        SpaceSource::BuiltIn => VocalTract::drawn().into_diagnostic(),
        SpaceSource::Folder(folder) | SpaceSource::Mesh(folder) => Err(miette!(
            "the built-in tract fits the built-in tongue only; give a tract in the frame of {} with --tract",
            folder.display()
        )),
    }
}

#[derive(Debug, Clone, Serialize)]
pub struct HeardRecord {
    pub subject: Option<String>,
    pub vowel: Option<String>,
    pub converged: bool,
    /// Tensions, N per metre of thickness; of a body in the plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tensions_n: Option<BTreeMap<String, f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub activations: Option<ByMuscle<f64>>,
    #[serde(flatten)]
    pub sound: SoundRecord,
    /// Mean formants of the vowel, Hz.
    pub published_hz: Option<[f64; 2]>,
    /// The vowel whose published mean is nearest to the first two formants.
    pub nearest_vowel: Option<String>,
    pub wall_s: f64,
}

/// A tongue that was heard, and its midsagittal section at rest and as it was heard.
pub struct HeardTongue {
    pub title: String,
    pub tissue: TissueModel,
    pub mesh: Mesh<2>,
    pub positions: Vec<SVector<f64, 2>>,
    pub record: HeardRecord,
}
