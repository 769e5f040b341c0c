//! A recording in the frame of a body: metres, x to the back of the head, y up.

use tongue_core::geometry::Point;

use super::channels::{hold_head, median_x, median_y, moves_as_a_tongue, places_of_coils};
use super::map::{Axis, CONTOUR_SD_M};
use super::{Format, Label, Map, Recording, RecordingError, Role, names};

/// A measured point and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Position, m.
    pub at: Point,
    /// Standard deviation, m.
    pub sd: f64,
}

/// Points at one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedFrame {
    /// Time, s.
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
    /// It states `unit_mm`.
    pub unit: bool,
    /// It states `up`.
    pub axes: bool,
}

/// A recording in the frame of a body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedRecording {
    /// Name of the recording.
    pub name: String,
    /// The speaker, if the file names one.
    pub speaker: Option<String>,
    /// Names of the contour points.
    pub contour: Vec<String>,
    /// Names of the sensors and the distance of each behind the tip along the surface at rest, m; in order
    /// from the tip if distances were not measured.
    pub sensors: Vec<(String, f64)>,
    /// Whether the distance of each sensor was measured; otherwise it is a usual value.
    pub measured: Vec<bool>,
    /// Names of the bones that were seen.
    pub bones: Vec<String>,
    /// Channels that are not used.
    pub ignored: Vec<String>,
    /// Whether the axis to the back is reversed against the file: its face looks to the right.
    pub mirrored: bool,
    /// Assumptions to report to the user.
    pub notes: Vec<String>,
    /// What its map states, so that it is not doubted.
    pub stated: Stated,
    /// Labelled stretches of time.
    pub labels: Vec<Label>,
    /// Frames in the order of time.
    pub frames: Vec<AlignedFrame>,
}

impl AlignedRecording {
    /// Contours in the frame of a body, m, a frame of each; the points are in the order of the contour.
    pub fn of_contours(contours: &[&[Point]]) -> Self {
        let most = contours.iter().map(|c| c.len()).max().unwrap_or(0);
        let frame = |points: &&[Point]| {
            let mark = |i: usize| points.get(i).map(|&at| Mark { at, sd: CONTOUR_SD_M });
            AlignedFrame { contour: (0..most).map(mark).collect(), ..AlignedFrame::default() }
        };
        Self {
            contour: (1..=most).map(|i| format!("point {i}")).collect(),
            frames: contours.iter().map(frame).collect(),
            ..Self::default()
        }
    }

    /// Interprets a recording with its map.
    ///
    /// If no map gives the axis to the back of the head, it is x, reversed if the mental spine lies at larger
    /// x than the hyoid. Without these bones it is reversed if the contour, which runs from the root to the
    /// tip, ends at larger x than it begins; with coils only, if the one at the tip lies at larger x than the
    /// others.
    ///
    /// # Errors
    /// [`RecordingError`] if the recording lacks a point of the map, if the unit or the rate is unknown, or if no
    /// channel is usable.
    pub fn new(recording: &Recording, map: &Map) -> Result<Self, RecordingError> {
        let wrong =
            |problem: String| RecordingError::Uninterpreted { recording: recording.name.clone(), problem };
        if let Some(problem) = map.unknown(&recording.channels) {
            return Err(wrong(problem));
        }
        let ((metres, note), seconds) = (map.metres(recording)?, map.seconds(recording)?);
        let roles: Vec<Role> = recording.channels.iter().map(|c| map.role(c)).collect();
        let of = |wanted: fn(&Role) -> bool| -> Vec<usize> {
            (0..roles.len()).filter(|&c| wanted(&roles[c])).collect()
        };
        let mut contour = of(|r| *r == Role::Contour);
        // Sorted by the number at the end of the name, so that rows of a table may come in any order.
        contour.sort_by_key(|&c| number(&recording.channels[c]));
        let mut sensors = of(|r| matches!(r, Role::Surface(_) | Role::Coil(_)));
        let bones = of(|r| matches!(r, Role::Bone(_)));
        let references = of(|r| *r == Role::Reference);
        if contour.is_empty() && sensors.is_empty() {
            let known = recording.channels.join(", ");
            return Err(wrong(format!(
                "no channel is known as a point of the tongue (channels: {known}); name one with --map"
            )));
        }
        let flat_file = recording.samples.iter().flat_map(|s| s.places.iter().flatten()).all(|p| p[0] == 0.0);
        let (back, up) = map.axes(recording.format, flat_file);
        let guessed = back.is_none();
        let usual = if recording.format == Format::Est && flat_file { 1 } else { 0 };
        let back = back.unwrap_or((usual, 1.0));
        if back.0 == up.0 {
            return Err(wrong(
                "the axes to the back and upwards are the same; give both in a map".to_owned(),
            ));
        }
        let mut frames: Vec<Vec<Option<Point>>> = recording
            .samples
            .iter()
            .map(|s| s.places.iter().map(|p| p.map(|p| flat(p, back, up) * metres)).collect())
            .collect();
        let times: Vec<f64> = recording.samples.iter().map(|s| s.time_s * seconds).collect();
        if let Some(&tongue) = references.iter().find(|&&r| moves_as_a_tongue(&frames, &times, r)) {
            let name = &recording.channels[tongue];
            return Err(wrong(format!(
                "{name} is called a reference in the map, but moves by millimetres within a tenth of a second, as only the tongue, the \
                 jaw and the lips do; take a point of the head (nose, upper incisor, behind an ear)"
            )));
        }
        hold_head(&mut frames, &references);
        let bone = |wanted: &str| {
            bones.iter().copied().find(|&c| matches!(&roles[c], Role::Bone(name) if name == wanted))
        };
        // The front end must have the smaller x: of the bones, or of the contour if these were not seen.
        let medians = |(front, rear): (usize, usize)| median_x(&frames, front).zip(median_x(&frames, rear));
        let of_bones =
            bone(tongue_core::body::MANDIBLE).zip(bone(tongue_core::body::HYOID)).and_then(medians);
        let of_contour = || contour.last().copied().zip(contour.first().copied()).and_then(medians);
        let of_coils = || ends(&sensors, &roles, &recording.channels, &frames);
        let by_contour = of_bones.is_none().then(of_contour).flatten();
        let apart = of_bones.or(by_contour).or_else(of_coils);
        if guessed && apart.is_none() && sensors.len() > 1 && contour.is_empty() {
            return Err(wrong(
                "which axis leads to the back of the head is not known: no coil is called a tip and no bone was seen; give back = \
                 \"x\" or \"-x\" in a map, or { coil = 1 } for the coil at the tip"
                    .to_owned(),
            ));
        }
        let mirrored = guessed && apart.is_some_and(|(front, rear)| front > rear);
        let taken_for_root = by_contour.filter(|_| guessed).map(|_| {
            format!(
                "no two bones were seen: the first point of the contour is taken for the root and its last for the tip, so the back of the \
                 head is at {0}x; if the contour runs the other way, give back = \"{1}x\" in a map",
                if mirrored { "-" } else { "" },
                if mirrored { "" } else { "-" }
            )
        });
        if mirrored {
            frames.iter_mut().flatten().flatten().for_each(|p| p.x = -p.x);
        }
        if let Some(placement) = map.placement() {
            frames.iter_mut().flatten().flatten().for_each(|p| *p = placement.place(*p));
        }
        let behind = places_of_coils(&mut sensors, &roles, &frames);
        let by_coils = of_bones.is_none() && contour.is_empty();
        if let Some(problem) = wrong_by_lips(&sensors, &recording.channels, map, &frames).filter(|_| by_coils)
        {
            return Err(wrong(problem));
        }
        let shows_front = recording.channels.iter().any(|c| names::is_in_front(c));
        let faces_right = sensors
            .first()
            .filter(|_| mirrored && by_coils && recording.format == Format::Tidy && !shows_front);
        let faces_right = faces_right.map(|&tip| {
            format!(
                "{} is taken for the coil at the tip and lies at larger x than the others, so the face looks to the right; if it looks to \
                 the left, the coils are exchanged: correct their names, or number them in a map",
                recording.channels[tip]
            )
        });
        let marks = |places: &[Option<Point>], likelihood: &[f32], of: &[usize]| -> Vec<Option<Mark>> {
            let mark = |&c: &usize| {
                let sd = map.sd(&recording.channels[c], &roles[c], recording.sigma[c].map(|s| s * metres));
                // The variance is divided by the likelihood.
                let sd = sd / likelihood.get(c).map_or(1.0, |l| f64::from(*l)).sqrt();
                places[c].map(|at| Mark { at, sd })
            };
            of.iter().map(mark).collect()
        };
        let names =
            |of: &[usize]| -> Vec<String> { of.iter().map(|&c| recording.channels[c].clone()).collect() };
        let bone_names = bones.iter().filter_map(|&c| match &roles[c] {
            Role::Bone(name) => Some(name.clone()),
            _ => None,
        });
        let frames = recording.samples.iter().zip(&frames).map(|(sample, places)| AlignedFrame {
            time_s: sample.time_s * seconds,
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
            notes: recording
                .notes
                .iter()
                .cloned()
                .chain(note)
                .chain(taken_for_root)
                .chain(faces_right)
                .collect(),
            stated: map.stated(),
            labels: recording.labels.clone(),
            frames: frames.collect(),
        })
    }

    /// The number of a bone among those that were seen.
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

    /// Whether a bone was seen in any frame.
    pub fn shows_bone(&self, name: &str) -> bool {
        self.bone(name).is_some_and(|b| self.frames.iter().any(|f| f.bones[b].is_some()))
    }

    /// Mean position of a bone over `window` frames around each (fewer at the ends and where it was not
    /// seen), m; if it was not seen in any of them, the nearest in time; `None` if it was never seen.
    pub fn bone_means(&self, bone: usize, window: usize) -> Vec<Option<Point>> {
        let at = |f: usize| self.frames[f].bones.get(bone).copied().flatten();
        let seen: Vec<usize> = (0..self.frames.len()).filter(|&f| at(f).is_some()).collect();
        let half = window / 2;
        (0..self.frames.len())
            .map(|f| {
                let (low, high) = (f.saturating_sub(half), (f + half + 1).min(self.frames.len()));
                let near: Vec<Point> = (low..high).filter_map(at).collect();
                match near.is_empty() {
                    false => Some(near.iter().sum::<Point>() / near.len() as f64),
                    true => seen.iter().min_by_key(|&&s| s.abs_diff(f)).and_then(|&s| at(s)),
                }
            })
            .collect()
    }
}

/// The median x of the coil at the tip and of the coil farthest from it.
fn ends(
    sensors: &[usize],
    roles: &[Role],
    channels: &[String],
    frames: &[Vec<Option<Point>>],
) -> Option<(f64, f64)> {
    let tip = |c: &&usize| names::is_tip(&channels[**c]) && matches!(roles[**c], Role::Coil(None));
    let behind = |c: &usize| match roles[*c] {
        Role::Surface(at) => Some(at),
        Role::Coil(Some(nth)) => Some(f64::from(nth)),
        _ => None,
    };
    let known = sensors.iter().filter(|c| behind(c).is_some());
    let front = known.min_by(|a, b| behind(a).unwrap_or(0.0).total_cmp(&behind(b).unwrap_or(0.0)));
    let front = *front.or_else(|| sensors.iter().find(tip))?;
    let x = median_x(frames, front)?;
    let others = sensors.iter().filter(|c| **c != front).filter_map(|c| median_x(frames, *c));
    let rear = others.max_by(|a, b| (a - x).abs().total_cmp(&(b - x).abs()))?;
    Some((x, rear))
}

/// The problem of coils that lie in front of lips, incisors and jaw, or of lips that are upside down; those that
/// the map names are not judged.
fn wrong_by_lips(
    sensors: &[usize],
    channels: &[String],
    map: &Map,
    frames: &[Vec<Option<Point>>],
) -> Option<String> {
    const APART_M: f64 = 5e-3;
    let place = |c: usize| Some(Point::new(median_x(frames, c)?, median_y(frames, c)?));
    let named: Vec<usize> = (0..channels.len()).filter(|&c| !map.names(&channels[c])).collect();
    let lip = |upper: bool| {
        let found = named.iter().find(|&&c| names::lip(&channels[c]) == Some(upper));
        found.and_then(|&c| Some((&channels[c], place(c)?)))
    };
    if let Some(((upper, a), (lower, b))) = lip(true).zip(lip(false))
        && a.y < b.y - APART_M
    {
        let what = format!("{upper} lies below {lower}: the recording is upside down");
        return Some(format!("{what}; give the axis that grows upwards in a map, such as up = \"-y\""));
    }
    let (tip, rear) = (median_x(frames, *sensors.first()?)?, median_x(frames, *sensors.last()?)?);
    let front = named.iter().filter(|&&c| names::is_in_front(&channels[c]));
    let (name, at) = front.filter_map(|&c| Some((&channels[c], place(c)?))).next()?;
    (sensors.len() > 1 && (at.x - tip).abs() > (at.x - rear).abs() + APART_M).then(|| {
        format!(
            "{name} is nearer to the rear coil than to the one at the tip: the coils are exchanged, or the axis is; correct their names, or \
             back in a map"
        )
    })
}

/// The number at the end of a name.
fn number(name: &str) -> u64 {
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name.get(name.len() - digits..).and_then(|d| d.parse().ok()).unwrap_or(u64::MAX)
}

fn flat(p: [f64; 3], back: Axis, up: Axis) -> Point {
    Point::new(back.1 * p[back.0], up.1 * p[up.0])
}
