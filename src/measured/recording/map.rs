//! Which channel is what: a TOML file beside the recording. Without one the names say it.
//!
//! ```toml
//! unit_mm = 10.0      # millimetres in a unit of the file, where the format does not say it
//! rate_hz = 60.0      # frames a second, where the file has no times
//! back = "-x"         # the axis that grows towards the back of the head, and the one that grows upwards
//! up = "y"
//! noise_mm = 0.5      # standard deviation of a point
//!
//! [points]
//! T1 = { surface_mm = 8.0 }                  # a sensor on the tongue: so far behind the tip, along the surface at rest
//! T2 = { surface_mm = 30.0, noise_mm = 0.3 }
//! rim_1 = "contour"                          # somewhere on the surface
//! jaw = { bone = "mental_spine" }            # moves with a bone of the body
//! incisor = "reference"                      # moves with the head: every frame is brought back to it
//! lip = "ignore"
//! ```

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::body::{HYOID, MANDIBLE};
use crate::suggest;

use super::{Format, Recording};

/// Standard deviation of a contour point, m: keypoints of DeepLabCut on ultrasound (AAA's models: 0.93 mm from human labels).
pub const CONTOUR_SD_M: f64 = 0.93e-3;
/// Standard deviation of an electromagnetic sensor, m (AG500; newer ones are better).
pub const SENSOR_SD_M: f64 = 0.5e-3;
const LARGEST_MM: f64 = 1e4;

/// What a channel is of the body.
#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// A point somewhere on the surface of the tongue.
    Contour,
    /// A material point of the surface, so far behind the tip along it at rest, m.
    Surface(f64),
    /// Moves with the bone of this name.
    Bone(String),
    /// Moves with the head.
    Reference,
    /// Not used.
    Ignored,
}

/// Which channel is what, and in which axes and unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Map {
    file: File,
    origin: String,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    unit_mm: Option<f64>,
    rate_hz: Option<f64>,
    back: Option<String>,
    up: Option<String>,
    noise_mm: Option<f64>,
    #[serde(default)]
    points: BTreeMap<String, Entry>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum Entry {
    Word(String),
    Table(Table),
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    surface_mm: Option<f64>,
    bone: Option<String>,
    contour: Option<bool>,
    noise_mm: Option<f64>,
}

/// What is wrong with a map, or with a recording that needs one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MapError {
    /// The text is no map.
    #[error("the map {origin}{}: {problem}", line.map_or_else(String::new, |l| format!(":{l}")))]
    Text {
        /// Its file.
        origin: String,
        /// Line, from 1, where it is known.
        line: Option<usize>,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The recording cannot be used with it, or without one.
    #[error("the recording {recording:?}: {problem}")]
    Recording {
        /// Its name.
        recording: String,
        /// What is wrong and what to do.
        problem: String,
    },
}

/// An axis of a file and its sign.
pub(super) type Axis = (usize, f64);

impl Map {
    /// Reads a map; `origin` is what messages call it.
    ///
    /// # Errors
    /// [`MapError::Text`] with the line.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, MapError> {
        let wrong = |line: Option<usize>, problem: String| MapError::Text {
            origin: origin.to_owned(),
            line,
            problem,
        };
        let file: File = toml::from_str(text).map_err(|e| {
            let line =
                e.span().and_then(|s| text.get(..s.start)).map(|before| before.matches('\n').count() + 1);
            let hint = "a map has unit_mm, rate_hz, back, up, noise_mm and [points]";
            wrong(line, format!("{} ({hint})", e.message()))
        })?;
        let line_of = |word: &str| text.lines().position(|l| l.trim_start().starts_with(word)).map(|n| n + 1);
        let positive = |name: &str, value: Option<f64>, most: f64| match value {
            Some(v) if !(v > 0.0 && v <= most) => {
                Err(wrong(line_of(name), format!("{name} is {v}; it must be above 0 and at most {most}")))
            }
            _ => Ok(()),
        };
        positive("unit_mm", file.unit_mm, LARGEST_MM)?;
        positive("rate_hz", file.rate_hz, 1e5)?;
        positive("noise_mm", file.noise_mm, 100.0)?;
        for (name, text) in [("back", &file.back), ("up", &file.up)] {
            if text.as_ref().is_some_and(|t| axis(t).is_none()) {
                return Err(wrong(line_of(name), format!("{name} must be one of x, y, z, -x, -y, -z")));
            }
        }
        if let (Some(back), Some(up)) = (&file.back, &file.up)
            && axis(back).map(|a| a.0) == axis(up).map(|a| a.0)
        {
            return Err(wrong(line_of("up"), "back and up are the same axis; give two".to_owned()));
        }
        for (name, entry) in &file.points {
            let fail = |problem: String| wrong(line_of(name), format!("{name}: {problem}"));
            match entry {
                Entry::Word(word) if !matches!(word.as_str(), "contour" | "reference" | "ignore") => {
                    let what = "write \"contour\", \"reference\", \"ignore\", { surface_mm = .. } or { bone = \"..\" }";
                    return Err(fail(format!("{word:?} is no role; {what}")));
                }
                Entry::Word(_) => {}
                Entry::Table(t) => {
                    let given = [t.surface_mm.is_some(), t.bone.is_some(), t.contour == Some(true)];
                    if given.iter().filter(|g| **g).count() != 1 {
                        return Err(fail("give one of surface_mm, bone and contour = true".to_owned()));
                    }
                    if t.surface_mm.is_some_and(|mm| !(0.0..=300.0).contains(&mm)) {
                        return Err(fail("surface_mm must be from 0 (the tip) to 300".to_owned()));
                    }
                    if t.noise_mm.is_some_and(|mm| !(mm > 0.0 && mm <= 100.0)) {
                        return Err(fail("noise_mm must be above 0 and at most 100".to_owned()));
                    }
                }
            }
        }
        Ok(Self { file, origin: origin.to_owned() })
    }

    /// Names in the map that no channel of the recording has.
    pub(super) fn unknown<'a>(&'a self, channels: &'a [String]) -> Option<String> {
        let name = self.file.points.keys().find(|name| !channels.contains(name))?;
        Some(format!(
            "the map {} names the point {name:?}; {}",
            self.origin,
            suggest::hint(name, channels.iter().map(String::as_str))
        ))
    }

    /// What a channel is, by the map or by its name.
    pub(super) fn role(&self, channel: &str) -> Role {
        match self.file.points.get(channel) {
            Some(Entry::Word(word)) => match word.as_str() {
                "contour" => Role::Contour,
                "reference" => Role::Reference,
                _ => Role::Ignored,
            },
            Some(Entry::Table(t)) => match (t.surface_mm, &t.bone) {
                (Some(mm), _) => Role::Surface(mm * 1e-3),
                (_, Some(bone)) => Role::Bone(bone.clone()),
                _ => Role::Contour,
            },
            None if channel == HYOID || channel == MANDIBLE => Role::Bone(channel.to_owned()),
            None if channel.strip_prefix("tongue_").is_some_and(|n| n.parse::<u32>().is_ok()) => {
                Role::Contour
            }
            None => Role::Ignored,
        }
    }

    /// Standard deviation of a channel, m: of the map's point, the map, the file, or what is usual.
    pub(super) fn sd(&self, channel: &str, role: &Role, in_file: Option<f64>) -> f64 {
        let own = match self.file.points.get(channel) {
            Some(Entry::Table(t)) => t.noise_mm,
            _ => None,
        };
        own.map(|mm| mm * 1e-3).or(in_file).or(self.file.noise_mm.map(|mm| mm * 1e-3)).unwrap_or(match role {
            Role::Surface(_) => SENSOR_SD_M,
            _ => CONTOUR_SD_M,
        })
    }

    /// Metres in a unit of the file.
    pub(super) fn metres(&self, recording: &Recording) -> Result<f64, MapError> {
        self.file.unit_mm.map(|mm| mm * 1e-3).or(recording.metres).ok_or_else(|| MapError::Recording {
            recording: recording.name.clone(),
            problem: "its format does not say in which unit it is; write `unit_mm = ..` (millimetres in a unit, or \
                      in a pixel) into a map and give that with --map"
                .to_owned(),
        })
    }

    /// Seconds in a unit of the file's time.
    pub(super) fn seconds(&self, recording: &Recording) -> Result<f64, MapError> {
        match (self.file.rate_hz, recording.format) {
            (Some(rate), Format::Edgetrak) => Ok(1.0 / rate),
            (None, Format::Edgetrak) if recording.samples.len() > 1 => Err(MapError::Recording {
                recording: recording.name.clone(),
                problem: "its format has no times; write `rate_hz = ..` (frames a second) into a map"
                    .to_owned(),
            }),
            _ => Ok(1.0),
        }
    }

    /// The axes towards the back and upwards; `None` for what is not given.
    pub(super) fn axes(&self, format: Format) -> (Option<Axis>, Axis) {
        let up = self.file.up.as_deref().and_then(axis);
        let usual = match format {
            Format::Ag50x => (2, 1.0),
            Format::Edgetrak => (1, -1.0),
            _ => (1, 1.0),
        };
        (self.file.back.as_deref().and_then(axis), up.unwrap_or(usual))
    }
}

fn axis(text: &str) -> Option<Axis> {
    let (sign, letter) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    Some((["x", "y", "z"].iter().position(|a| *a == letter)?, sign))
}
