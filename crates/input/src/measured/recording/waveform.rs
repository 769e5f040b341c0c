use std::io::Cursor;
use std::path::{Path, PathBuf};

use super::limits;

/// A sound for drawing: the smallest and the largest sample of every bin, from -1 to 1, from the recording's time 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct Waveform {
    pub ends: Vec<[f32; 2]>,
}

impl Waveform {
    /// Duration of a bin, s.
    pub const BIN_S: f64 = 2e-3;

    /// The sound `NAME.wav` beside the recording `NAME.tsv`, if there is one; its first sample is at time 0 of the recording.
    pub fn sound_file_beside(recording: &Path) -> Option<PathBuf> {
        ["wav", "WAV"].map(|e| recording.with_extension(e)).into_iter().find(|p| p.is_file())
    }

    /// Reads a WAV file; the error is a sentence for the user.
    pub fn read(path: &Path) -> Result<Self, String> {
        let unread = |why: String| format!("the sound {} cannot be drawn: {why}", path.display());
        let bytes = crate::files::read_up_to(limits::LARGEST, path).map_err(|e| unread(e.to_string()))?;
        Self::of_wav(&bytes).map_err(unread)
    }

    /// Reads the first channel of a WAV file.
    pub fn of_wav(bytes: &[u8]) -> Result<Self, String> {
        let mut file = hound::WavReader::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
        let spec = file.spec();
        let channels = usize::from(spec.channels.max(1));
        let samples: Result<Vec<f32>, hound::Error> = match spec.sample_format {
            hound::SampleFormat::Float => file.samples::<f32>().step_by(channels).collect(),
            hound::SampleFormat::Int => {
                let full = 2f32.powi(i32::from(spec.bits_per_sample) - 1);
                file.samples::<i32>().step_by(channels).map(|s| s.map(|s| s as f32 / full)).collect()
            }
        };
        let samples = samples.map_err(|e| e.to_string())?;
        let in_bin = Self::BIN_S * f64::from(spec.sample_rate);
        if in_bin < 1.0 {
            return Err(format!("{} samples a second are too few", spec.sample_rate));
        }
        if samples.iter().any(|s| !s.is_finite()) || samples.len() < in_bin as usize {
            return Err("it has no samples, or some that are not numbers".to_owned());
        }
        let bins = (samples.len() as f64 / in_bin).floor() as usize;
        let ends = (0..bins).map(|k| {
            let [from, to] = [k, k + 1].map(|k| (k as f64 * in_bin) as usize);
            let start = [f32::INFINITY, f32::NEG_INFINITY];
            samples[from..to].iter().fold(start, |[low, high], s| [low.min(*s), high.max(*s)])
        });
        Ok(Self { ends: ends.collect() })
    }

    /// The smallest and the largest sample of several bins.
    pub fn ends_of(bins: &[[f32; 2]]) -> [f64; 2] {
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        bins.iter().fold(start, |[a, b], [low, high]| [a.min(f64::from(*low)), b.max(f64::from(*high))])
    }
}
