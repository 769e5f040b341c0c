//! Recordings of a tongue over time in the formats of laboratories: points of its contour, sensors glued to it, and bones.
//!
//! `docs/guide.md` lists the formats with their units ("Other recordings"); the module of each reader has the source of its format.
//!
//! ```text
//! bytes -> Recording (channels by name, axes and unit of the file) -> Map -> AlignedRecording (points of the body, m)
//! ```

mod aaa;
mod ag50x;
mod aligned;
mod contour_frame;
mod deeplabcut;
mod dynamics;
mod edgetrak;
mod est;
mod fan;
mod flat;
mod labels;
mod limits;
mod map;
mod matlab;
mod measures;
mod mview;
mod names;
mod numbers;
mod orientation;
mod outliers;
mod plausibility;
mod rows;
mod sensor_table;
mod tidy;
mod waveform;

use std::path::Path;

use tongue_core::statistics::distinct;

use super::error::{Malformed, ReadError, SourcePlace};
use super::table::{HEADER_WITHIN, TableLine, records};

pub use aligned::{AlignedFrame, AlignedRecording, Mark};
pub use flat::{STEEPEST_BONES_DEG, median_point, steep_deg};
pub use labels::{Label, text_grid};
use limits::Budget;
pub use limits::{MOST_CHANNELS, MOST_FRAMES};
pub use map::{CONTOUR_SD_M, Map, SENSOR_SD_M, Stated, WITHOUT_BONES};
pub use names::{Role, bone, is_coil};
pub use orientation::{FIRST_COIL_M, LONGER_THAN_CHORD};
pub use outliers::{Fault, FaultKind, RecordingFaults, remove_outliers};
pub use plausibility::{Doubt, Severity, check_plausibility, disorder_of_contour, other_size};
pub use waveform::Waveform;

/// Limit of coordinates, in the unit of the file.
const FARTHEST: f64 = 1e9;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Articulate Assistant Advanced's export of splines.
    Aaa,
    Tidy,
    /// Carstens AG500 and AG501, head-corrected positions.
    Ag50x,
    Est,
    Edgetrak,
    /// Articulate Assistant Advanced's export of a spline on a fan, without a header.
    AaaFan,
    Microbeam,
    Mview,
    DeepLabCut,
    NdiWave,
    /// Tables of sensors whose header does not name the system, so that the upward axis is found from the data.
    Sensors,
}

impl Format {
    pub const NAMES: [(&'static str, Format); 10] = [
        ("aaa", Format::Aaa),
        ("csv", Format::Tidy),
        ("pos", Format::Ag50x),
        ("ema", Format::Est),
        ("con", Format::Edgetrak),
        ("fan", Format::AaaFan),
        ("txy", Format::Microbeam),
        ("mat", Format::Mview),
        ("dlc", Format::DeepLabCut),
        ("sensors", Format::Sensors),
    ];

    /// The format, from the content or else from the name of the file.
    pub fn of(bytes: &[u8], origin: &str) -> Self {
        let ends = |end: &str| Path::new(origin).extension().is_some_and(|e| e.eq_ignore_ascii_case(end));
        // NUL bytes are removed, so that a header in UTF-16 is recognised, too.
        let head: Vec<u8> = bytes.iter().take(65536).copied().filter(|b| *b != 0 && *b != b'"').collect();
        let head = String::from_utf8_lossy(&head);
        let line = head.lines().next().unwrap_or_default();
        let is_aaa = |line: &str| line.contains("Time of sample") || line.contains("X0 ");
        match () {
            () if bytes.starts_with(b"AG50xDATA_V00") => Self::Ag50x,
            () if bytes.starts_with(b"EST_File") => Self::Est,
            () if bytes.starts_with(b"MATLAB ") => Self::Mview,
            () if ends("con") => Self::Edgetrak,
            () if head.lines().take(HEADER_WITHIN).any(is_aaa) => Self::Aaa,
            () if line.starts_with("scorer,") => Self::DeepLabCut,
            () if sensor_table::is_head(line) => Self::Sensors,
            () if fan::is_row(line) => Self::AaaFan,
            () if ends("txy") => Self::Microbeam,
            () if ends("mat") => Self::Mview,
            () if ends("pos") => Self::Ag50x,
            () if ends("ema") => Self::Est,
            () => Self::Tidy,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    pub time_s: f64,
    /// Position of every channel, in the axes and the unit of the file; `None` if it was not seen.
    pub places: Vec<Option<[f64; 3]>>,
    /// Likelihood of each position, 0 to 1; empty if the format has none.
    pub likelihood: Vec<f32>,
}

impl Sample {
    fn new(time_s: f64, places: Vec<Option<[f64; 3]>>) -> Self {
        Self { time_s, places, likelihood: Vec::new() }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Times {
    InFile,
    /// The file has no times; its instrument usually has this rate, Hz.
    Usual(f64),
    /// Times of samples are numbers of frames.
    Frames,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Distinguishes it from other recordings of the file.
    pub name: String,
    pub speaker: Option<String>,
    pub channels: Vec<String>,
    /// Standard deviation of every channel, in the unit of the file; `None` if the file lacks it.
    pub sigma: Vec<Option<f64>>,
    pub labels: Vec<Label>,
    pub notes: Vec<String>,
    pub samples: Vec<Sample>,
    /// Metres in a unit of the file; `None` if the format does not define it.
    pub metres: Option<f64>,
    pub times: Times,
    pub format: Format,
}

impl Recording {
    /// A recording that is named after its file.
    fn of_file(
        origin: &str,
        format: Format,
        metres: Option<f64>,
        channels: impl Iterator<Item = String>,
        samples: Vec<Sample>,
    ) -> Self {
        let channels: Vec<String> = channels.collect();
        Self {
            name: Self::stem(origin),
            speaker: None,
            sigma: vec![None; channels.len()],
            channels,
            labels: Vec::new(),
            notes: Vec::new(),
            samples,
            metres,
            times: Times::InFile,
            format,
        }
    }

    /// The coils of several recordings of one frame each as one recording, with a sample of each. Other channels are left out.
    pub fn of_coils(frames: &[Self]) -> Result<Self, String> {
        let Some(first) = frames.first() else { return Err("there is no recording".to_owned()) };
        if frames.iter().any(|f| (f.format, f.metres) != (first.format, first.metres)) {
            return Err("the files are of different formats or units".to_owned());
        }
        let channels = distinct(frames.iter().flat_map(|f| &f.channels).filter(|c| is_coil(c)).cloned());
        let number = |frame: &Self, channel: &String| frame.channels.iter().position(|c| c == channel);
        let samples = frames.iter().enumerate().map(|(nth, frame)| {
            let [only] = frame.samples.as_slice() else {
                return Err(format!("{} has {} frames; give one", frame.name, frame.samples.len()));
            };
            let places = channels.iter().map(|channel| only.places[number(frame, channel)?]).collect();
            Ok(Sample::new(nth as f64, places))
        });
        let samples = samples.collect::<Result<_, String>>()?;
        let sigma =
            channels.iter().map(|channel| frames.iter().find_map(|f| f.sigma[number(f, channel)?])).collect();
        Ok(Self { channels, sigma, samples, labels: Vec::new(), ..first.clone() })
    }

    /// Reads all recordings of a file, whose format is found if it is not given. A single recording gets the labels of a Praat TextGrid of
    /// the same name beside the file.
    pub fn from_path(path: &Path, format: Option<Format>) -> Result<Vec<Self>, ReadError> {
        let origin = path.display().to_string();
        let bytes = crate::files::read_up_to(limits::LARGEST, path);
        let bytes = bytes.map_err(|error| ReadError::unreadable(&origin, &error))?;
        let mut found = Self::from_bytes(&bytes, &origin, format)?;
        labels::read_labels_beside(path, &mut found)?;
        Ok(found)
    }

    /// Reads all recordings in the bytes of a file; `origin` is its name in messages. In binary data the column of a fault is the byte.
    pub fn from_bytes(bytes: &[u8], origin: &str, format: Option<Format>) -> Result<Vec<Self>, Malformed> {
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(SourcePlace::start(origin).error("the file is empty", "give a recording"));
        }
        let format = format.unwrap_or_else(|| Format::of(bytes, origin));
        let mut found = match format {
            Format::Aaa => aaa::read(bytes, origin),
            Format::Tidy => tidy::read(bytes, origin),
            Format::Ag50x => ag50x::read(bytes, origin).map(|r| vec![r]),
            Format::Est => est::read(bytes, origin).map(|r| vec![r]),
            Format::Edgetrak => edgetrak::read(bytes, origin).map(|r| vec![r]),
            Format::AaaFan => fan::read(bytes, origin),
            Format::Microbeam => numbers::read_txy(bytes, origin).map(|r| vec![r]),
            Format::Mview => mview::read(bytes, origin),
            Format::DeepLabCut => deeplabcut::read(bytes, origin).map(|r| vec![r]),
            Format::NdiWave | Format::Sensors => sensor_table::read(bytes, origin).map(|r| vec![r]),
        }?;
        found.iter_mut().for_each(Self::remove_zeros);
        // The other formats do not state their sizes.
        if !matches!(format, Format::Mview | Format::Ag50x) && !bytes.starts_with(b"EST_File") {
            found.last_mut().iter_mut().for_each(|last| last.notes.extend(rows::truncation_note(bytes)));
        }
        if found.iter().all(|r| r.samples.is_empty()) {
            let start = SourcePlace::start(origin);
            return Err(start.error("the file has no frame", "give a recording with at least one"));
        }
        Ok(found)
    }

    /// Removes positions at exactly the origin if several of a frame are there and the channel is elsewhere in most frames: programs write
    /// zeros for points that were not seen.
    fn remove_zeros(&mut self) {
        const ZERO: Option<[f64; 3]> = Some([0.0; 3]);
        let has_zeros = |sample: &Sample| sample.places.iter().filter(|place| **place == ZERO).count() > 1;
        let frames: Vec<usize> = (0..self.samples.len()).filter(|&t| has_zeros(&self.samples[t])).collect();
        let mut names: Vec<&str> = Vec::new();
        for (channel, name) in self.channels.iter().enumerate() {
            let places = self.samples.iter().map(|sample| sample.places[channel]);
            let (seen, zeros) = (places.clone().flatten().count(), places.filter(|p| *p == ZERO).count());
            let unseen = frames.iter().filter(|t| self.samples[**t].places[channel] == ZERO);
            let unseen: Vec<usize> = unseen.copied().filter(|_| 2 * zeros < seen).collect();
            unseen.iter().for_each(|&t| self.samples[t].places[channel] = None);
            names.extend((!unseen.is_empty()).then_some(name.as_str()));
        }
        if !names.is_empty() {
            let names = names.join(", ");
            self.notes.push(format!("places at exactly 0, 0 count as not seen ({names}); write nothing for a point that was not seen"));
        }
    }

    /// Whether the recordings have the same times and positions, and speakers that are not known to differ.
    pub fn has_frames_of(&self, other: &Self) -> bool {
        let are_of_two = self.speaker.as_ref().zip(other.speaker.as_ref()).is_some_and(|(a, b)| a != b);
        let [own, others] =
            [self, other].map(|recording| recording.samples.iter().map(|s| (s.time_s, &s.places)));
        !are_of_two && !self.samples.is_empty() && own.eq(others)
    }

    fn uninterpreted(&self, problem: String) -> ReadError {
        ReadError::Refused(format!("the recording {:?}: {problem}", self.name))
    }

    /// Median distance between neighbours of these channels, in the unit of the file.
    fn middle_gap(&self, channels: &[usize]) -> Option<f64> {
        let gaps = channels.windows(2).flat_map(|w| {
            self.samples.iter().filter_map(move |s| {
                let (a, b) = s.places[w[0]].zip(s.places[w[1]])?;
                Some((0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt())
            })
        });
        tongue_core::statistics::median(gaps).filter(|g| *g > 0.0)
    }

    fn stem(origin: &str) -> String {
        Path::new(origin).file_stem().map_or_else(|| origin.to_owned(), |s| s.to_string_lossy().into_owned())
    }
}

fn coordinate(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v| is_coordinate(*v))
}

/// The position, if all of its coordinates are numbers within the limit.
fn seen(place: [f64; 3]) -> Option<[f64; 3]> {
    place.iter().all(|v| is_coordinate(*v)).then_some(place)
}

fn is_coordinate(v: f64) -> bool {
    v.is_finite() && v.abs() <= FARTHEST
}
