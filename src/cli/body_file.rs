//! The file of a speaker's body, which `--mesh` of every command reads: its mesh and its adaptation.

use miette::IntoDiagnostic;
use serde::Serialize;
use tongue_fit::adapt::Adaptation;
use tongue_fit::body::Body;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::system::Model;

/// A body with the data about the recording that it was adapted to.
#[derive(Serialize)]
pub struct BodyFile {
    #[serde(flatten)]
    mesh: MeshRecord,
    adaptation: Adaptation,
}

impl BodyFile {
    pub fn new(body: &Body<2>, model: &Model, adaptation: Adaptation) -> miette::Result<Self> {
        Ok(Self { mesh: MeshRecord::of(body, model).into_diagnostic()?, adaptation })
    }
}
