//! `tongue-fit sound --body space`: the sound of a tongue in space.

use miette::{IntoDiagnostic, miette};
use tongue_fit::acoustics::{Articulation, MeanVowel, Tract, VocalTract};
use tongue_fit::run::{HeardTongue, SpaceSource};

use super::body::space_name;
use super::{output, space};

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
        tract_and_means: (&Tract, Articulation, &[MeanVowel]),
    ) -> miette::Result<HeardTongue> {
        let body = self.model.body(source)?;
        let activations = space::activations(&self.activation, &body)?;
        let title = if self.activation.is_empty() {
            format!("{}, at rest", body.what)
        } else {
            format!("{}, {}", body.what, self.activation.join(", "))
        };
        let model = self.model.model()?;
        let heard =
            HeardTongue::in_space(title, (&body, &model), activations, tract_and_means, &output::tell_step);
        heard.into_diagnostic()
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
