//! Limits of the size of recordings.

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;

/// Maximum number of frames in a file: twenty minutes at 80 a second. The results of a frame take about 20
/// kB.
pub const MOST_FRAMES: usize = 100_000;
/// Maximum number of channels.
pub const MOST_CHANNELS: usize = 2048;
/// Maximum number of positions in a file (frames times channels, over all recordings), so that they and their
/// results fit into 300 MB.
pub(super) const MOST_VALUES: usize = 2_500_000;

/// Amount of data read so far.
#[derive(Debug, Default)]
pub(super) struct Budget {
    values: usize,
}

impl Budget {
    /// Adds positions of a recording that has this number of frames and channels so far.
    pub fn add(
        &mut self,
        frames: usize,
        channels: usize,
        values: usize,
        at: Place<'_>,
    ) -> Result<(), Malformed> {
        self.values = self.values.saturating_add(values);
        if frames > MOST_FRAMES || channels > MOST_CHANNELS || self.values > MOST_VALUES {
            let what = format!(
                "{frames} frames of {channels} channels, {} places in all, are too many",
                self.values
            );
            let most = format!("{MOST_FRAMES} frames, {MOST_CHANNELS} channels and {MOST_VALUES} places");
            return Err(at.error(what, format!("a file may have {most}; give it in parts")));
        }
        Ok(())
    }

    /// Adds a whole recording.
    pub fn whole(&mut self, frames: usize, channels: usize, at: Place<'_>) -> Result<(), Malformed> {
        self.add(frames, channels, frames.saturating_mul(channels), at)
    }
}
