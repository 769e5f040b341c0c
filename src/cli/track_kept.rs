//! Recordings that are done, kept so that a run that was killed goes on after them.

use serde::{Deserialize, Serialize};
use tongue_fit::adapt::Adaptation;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::report::batch::journal::Kept;
use tongue_fit::track::Tracked;

/// Longer recordings are not kept: their entry would be larger than a journal takes.
pub const MOST_FRAMES: usize = 5000;

/// A recording with the body that it was tracked with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptRecording {
    what: String,
    /// Nodes of the body at rest, m.
    nodes: Vec<[f64; 2]>,
    /// How it came to be; none where it was given.
    pub adaptation: Option<Adaptation>,
    /// The frames.
    pub frames: Vec<Tracked>,
}

impl Kept for KeptRecording {
    type Digest = ();

    fn digest(&self) -> Self::Digest {}
}

impl KeptRecording {
    /// What was found of a recording.
    pub fn new(body: &Body<2>, adaptation: Option<Adaptation>, frames: &[Tracked]) -> Self {
        Self {
            what: body.what.clone(),
            nodes: body.mesh.nodes.iter().map(|p| [p.x, p.y]).collect(),
            adaptation,
            frames: frames.to_vec(),
        }
    }

    /// The body, made of the one that it was adapted from.
    pub fn body(&self, of: &Body<2>) -> Body<2> {
        let mut body = Body { what: self.what.clone(), ..of.clone() };
        if self.adaptation.is_some() {
            body.palate = None;
        }
        body.mesh.nodes = self.nodes.iter().copied().map(Point::from).collect();
        body
    }
}
