//! Finished recordings, kept so that a killed run can be resumed.

use serde::{Deserialize, Serialize};
use tongue_fit::report::batch::journal::Kept;
use tongue_fit::track::TrackedRecording;

/// Longer recordings are not kept, because their entry would be too large for a journal.
pub const MOST_FRAMES: usize = 5000;

/// What was found of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptRecording {
    /// Its frames and gestures.
    pub recording: TrackedRecording,
}

impl Kept for KeptRecording {
    type Digest = ();

    fn digest(&self) -> Self::Digest {}
}
