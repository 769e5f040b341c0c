//! Map of a recording: a TOML file that gives the meaning of channels, and its template with the likely role of every channel. Without a
//! map the names of channels decide. The keys are in `docs/guide.md`, and explained in every map that [`Map::template`] writes.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Deserialize;

use super::names::{self, Role};
use super::{Format, ReadError, Recording, Times};
use crate::measured::lengths::text::clip;
use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::statistics::{least_by, median};
use tongue_core::toml_text::{self, reworded};
use tongue_core::{choice, limits};

/// Standard deviation of a contour point, m: of DeepLabCut keypoints on ultrasound (AAA's models differ by 0.93 mm from human labels).
pub const CONTOUR_SD_M: f64 = 0.93e-3;
/// Standard deviation of an electromagnetic sensor, m: that of the AG500; newer systems are better.
pub const SENSOR_SD_M: f64 = 0.5e-3;

/// Standard deviation of the observed place of a bone, m.
pub(super) const BONE_POINT_SD_M: f64 = 1e-3;
/// The line of a map that leaves the bones of a recording out.
pub const WITHOUT_BONES: &str = "points = { hyoid = \"ignore\", mental_spine = \"ignore\" }";

/// Whether the map states the unit and the upward axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stated {
    pub unit: bool,
    pub axes: bool,
}

#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    #[serde(skip)]
    origin: String,
    unit_mm: Option<f64>,
    rate_hz: Option<f64>,
    back: Option<MappedAxis>,
    up: Option<MappedAxis>,
    pub(super) contour_frame: Option<ContourFrame>,
    noise_mm: Option<f64>,
    scale: Option<f64>,
    turn_deg: Option<f64>,
    shift_mm: Option<[f64; 2]>,
    #[serde(default)]
    points: BTreeMap<String, MapEntry>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ContourFrame {
    /// Origin at the hyoid of each sample, x towards the mandible.
    Hyoid,
    Bones,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TablePoint {
    surface_mm: Option<f64>,
    coil: Option<f64>,
    bone: Option<String>,
    contour: Option<bool>,
    noise_mm: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "toml::Value")]
struct MapEntry {
    role: Role,
    noise_mm: Option<f64>,
}

const ROLES: &str = "write \"contour\", \"coil\", \"reference\", \"ignore\", { coil = 1 }, { surface_mm = 10 } or { bone = \"hyoid\" }";
/// A map without points, in which the name of the recording, the lines of its unit and its rate, and its upward axis are filled in.
const TEMPLATE: &str = include_str!("map_template.toml");
/// Usual distance of neighbouring coils, mm. The unit that brings them nearest to it is taken: metres, centimetres, millimetres, or
/// hundredths or thousandths of these.
const USUAL_GAP_MM: f64 = 15.0;

/// An axis of the file, and its sign.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct MappedAxis(pub usize, pub f64);

impl TryFrom<String> for MappedAxis {
    type Error = String;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let letter = text.strip_prefix(['-', '+']).unwrap_or(&text);
        let axis = AXES.iter().position(|axis| *axis == letter);
        let axis = axis.ok_or_else(|| format!("{text:?} is not one of the axes x, y, z, -x, -y, -z"))?;
        Ok(Self(axis, if text.starts_with('-') { -1.0 } else { 1.0 }))
    }
}

pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

impl Map {
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ReadError> {
        let wrong = |place: String, problem: String| {
            ReadError::Refused(format!("the map {origin}{place}: {problem}"))
        };
        let file: Self = toml_text::read(text).map_err(|e| {
            let line = clip(text.lines().nth(e.line - 1).unwrap_or_default());
            wrong(format!(":{}", e.line), format!("{} (in `{line}`)", toml_text::with_nearest(&e.problem)))
        })?;
        let at = |word: &str, problem: String| {
            let line = text.lines().position(|l| l.trim_start().starts_with(word));
            Err(wrong(line.map_or_else(String::new, |n| format!(":{}", n + 1)), problem))
        };
        let [right, up] = file.shift_mm.map(|[x, y]| [Some(x), Some(y)]).unwrap_or_default();
        for (limit, value) in [
            (&limits::UNIT_MM, file.unit_mm),
            (&limits::RATE_HZ, file.rate_hz),
            (&limits::NOISE_MM, file.noise_mm),
            (&limits::SCALE, file.scale),
            (&limits::TURN_DEG, file.turn_deg),
            (&limits::SHIFT_MM, right),
            (&limits::SHIFT_MM, up),
        ] {
            if let Some(Err(beyond)) = value.map(|value| limit.check(value)) {
                return at(limit.name, beyond.to_string());
            }
        }
        if file.back.zip(file.up).is_some_and(|(back, up)| back.0 == up.0) {
            return at("up", "back and up are the same axis; give two".to_owned());
        }
        Ok(Self { origin: origin.to_owned(), ..file })
    }

    /// The transformation of the recording (m, in the axes of the body) that the map states. Only with a shift does it lead to the body's
    /// frame ([`Map::is_in_frame`]).
    pub fn placement(&self) -> Option<Similarity> {
        let Self { scale, turn_deg, shift_mm, .. } = self;
        if scale.is_none() && turn_deg.is_none() && shift_mm.is_none() {
            return None;
        }
        let shift = Point::from(shift_mm.unwrap_or_default()) * 1e-3;
        Some(Similarity::new(scale.unwrap_or(1.0), turn_deg.unwrap_or(0.0).to_radians(), shift))
    }

    /// Whether the recording is in the body's frame after [`Map::placement`]; one that is only turned or multiplied is not.
    pub fn is_in_frame(&self) -> bool {
        self.shift_mm.is_some()
    }

    pub(super) fn stated(&self) -> Stated {
        Stated { unit: self.unit_mm.is_some(), axes: self.up.is_some() }
    }

    pub(super) fn unknown<'a>(&'a self, channels: &'a [String]) -> Option<String> {
        let mut names = self.points.keys().filter(|name| !channels.contains(name));
        let name = names.find(|n| ![HYOID, MANDIBLE].contains(&n.as_str()) || !self.ignores(n))?;
        Some(format!(
            "the map {} names the point {name:?}; {}",
            self.origin,
            choice::hint(name, channels.iter().map(String::as_str))
        ))
    }

    pub(super) fn names(&self, channel: &str) -> bool {
        self.points.contains_key(channel)
    }

    /// The roles of channels, by the map or by their names. A coil whose name says that it is on the jaw moves with the mandible; beside a
    /// contour, the hyoid or the mental spine, which place a body, it is not used, because it is elsewhere on the mandible.
    pub(super) fn roles(&self, channels: &[String]) -> Vec<Role> {
        let roles: Vec<Role> = channels.iter().map(|c| self.role(c)).collect();
        let is_by_name = |c: &String| names::bone(c).is_none() && !self.names(c);
        let is_mandible = |role: &Role| matches!(role, Role::Bone(bone) if bone == MANDIBLE);
        let others = channels.iter().zip(&roles).any(|(c, role)| {
            *role == Role::Contour
                || matches!(role, Role::Bone(bone) if bone == HYOID)
                || (is_mandible(role) && !is_by_name(c))
        });
        // A map may also ignore a bone by the bone's name when its channel has another name.
        let is_left_out = |bone: &String| !channels.contains(bone) && self.ignores(bone);
        Vec::from_iter(roles.into_iter().zip(channels).map(|(role, c)| match &role {
            Role::Bone(bone) if is_left_out(bone) || (is_mandible(&role) && is_by_name(c) && others) => {
                Role::Ignored
            }
            _ => role,
        }))
    }

    fn role(&self, channel: &str) -> Role {
        self.points.get(channel).map_or_else(|| names::role(channel), |e| e.role.clone())
    }

    fn ignores(&self, name: &str) -> bool {
        self.points.get(name).is_some_and(|e| e.role == Role::Ignored)
    }

    /// Standard deviation of a channel, m: that of the map's point, else of the file, else of the map, else the usual one.
    pub(super) fn sd(&self, channel: &str, role: &Role, in_file: Option<f64>) -> f64 {
        let own = self.points.get(channel).and_then(|e| e.noise_mm);
        let usual = if role.is_sensor() { SENSOR_SD_M } else { CONTOUR_SD_M };
        own.map(|mm| mm * 1e-3).or(in_file).or(self.noise_mm.map(|mm| mm * 1e-3)).unwrap_or(usual)
    }

    /// Metres in a unit of the file, and a note for the user. If neither the map nor the format gives the unit, it is found from the
    /// distances of coils.
    pub(super) fn metres(&self, recording: &Recording) -> Result<(f64, Option<String>), ReadError> {
        if let Some(metres) = self.unit_mm.map(|mm| mm * 1e-3).or(recording.metres) {
            return Ok((metres, None));
        }
        let roles: Vec<Role> = recording.channels.iter().map(|c| self.role(c)).collect();
        let coils = Role::channels(&roles, Role::is_sensor);
        let gap = recording.middle_gap(&coils).ok_or_else(|| {
            let problem = "its format does not have a unit; write `unit_mm = ..` (millimetres in a unit, or in a pixel) into a map and give \
                           that with --map";
            recording.uninterpreted(problem.to_owned())
        })?;
        let units = [1e3, 10.0, 1.0, 1e-2, 1e-3];
        let mm = least_by(units, |mm| (gap * mm / USUAL_GAP_MM).ln().abs()).unwrap_or(1.0);
        let message = format!(
            "its format does not have a unit; taken as {mm} mm, with which its coils lie {:.0} mm apart (unit_mm in a \
             map says it)",
            gap * mm
        );
        Ok((mm * 1e-3, Some(message)))
    }

    pub(super) fn seconds(&self, recording: &Recording) -> Result<f64, ReadError> {
        let wrong = |problem: &str| Err(recording.uninterpreted(problem.to_owned()));
        match (self.rate_hz, recording.times) {
            (Some(_), Times::InFile) => wrong("the file has its own times; take rate_hz out of the map"),
            (Some(rate), Times::Usual(usual)) => Ok(usual / rate),
            (Some(rate), Times::Frames) => Ok(1.0 / rate),
            (None, Times::Frames) if recording.samples.len() > 1 => {
                wrong("its format has no times; write `rate_hz = ..` (frames a second) into a map")
            }
            _ => Ok(1.0),
        }
    }

    /// The axis to the back, `None` if neither the map nor the format gives it, and the upward axis. `flat`: whether all x are zero, as in
    /// a track with only y and z.
    pub(super) fn axes(&self, format: Format, flat: bool) -> (Option<MappedAxis>, MappedAxis) {
        let (back, up) = match format {
            Format::Ag50x | Format::Mview => (None, MappedAxis(2, 1.0)),
            Format::Edgetrak | Format::DeepLabCut => (None, MappedAxis(1, -1.0)),
            // Its x axis points to the front.
            Format::Microbeam => (Some(MappedAxis(0, -1.0)), MappedAxis(1, 1.0)),
            Format::Est if flat => (None, MappedAxis(2, 1.0)),
            _ => (None, MappedAxis(1, 1.0)),
        };
        (self.back.or(back), self.up.unwrap_or(up))
    }
}

impl TryFrom<toml::Value> for MapEntry {
    type Error = String;

    fn try_from(value: toml::Value) -> Result<Self, Self::Error> {
        if let toml::Value::String(word) = &value {
            let roles = [Role::Contour, Role::Coil(None), Role::Reference, Role::Ignored];
            let words = ["contour", "coil", "reference", "ignore"];
            let named = words.into_iter().zip(roles).find(|(w, _)| w == word);
            let (_, role) = named
                .ok_or_else(|| format!("{word:?} is not a role; {}; {ROLES}", choice::hint(word, words)))?;
            return Ok(Self { role, noise_mm: None });
        }
        let given: Result<TablePoint, toml::de::Error> = value.try_into();
        let given = given.map_err(|e| {
            let key = e.to_string().replace(e.message(), "");
            let message = format!("{} {}", reworded(e.message()), key.trim());
            format!("{}; {ROLES}", message.trim_end())
        })?;
        let mut roles: Vec<Role> = Vec::new();
        if let Some(mm) = given.surface_mm {
            limits::SURFACE_MM.check(mm).map_err(|beyond| beyond.to_string())?;
            roles.push(Role::Surface(mm * 1e-3));
        }
        if let Some(nth) = given.coil {
            if !(1.0..=99.0).contains(&nth) || nth.fract() != 0.0 {
                return Err(format!("coil is {nth}; count the coils from the tip backwards: 1, 2, 3"));
            }
            roles.push(Role::Coil(Some(nth as u32)));
        }
        roles.extend(given.bone.map(Role::Bone));
        roles.extend(given.contour.map(|_| Role::Contour));
        if let Some(mm) = given.noise_mm {
            limits::NOISE_MM.check(mm).map_err(|beyond| beyond.to_string())?;
        }
        match &roles[..] {
            [Role::Bone(name)] if name.is_empty() => {
                Err("bone is \"\"; give its name, like \"hyoid\"".to_owned())
            }
            [role] if given.contour != Some(false) => {
                Ok(Self { role: role.clone(), noise_mm: given.noise_mm })
            }
            _ => Err("give one of surface_mm, coil, bone and contour = true".to_owned()),
        }
    }
}

impl Map {
    /// A map (TOML) for a user to correct, with the roles that the names of channels suggest, and the position and motion of every channel
    /// in comments.
    pub fn template(recording: &Recording) -> String {
        let map = Self::default();
        let name = recording.name.replace(char::is_control, " ");
        let what = "millimetres in a unit of the file";
        let unit = match (recording.metres, map.metres(recording)) {
            (Some(metres), _) => format!("# unit_mm = {}  # {what}: the format says it", metres * 1e3),
            (None, Ok((metres, _))) => {
                format!("unit_mm = {}  # {what}: guessed from the way from coil to coil", metres * 1e3)
            }
            (None, Err(_)) => format!("unit_mm = 1.0  # {what} (in a pixel): WRITE YOURS"),
        };
        let rate = match recording.times {
            Times::InFile => "# The file has its own times: no rate_hz.".to_owned(),
            Times::Usual(hz) => format!("# rate_hz = {hz}  # frames a second: usual with this instrument"),
            Times::Frames => "rate_hz = 60.0  # frames a second: WRITE YOURS".to_owned(),
        };
        let (_, up) = map.axes(recording.format, false);
        // The name comes last, because it may contain anything.
        let text = TEMPLATE.replace("{unit}", &unit).replace("{rate}", &rate).replace("{up}", AXES[up.0]);
        let mut text = text.replace("{name}", &name);
        let roles = map.roles(&recording.channels);
        for (nth, (channel, role)) in recording.channels.iter().zip(roles).enumerate() {
            let key = toml::Value::String(channel.clone());
            let role = match role {
                Role::Contour => "\"contour\"".to_owned(),
                Role::Coil(_) => "\"coil\"".to_owned(),
                Role::Bone(bone) => format!("{{ bone = \"{bone}\" }}"),
                _ => "\"ignore\"".to_owned(),
            };
            let _ = writeln!(text, "{key} = {role}  # {}", typical_place(recording, nth));
        }
        text
    }
}

/// Median position of a channel and its median distance from there, in the unit of the file.
fn typical_place(recording: &Recording, channel: usize) -> String {
    let places = recording.samples.iter().filter_map(|s| s.places[channel]);
    let middle: Option<Vec<f64>> = (0..3).map(|axis| median(places.clone().map(|p| p[axis]))).collect();
    let Some(middle) = middle else { return "never seen".to_owned() };
    let away = places.clone().map(|p| (0..3).map(|a| (p[a] - middle[a]).powi(2)).sum::<f64>().sqrt());
    let moves = median(away).unwrap_or(0.0);
    let (count, missing) = (recording.samples.len(), recording.samples.len() - places.count());
    let gone = if missing > 0 { format!(", not seen in {missing} of {count} frames") } else { String::new() };
    let [x, y, z] = [middle[0], middle[1], middle[2]];
    format!("at x {x:.4}, y {y:.4}, z {z:.4}, half of the time within {moves:.3} of there{gone}")
}
