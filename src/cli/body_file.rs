//! The file of a speaker's body, which `--mesh` of every command reads: its mesh and its adaptation.

use miette::IntoDiagnostic;
use serde::Serialize;
use tongue_fit::adapt::Adaptation;
use tongue_fit::body::Body;
use tongue_fit::body::json::MeshRecord;
use tongue_fit::report::RecordingResult;
use tongue_fit::system::Model;

/// A body with the data about the recording that it was adapted to.
#[derive(Serialize)]
pub struct BodyFile<'a> {
    #[serde(flatten)]
    mesh: MeshRecord,
    adaptation: Adaptation,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    other_rest_shapes: Vec<RestShapeFile<'a>>,
}

/// Recordings that were tracked apart and have another shape at rest, with its nodes.
#[derive(Serialize)]
struct RestShapeFile<'a> {
    recordings: Vec<&'a str>,
    nodes_m: Vec<[f64; 2]>,
}

impl<'a> BodyFile<'a> {
    /// The file of a body, which has the shape at rest of the first recording; shapes of other recordings that differ are added.
    pub fn new(
        body: &Body<2>,
        model: &Model,
        adaptation: Adaptation,
        recordings: &'a [RecordingResult],
    ) -> miette::Result<Self> {
        let groups = recordings.chunk_by(|a, b| a.rest == b.rest).skip(1);
        let other_rest_shapes = groups.map(|group| RestShapeFile {
            recordings: group.iter().map(|one| one.name.as_str()).collect(),
            nodes_m: group[0].rest.iter().map(|p| [p.x, p.y]).collect(),
        });
        let mesh = MeshRecord::of(body, model).into_diagnostic()?;
        Ok(Self { mesh, adaptation, other_rest_shapes: other_rest_shapes.collect() })
    }
}
