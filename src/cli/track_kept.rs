//! Finished recordings, kept so that a killed run can be resumed.

use serde::{Deserialize, Serialize};
use tongue_fit::adapt::Adaptation;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::report::batch::journal::Kept;
use tongue_fit::track::Tracked;

/// Longer recordings are not kept, because their entry would be too large for a journal.
pub const MOST_FRAMES: usize = 5000;

/// A recording and the body with which it was tracked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptRecording {
    what: String,
    /// Nodes of the body at rest, m.
    nodes: Vec<[f64; 2]>,
    /// Origin of the body; `None` if it was given.
    pub adaptation: Option<Adaptation>,
    pub frames: Vec<Tracked>,
}

impl Kept for KeptRecording {
    type Digest = ();

    fn digest(&self) -> Self::Digest {}
}

impl KeptRecording {
    /// The entry of a recording.
    pub fn new(body: &Body<2>, adaptation: Option<Adaptation>, frames: &[Tracked]) -> Self {
        Self {
            what: body.what.clone(),
            nodes: body.mesh.nodes.iter().map(|p| [p.x, p.y]).collect(),
            adaptation,
            frames: frames.to_vec(),
        }
    }

    /// The body, made from the one that it was adapted from.
    pub fn body(&self, of: &Body<2>) -> Body<2> {
        let mut body = Body { what: self.what.clone(), ..of.clone() };
        if self.adaptation.is_some() {
            body.palate = None;
        }
        body.mesh.nodes = self.nodes.iter().copied().map(Point::from).collect();
        body
    }
}
