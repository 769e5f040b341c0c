//! A recording in the plane, before its points are divided into contour, coils and bones.

use tongue_core::geometry::{Point, Similarity};
use tongue_core::statistics::median;

use super::map::{AXES, MappedAxis};
use super::{Format, Map, ReadError, Recording, Role, names};

pub(super) type Places = Vec<Vec<Option<Point>>>;

/// A recording in metres: x is the axis to the back of the head, which may still be reversed, and y points upwards.
pub(super) struct Flat<'a> {
    pub recording: &'a Recording,
    pub roles: Vec<Role>,
    /// Channels of the contour in the order of the numbers at the ends of their names, because rows of a table may come in any order.
    pub contour: Vec<usize>,
    pub places: Places,
    pub times: Vec<f64>,
    pub metres: f64,
    /// The axis of the file to the back of the head, and whether it was guessed.
    pub back: MappedAxis,
    pub guessed: bool,
    pub notes: Vec<String>,
}

impl<'a> Flat<'a> {
    pub fn bone(&self, name: &str) -> Option<usize> {
        self.roles.iter().position(|role| matches!(role, Role::Bone(bone) if bone == name))
    }

    /// Median position of a channel, m.
    pub fn place(&self, channel: usize) -> Option<Point> {
        median_point(self.places.iter().filter_map(|frame| frame[channel]))
    }

    pub fn new(recording: &'a Recording, map: &Map) -> Result<Self, ReadError> {
        let wrong = |problem: String| recording.uninterpreted(problem);
        if let Some(problem) = map.unknown(&recording.channels) {
            return Err(wrong(problem));
        }
        let ((metres, note), seconds) = (map.metres(recording)?, map.seconds(recording)?);
        let roles = map.roles(&recording.channels);
        if !roles.iter().any(Role::is_of_tongue) {
            let known = recording.channels.join(", ");
            return Err(wrong(format!(
                "no channel is known as a point of the tongue (channels: {known}); name them in a map (--map) with lines such as {:?} = \"coil\" (or \"contour\") below [points]",
                recording.channels.first().map_or("T1", String::as_str)
            )));
        }
        let one_plane = recording.samples.iter().flat_map(|s| s.places.iter().flatten()).all(|p| p[0] == 0.0);
        let (back, mut up) = map.axes(recording.format, one_plane);
        let told_up = match upward_axis(recording, &roles, back, metres) {
            Some((found, why)) if recording.format == Format::Sensors && !map.stated().axes => {
                up = MappedAxis(found.ok_or_else(|| wrong(format!("{why}; {GIVE_UPWARD_AXIS}")))?, 1.0);
                Some(format!(
                    "its header does not say which axis leads upwards: {} is taken, since {why}; if that is wrong, give up in a map",
                    AXES[up.0]
                ))
            }
            Some((Some(found), why)) if found != up.0 => {
                let why = format!("{} leads upwards, but {why}", AXES[up.0]);
                if map.stated().axes {
                    Some(format!("{why}; if that is wrong, correct up in the map"))
                } else {
                    return Err(wrong(format!("{why}; {GIVE_UPWARD_AXIS}")));
                }
            }
            _ => None,
        };
        let guessed = back.is_none();
        let usual = if recording.format == Format::Est && one_plane { 1 } else { 0 };
        let back = back.unwrap_or_else(|| MappedAxis(axis_along(recording, &roles, up.0, usual), 1.0));
        let other_axis = (guessed && back.0 != usual && usual != up.0).then(|| {
            let [axis, usual] = [back.0, usual].map(|a| AXES[a]);
            format!(
                "the points of the tongue lie one behind the other along {axis}, not {usual}, so {axis} is taken for the axis to the back of \
                 the head; if that is wrong, give back in a map"
            )
        });
        if back.0 == up.0 {
            let problem = "the axes to the back and upwards are the same; give both in a map";
            return Err(wrong(problem.to_owned()));
        }
        let flat = |p: [f64; 3]| Point::new(back.1 * p[back.0], up.1 * p[up.0]) * metres;
        let mut places: Places =
            recording.samples.iter().map(|s| s.places.iter().map(|p| p.map(flat)).collect()).collect();
        let times: Vec<f64> = recording.samples.iter().map(|s| s.time_s * seconds).collect();
        let references = Role::channels(&roles, |role| *role == Role::Reference);
        if let Some(&tongue) = references.iter().find(|&&r| moves_as_a_tongue(&places, &times, r)) {
            let name = &recording.channels[tongue];
            return Err(wrong(format!(
                "{name} is called a reference in the map, but moves by millimetres within a tenth of a second, as only the tongue, the \
                 jaw and the lips do; take a point of the head (nose, upper incisor, behind an ear)"
            )));
        }
        remove_head_motion(&mut places, &references);
        let mut contour = Role::channels(&roles, |role| *role == Role::Contour);
        contour.sort_by_key(|&c| number(&recording.channels[c]));
        let unknown = recording.channels.iter().filter(|c| names::is_unknown(c) && !map.names(c));
        let unknown: Vec<&str> = unknown.map(String::as_str).collect();
        let unused = unknown.first().map(|first| {
            let names = unknown.chunks(5).next().unwrap_or_default().join(", ");
            let more = if unknown.len() > 5 { ", .." } else { "" };
            format!(
                "nothing is known of the channels {names}{more}, so they are not used; give their roles in a map (--map) with lines such as \
                 {first:?} = \"contour\" (or \"coil\", \"reference\", \"ignore\") below [points]"
            )
        });
        let notes = recording.notes.iter().cloned().chain(note).chain(told_up).chain(other_axis);
        let notes = notes.chain(unused).collect();
        Ok(Self { recording, roles, contour, places, times, metres, back, guessed, notes })
    }
}

const GIVE_UPWARD_AXIS: &str = "give the axis that grows upwards in a map, such as up = \"z\"";

/// The upward axis of coils, and the reason. The axis with the least spread is from side to side, because coils are glued to the middle of
/// a tongue. The upward axis is one of the other two: not the one to the back or, if this is not known, not x; of two that remain, the one
/// with less spread. The axis is `None` if the spreads do not show it, the result if the file has one plane or the coils have one position.
fn upward_axis(
    recording: &Recording,
    roles: &[Role],
    back: Option<MappedAxis>,
    metres: f64,
) -> Option<(Option<usize>, String)> {
    /// Least ratio of the spread upwards to that from side to side, and least spread upwards, mm: coils are glued to within 2 mm of the
    /// middle, and their heights differ by 10 mm and more.
    const RATIO: f64 = 2.0;
    const LEAST_MM: f64 = 4.0;
    let coils = Role::channels(roles, Role::is_sensor);
    let spreads = [0, 1, 2].map(|axis| {
        let seen =
            recording.samples.iter().flat_map(|s| coils.iter().filter_map(|c| Some(s.places[*c]?[axis])));
        let mut all: Vec<f64> = seen.collect();
        all.sort_unstable_by(f64::total_cmp);
        let [most, least] = [9, 1].map(|tenths| all.get(all.len() * tenths / 10).copied());
        most.zip(least).map_or(0.0, |(most, least)| (most - least) * metres * 1e3)
    });
    let ascending = |a: &usize, b: &usize| spreads[*a].total_cmp(&spreads[*b]);
    let side = (0..3).min_by(ascending)?;
    let up = (0..3).filter(|a| *a != side && back.map_or(*a != 0, |back| *a != back.0)).min_by(ascending)?;
    if recording.format != Format::Sensors && spreads[side] == 0.0 {
        return None;
    }
    let is_clear = spreads[up] >= LEAST_MM.max(RATIO * spreads[side]);
    let how = if is_clear { "hardly differ" } else { "do not differ much less than upwards" };
    let why = format!(
        "along {} the coils of the tongue {how} ({:.1} mm beside {:.1} mm along {})",
        AXES[side], spreads[side], spreads[up], AXES[up]
    );
    (spreads[up] > 0.0).then_some((is_clear.then_some(up), why))
}

/// The axis along the tongue, of the two that do not point upwards: the usual one, unless the points are more than twice as far apart along
/// the other.
fn axis_along(recording: &Recording, roles: &[Role], up: usize, usual: usize) -> usize {
    let spread = |axis: usize| {
        let medians = Role::channels(roles, Role::is_of_tongue)
            .into_iter()
            .filter_map(|c| median(recording.samples.iter().filter_map(|s| Some(s.places[c]?[axis]))));
        let [least, most] = medians.fold([f64::INFINITY, -f64::INFINITY], |[a, b], v| [v.min(a), v.max(b)]);
        (most - least).max(0.0)
    };
    let other = (0..3).find(|a| *a != up && *a != usual).unwrap_or(usual);
    if usual == up || spread(other) > 2.0 * spread(usual) { other } else { usual }
}

fn number(name: &str) -> u64 {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    name[stem.len()..].parse().unwrap_or(u64::MAX)
}

/// Medians of x and of y; `None` without points.
pub fn median_point(points: impl Iterator<Item = Point>) -> Option<Point> {
    let all: Vec<Point> = points.collect();
    let [x, y] = [0, 1].map(|axis| median(all.iter().map(|p| p[axis])));
    Some(Point::new(x?, y?))
}

/// Whether the median displacement of a channel within a tenth of a second is larger than a head's.
fn moves_as_a_tongue(frames: &[Vec<Option<Point>>], times: &[f64], channel: usize) -> bool {
    const WINDOW_S: f64 = 0.1;
    const HEAD_MOVES_M: f64 = 3e-3;
    const FEWEST: usize = 20;
    let mut later = 0;
    let steps = (0..frames.len()).filter_map(|f| {
        while later < frames.len() && times[later] < times[f] + WINDOW_S {
            later += 1;
        }
        Some((frames.get(later)?[channel]? - frames[f][channel]?).norm())
    });
    let steps: Vec<f64> = steps.collect();
    steps.len() >= FEWEST && median(steps).is_some_and(|m| m > HEAD_MOVES_M)
}

/// Moves every frame so that the reference points are where they are in the first frame that has all of them: shifted for one point,
/// shifted and turned for several. In frames that lack one, all points count as not seen.
fn remove_head_motion(frames: &mut [Vec<Option<Point>>], references: &[usize]) {
    if references.is_empty() {
        return;
    }
    let held = |frame: &[Option<Point>]| references.iter().map(|&r| frame[r]).collect::<Option<Vec<_>>>();
    let Some(base) = frames.iter().find_map(|f| held(f)) else { return };
    for frame in frames {
        let motion = held(frame).and_then(|here| Similarity::rigid(&here, &base));
        frame.iter_mut().for_each(|p| *p = p.zip(motion.as_ref()).map(|(p, m)| m.place(p)));
    }
}

/// Largest angle of the line from the mental spine to the hyoid to the horizontal, degrees.
pub const STEEPEST_BONES_DEG: f64 = 60.0;

pub fn steep_deg(apart: Point) -> f64 {
    apart.y.abs().atan2(apart.x.abs()).to_degrees()
}
