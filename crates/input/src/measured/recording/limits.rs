//! Limits of the size of recordings.

use std::borrow::Cow;

use super::super::lengths::text::decode;
use super::{Malformed, SourcePlace};

/// Largest number of frames in a file: twenty minutes at 80 Hz. The results of a frame take about 20 kB.
pub const MOST_FRAMES: usize = 100_000;
pub const MOST_CHANNELS: usize = 2048;
/// Largest number of positions in a file (frames times channels, over all recordings), so that reading it needs at most 300 MB.
pub(super) const MOST_VALUES: usize = 2_500_000;
/// Largest size of a file, bytes: its text may be in memory three times.
pub(super) const LARGEST: u64 = 96 << 20;
/// Largest size of the header of a binary file, bytes.
pub(super) const LARGEST_HEADER: usize = 1 << 20;
/// Plausible rates of electromagnetic systems, Hz.
pub(super) const RATES_HZ: std::ops::RangeInclusive<f64> = 1.0..=10_000.0;
/// Memory of a recording, a channel and a frame beside their positions, in units of a position.
const RECORDING: usize = 40;
const CHANNEL: usize = 4;
const FRAME: usize = 2;

/// The text of a file. A line with more fields than two for each of [`MOST_FRAMES`] is an error.
pub(super) fn text<'a>(bytes: &'a [u8], origin: &str) -> Result<Cow<'a, str>, Malformed> {
    const MOST_FIELDS: usize = 2 * MOST_FRAMES;
    let text = decode(bytes, origin)?.text;
    let fields = |line: &str| 1 + line.bytes().filter(|b| b"\t ,;".contains(b)).count();
    let wide = text.lines().position(|line| line.len() >= MOST_FIELDS && fields(line) > MOST_FIELDS);
    wide.map_or(Ok(text), |n| {
        let at = SourcePlace { origin, line: n as u64 + 1, column: MOST_FIELDS + 1 };
        let help = format!("a line may have {MOST_FIELDS}; give a table with a line for every frame");
        Err(at.error(format!("the line has more than {MOST_FIELDS} fields"), help))
    })
}

#[derive(Debug, Default)]
pub(super) struct Budget {
    values: usize,
}

impl Budget {
    pub fn recording(&mut self) {
        self.values = self.values.saturating_add(RECORDING);
    }

    /// Adds a channel to a recording, which then has this number of frames and channels.
    pub fn channel(&mut self, frames: usize, channels: usize, at: SourcePlace<'_>) -> Result<(), Malformed> {
        self.add(frames, channels, frames.saturating_add(CHANNEL), at)
    }

    /// Adds a frame to a recording, which then has this number of frames and channels.
    pub fn frame(&mut self, frames: usize, channels: usize, at: SourcePlace<'_>) -> Result<(), Malformed> {
        self.add(frames, channels, channels.saturating_add(FRAME), at)
    }

    fn add(
        &mut self,
        frames: usize,
        channels: usize,
        values: usize,
        at: SourcePlace<'_>,
    ) -> Result<(), Malformed> {
        self.values = self.values.saturating_add(values);
        if frames > MOST_FRAMES || channels > MOST_CHANNELS || self.values > MOST_VALUES {
            let what = format!(
                "{frames} frames of {channels} channels, in all as large as {} places, are too many",
                self.values
            );
            let most = format!("{MOST_FRAMES} frames, {MOST_CHANNELS} channels and {MOST_VALUES} places");
            let each =
                format!("a recording counts as {RECORDING} more, a channel as {CHANNEL}, a frame as {FRAME}");
            return Err(at.error(what, format!("a file may have {most} ({each}); give it in parts")));
        }
        Ok(())
    }

    pub fn add_recording(
        &mut self,
        frames: usize,
        channels: usize,
        at: SourcePlace<'_>,
    ) -> Result<(), Malformed> {
        self.recording();
        let places = frames.saturating_mul(channels.saturating_add(FRAME));
        self.add(frames, channels, places.saturating_add(CHANNEL.saturating_mul(channels)), at)
    }
}
