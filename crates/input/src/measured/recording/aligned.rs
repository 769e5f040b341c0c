//! A recording in the frame of a body: metres, x to the back of the head, y up.

use std::collections::BTreeMap;

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;

use super::super::error::ReadError;
use super::channels::{carry_by_coils, median_place, median_x, places_of_coils, rise_of_contour};
use super::contour_frame::{self, SampleFrame};
use super::flat::Flat;
use super::front::Front;
use super::map::CONTOUR_SD_M;
use super::{Format, Label, Map, Recording, Role, names};

/// Ends of a contour whose heights differ by less are level, m: the first point is then taken for the root.
const LEVEL_M: f64 = 1e-3;
/// Fewer points do not show which end is at the root.
const FEWEST_OF_ARCH: usize = 4;
/// Standard deviation of a bone, m.
pub(super) const BONE_SD_M: f64 = 1e-3;
const REVERSED: &str =
    "the contour runs from the tip to the root (its lower end is the root), and was turned round";

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    pub at: Point,
    pub sd: f64,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedFrame {
    pub time_s: f64,
    /// Contour points, in the order of [`AlignedRecording::contour`].
    pub contour: Vec<Option<Mark>>,
    /// Sensors, in the order of [`AlignedRecording::sensors`].
    pub sensors: Vec<Option<Mark>>,
    /// Bones, in the order of [`AlignedRecording::bones`].
    pub bones: Vec<Option<Point>>,
}

/// Whether a map states the unit, and the axis upwards.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stated {
    pub unit: bool,
    pub axes: bool,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedRecording {
    pub name: String,
    pub speaker: Option<String>,
    pub contour: Vec<String>,
    /// Names of the sensors and the distance of each behind the tip along the surface at rest, m; in order
    /// from the tip if distances were not measured.
    pub sensors: Vec<(String, f64)>,
    /// Whether the distance of each sensor was measured; otherwise it is a usual value.
    pub measured: Vec<bool>,
    pub bones: Vec<String>,
    pub ignored: Vec<String>,
    /// Whether the axis to the back is reversed against the file: its face looks to the right.
    pub mirrored: bool,
    /// Assumptions to report to the user.
    pub notes: Vec<String>,
    /// What its map states, so that it is not doubted.
    pub stated: Stated,
    pub labels: Vec<Label>,
    pub frames: Vec<AlignedFrame>,
}

impl AlignedFrame {
    /// The points of the tongue: of the contour, then sensors.
    pub fn points(&self) -> impl Iterator<Item = Option<Mark>> {
        self.contour.iter().chain(&self.sensors).copied()
    }

    /// The points of the tongue, then the bones, in the order of [`AlignedRecording::names`].
    pub(super) fn all(&self) -> impl Iterator<Item = Option<Mark>> {
        self.points().chain(self.bones.iter().map(|bone| bone.map(|at| Mark { at, sd: BONE_SD_M })))
    }

    /// Takes a point out, by its number among the names of its recording.
    pub(super) fn forget(&mut self, point: usize) {
        let tongue = self.contour.len() + self.sensors.len();
        match self.contour.iter_mut().chain(&mut self.sensors).nth(point) {
            Some(mark) => *mark = None,
            None => self.bones[point - tongue] = None,
        }
    }
}

impl AlignedRecording {
    /// Names of the points of the contour, then of sensors, then of bones.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        self.contour.iter().chain(self.sensors.iter().map(|(name, _)| name)).chain(&self.bones)
    }

    /// The frames that show a point, by its number among the names, with their times.
    pub(super) fn course(&self, point: usize) -> impl Iterator<Item = (f64, Mark)> {
        self.frames.iter().filter_map(move |f| Some((f.time_s, f.all().nth(point)??)))
    }

    /// Contours in the frame of a body, m, a frame of each; the points are in the order of the contour.
    pub fn of_contours(contours: &[&[Point]]) -> Self {
        let most = contours.iter().map(|c| c.len()).max().unwrap_or(0);
        let frames = contours.iter().map(|points| AlignedFrame {
            contour: (0..most).map(|i| points.get(i).map(|&at| Mark { at, sd: CONTOUR_SD_M })).collect(),
            ..AlignedFrame::default()
        });
        Self {
            contour: (1..=most).map(|i| format!("point {i}")).collect(),
            frames: frames.collect(),
            ..Self::default()
        }
    }

    /// Interprets a recording with its map, as [`AlignedRecording::all`] does.
    ///
    /// # Errors
    /// [`ReadError`] if the recording lacks a point of the map, if the unit or the rate is unknown, or if no
    /// channel is usable.
    pub fn new(recording: &Recording, map: &Map) -> Result<Self, ReadError> {
        let flat = Flat::new(recording, map)?;
        let frame = SampleFrame::of(&[&flat], map);
        Self::of(flat, frame, map)
    }

    /// Interprets recordings with their map. Those of one speaker with the same channels are exported alike, so the frame of their
    /// contours is found from all of them.
    ///
    /// If no map gives the axis to the back of the head, it is x, reversed if the mental spine lies at larger
    /// x than the hyoid. Without these bones it is reversed if the lower end of the contour, which is the root, lies at smaller x than
    /// the other; with coils only, if the one at the tip lies at larger x than the others.
    pub fn all(recordings: &[&Recording], map: &Map) -> Vec<Result<Self, ReadError>> {
        let flat: Vec<_> = recordings.iter().map(|r| Flat::new(r, map)).collect();
        let key = |r: &Recording| (r.speaker.clone(), r.channels.clone());
        let mut groups: BTreeMap<_, Vec<&Flat<'_>>> = BTreeMap::new();
        flat.iter().flatten().for_each(|one| groups.entry(key(one.recording)).or_default().push(one));
        let frames: BTreeMap<_, _> =
            groups.into_iter().map(|(key, group)| (key, SampleFrame::of(&group, map))).collect();
        Vec::from_iter(flat.into_iter().map(|one| {
            let one = one?;
            let frame = frames.get(&key(one.recording)).cloned().unwrap_or(Ok(None));
            Self::of(one, frame, map)
        }))
    }

    fn of(flat: Flat<'_>, frame: Result<Option<SampleFrame>, String>, map: &Map) -> Result<Self, ReadError> {
        let Flat { recording, roles, mut contour, mut places, times, metres, back, guessed, mut notes } =
            flat;
        let wrong = |problem: String| recording.uninterpreted(problem);
        let of = |wanted: fn(&Role) -> bool| -> Vec<usize> {
            (0..roles.len()).filter(|&c| wanted(&roles[c])).collect()
        };
        let mut sensors = of(|r| matches!(r, Role::Surface(_) | Role::Coil(_)));
        let mut bones = of(|r| matches!(r, Role::Bone(_)));
        if let Some(frame) = frame.map_err(wrong)? {
            frame.bring_back(&mut places, &contour);
            notes.push(contour_frame::TOLD.to_owned());
        }
        let bone = |wanted: &str| {
            bones.iter().copied().find(|&c| matches!(&roles[c], Role::Bone(name) if name == wanted))
        };
        // The front end must have the smaller x: of the bones, or of the contour if these were not seen.
        let of_bones = bone(MANDIBLE)
            .zip(bone(HYOID))
            .and_then(|(front, rear): (usize, usize)| median_x(&places, front).zip(median_x(&places, rear)));
        // The lower end of a contour is the root, and the one nearer to the hyoid.
        let rise = rise_of_contour(&places, &contour);
        let nearer_to_spine = |c: &usize| {
            let [at, spine, hyoid] =
                [Some(*c), bone(MANDIBLE), bone(HYOID)].map(|c| median_place(&places, c?));
            Some((at? - spine?).norm() - (at? - hyoid?).norm())
        };
        let by_bones =
            contour.first().and_then(nearer_to_spine).zip(contour.last().and_then(nearer_to_spine));
        let is_reversed = contour.len() >= FEWEST_OF_ARCH
            && rise.is_some_and(|rise| rise.y < -LEVEL_M)
            && by_bones.is_none_or(|(first, last)| first < last);
        if is_reversed {
            contour.reverse();
            notes.push(REVERSED.to_owned());
        }
        let by_contour = rise.filter(|_| of_bones.is_none());
        let by_contour = by_contour.map(|rise| if is_reversed { (0.0, rise.x) } else { (rise.x, 0.0) });
        let apart = of_bones.or(by_contour).or_else(|| ends(&sensors, &roles, &recording.channels, &places));
        if guessed && apart.is_none() && sensors.len() > 1 && contour.is_empty() {
            return Err(wrong(
                "which axis leads to the back of the head is not known: no coil is called a tip and no bone was seen; give back = \
                 \"x\" or \"-x\" in a map, or { coil = 1 } for the coil at the tip"
                    .to_owned(),
            ));
        }
        let mirrored = guessed && apart.is_some_and(|(front, rear)| front > rear);
        if by_contour.is_some() && guessed {
            notes.push(format!(
                "no two bones were seen: the lower end of the contour is taken for the root, so the back of the head is at {0}x; if that \
                 is wrong, give back = \"{1}x\" in a map",
                if mirrored { "-" } else { "" },
                if mirrored { "" } else { "-" }
            ));
        }
        if mirrored {
            places.iter_mut().flatten().flatten().for_each(|p| p.x = -p.x);
        }
        if let Some(placement) = map.placement() {
            places.iter_mut().flatten().flatten().for_each(|p| *p = placement.place(*p));
        }
        let behind = places_of_coils(&mut sensors, &roles, &places);
        if of_bones.is_none() && contour.is_empty() {
            let front = Front { channels: &recording.channels, places: &places, map };
            front.check(&sensors, &bones, &mut notes).map_err(wrong)?;
            let shows_front = recording.channels.iter().any(|c| names::is_in_front(c));
            if mirrored
                && !shows_front
                && recording.format == Format::Tidy
                && let Some(&tip) = sensors.first()
            {
                notes.push(format!(
                    "{} is taken for the coil at the tip and lies at larger x than the others, so the face looks to the right; if it looks \
                     to the left, the coils are exchanged: correct their names, or number them in a map",
                    recording.channels[tip]
                ));
            }
        }
        carry_by_coils(&mut places, &mut bones, &roles);
        let marks = |places: &[Option<Point>], likelihood: &[f32], of: &[usize]| -> Vec<Option<Mark>> {
            let marks = of.iter().map(|&c| {
                let sd = map.sd(&recording.channels[c], &roles[c], recording.sigma[c].map(|s| s * metres));
                // The variance is divided by the likelihood.
                let sd = sd / likelihood.get(c).map_or(1.0, |l| f64::from(*l)).sqrt();
                places[c].map(|at| Mark { at, sd })
            });
            marks.collect()
        };
        let names =
            |of: &[usize]| -> Vec<String> { of.iter().map(|&c| recording.channels[c].clone()).collect() };
        let bone_names = bones.iter().filter_map(|&c| match &roles[c] {
            Role::Bone(name) => Some(name.clone()),
            _ => None,
        });
        let frames = recording.samples.iter().zip(times).zip(&places);
        let frames = frames.map(|((sample, time_s), places)| AlignedFrame {
            time_s,
            contour: marks(places, &sample.likelihood, &contour),
            sensors: marks(places, &sample.likelihood, &sensors),
            bones: bones.iter().map(|&c| places[c]).collect(),
        });
        Ok(Self {
            name: recording.name.clone(),
            speaker: recording.speaker.clone(),
            contour: names(&contour),
            sensors: sensors.iter().zip(behind).map(|(&c, m)| (recording.channels[c].clone(), m)).collect(),
            measured: sensors.iter().map(|&c| matches!(roles[c], Role::Surface(_))).collect(),
            bones: bone_names.collect(),
            ignored: names(&of(|r| *r == Role::Ignored)),
            mirrored: mirrored != (back.1 < 0.0),
            notes,
            stated: map.stated(),
            labels: recording.labels.clone(),
            frames: frames.collect(),
        })
    }

    pub fn bone(&self, name: &str) -> Option<usize> {
        self.bones.iter().position(|b| b == name)
    }

    /// The recording with its coils at other distances behind the tip, m, by their names and whether their distances were measured; a coil
    /// without another one stays.
    #[must_use]
    pub fn with_coils(&self, behind: impl Fn(&str, bool) -> Option<f64>) -> Self {
        let mut seen = self.clone();
        for ((name, at), measured) in seen.sensors.iter_mut().zip(&seen.measured) {
            *at = behind(name, *measured).unwrap_or(*at);
        }
        seen
    }

    pub fn shows_bone(&self, name: &str) -> bool {
        self.bone(name).is_some_and(|b| self.frames.iter().any(|f| f.bones[b].is_some()))
    }

    /// Mean position of a bone over `window` frames around each (fewer at the ends and where it was not
    /// seen), m; if it was not seen in any of them, the nearest in time; `None` if it was never seen.
    pub fn bone_means(&self, bone: usize, window: usize) -> Vec<Option<Point>> {
        let at = |f: usize| self.frames[f].bones.get(bone).copied().flatten();
        let count = self.frames.len();
        let seen: Vec<usize> = (0..count).filter(|&f| at(f).is_some()).collect();
        let half = window / 2;
        Vec::from_iter((0..count).map(|f| {
            let near = (f.saturating_sub(half)..(f + half + 1).min(count)).filter_map(at);
            let near: Vec<Point> = near.collect();
            let nearest = || seen.iter().min_by_key(|s| s.abs_diff(f)).and_then(|&s| at(s));
            if near.is_empty() { nearest() } else { Some(near.iter().sum::<Point>() / near.len() as f64) }
        }))
    }
}

/// The median x of the coil at the tip and of the coil farthest from it.
fn ends(
    sensors: &[usize],
    roles: &[Role],
    channels: &[String],
    frames: &[Vec<Option<Point>>],
) -> Option<(f64, f64)> {
    let known = sensors.iter().filter_map(|c| match roles[*c] {
        Role::Surface(at) => Some((at, *c)),
        Role::Coil(Some(nth)) => Some((f64::from(nth), *c)),
        _ => None,
    });
    let front = known.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, c)| c);
    let is_tip = |c: &usize| names::is_tip(&channels[*c]) && matches!(roles[*c], Role::Coil(None));
    let front = front.or_else(|| sensors.iter().copied().find(is_tip))?;
    let x = median_x(frames, front)?;
    let others = sensors.iter().filter(|c| **c != front).filter_map(|c| median_x(frames, *c));
    let rear = others.max_by(|a, b| (a - x).abs().total_cmp(&(b - x).abs()))?;
    Some((x, rear))
}
