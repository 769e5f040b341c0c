//! How much a file of recordings may hold.

use super::super::lengths::Malformed;
use super::super::lengths::error::Place;

/// More frames than this in one file are refused: twenty minutes at 80 a second. What is made of each takes some 20 kB.
pub const MOST_FRAMES: usize = 100_000;
/// More channels than this are no sensors and contour points.
pub const MOST_CHANNELS: usize = 2048;
/// More places than this in a file (frames times channels, over all of its recordings) do not fit into 300 MB with what is made of them.
pub(super) const MOST_VALUES: usize = 2_500_000;

/// What was read of a file so far.
#[derive(Debug, Default)]
pub(super) struct Budget {
    values: usize,
}

impl Budget {
    /// So many places more, of a recording with so many frames and channels by now.
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

    /// The whole of a recording with so many frames and channels.
    pub fn whole(&mut self, frames: usize, channels: usize, at: Place<'_>) -> Result<(), Malformed> {
        self.add(frames, channels, frames.saturating_mul(channels), at)
    }
}
