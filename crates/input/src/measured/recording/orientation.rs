//! Orientation of a recording in the head, from its map, bones, contour and coils: the axis to the back of the head, and the end of a
//! contour or chain of coils at the tip. Lips, incisors and coils on the jaw show whether axes or coils are exchanged.

use std::collections::BTreeMap;

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::{Point, Similarity};
use tongue_core::statistics::median;

use super::contour_frame::{self, SampleFrame};
use super::dynamics::FEWEST_FRAMES;
use super::flat::{Flat, median_point};
use super::{AlignedFrame, AlignedRecording, Format, Map, Mark, ReadError, Recording, Role, names};

/// Usual distance of the first coil behind the tip, m.
pub const FIRST_COIL_M: f64 = 8e-3;
/// Usual ratio of the distance of neighbouring coils along the surface to their straight distance.
pub const LONGER_THAN_CHORD: f64 = 1.03;
/// Ends of a contour whose heights differ by less, m, do not show the root, which is then the first point.
const LEVEL_M: f64 = 1e-3;
/// A contour with fewer points does not show which end is the root.
const FEWEST_OF_ARCH: usize = 4;
const REVERSED_NOTE: &str =
    "the contour runs from the tip to the root (its lower end is the root), and was turned round";

/// Smallest difference of positions that is judged, m.
const JUDGED_FROM_M: f64 = 5e-3;
/// A coil on the jaw is at the lower incisors and so in front of the tongue's first coil; largest distance behind that one, m.
const MOST_BEHIND_M: f64 = 3e-3;
/// When the tongue is low, its first coil is 2 to 8 mm above a coil at the lower incisors. If it is farther above or below by more than
/// this, m, the two are not in one frame.
const MOST_IN_HEIGHT_M: f64 = 15e-3;

/// From the coil below the lower incisors to the mental spine of the built-in body, m, in a head whose axes are those of the recording.
const INCISORS_TO_SPINE_M: Point = Point::new(14e-3, -20e-3);

impl AlignedRecording {
    /// Interprets a recording with its map, as [`AlignedRecording::all`] does.
    pub fn new(recording: &Recording, map: &Map) -> Result<Self, ReadError> {
        Self::all(&[recording], map).swap_remove(0)
    }

    /// Interprets recordings with their map. The frame of contours is found from all recordings of a speaker with the same channels, which
    /// are exported alike.
    ///
    /// If no map gives the axis to the back of the head, it is x: reversed if the mental spine lies at larger x than the hyoid; without
    /// these bones if the lower end of the contour, which is the root, lies at smaller x than the other; with coils only if the one at the
    /// tip lies at larger x than the others.
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
            let frame = frame.map_err(|problem| one.recording.uninterpreted(problem))?;
            Self::of(one, frame, map)
        }))
    }

    fn of(mut flat: Flat<'_>, frame: Option<SampleFrame>, map: &Map) -> Result<Self, ReadError> {
        let recording = flat.recording;
        let wrong = |problem: String| recording.uninterpreted(problem);
        let mut sensors = Role::channels(&flat.roles, Role::is_sensor);
        let mut bones = Role::channels(&flat.roles, |role| matches!(role, Role::Bone(_)));
        if let Some(frame) = frame {
            frame.move_to_bones(&mut flat.places, &flat.contour);
            flat.notes.push(contour_frame::NOTE.to_owned());
        }
        // The front has the smaller x: the mental spine, or the end of the contour at the tip if the bones were not seen.
        let [spine, hyoid] = [MANDIBLE, HYOID].map(|name| flat.place(flat.bone(name)?));
        let of_bones = spine.zip(hyoid).map(|(front, rear)| (front.x, rear.x));
        // The root is the lower end of a contour and the one nearer to the hyoid.
        let rise = flat.rise_of_contour();
        let nearer_to_spine = |c: &usize| {
            let at = flat.place(*c)?;
            Some((at - spine?).norm() - (at - hyoid?).norm())
        };
        let by_bones =
            flat.contour.first().and_then(nearer_to_spine).zip(flat.contour.last().and_then(nearer_to_spine));
        let is_reversed = flat.contour.len() >= FEWEST_OF_ARCH
            && rise.is_some_and(|rise| rise.y < -LEVEL_M)
            && by_bones.is_none_or(|(first, last)| first < last);
        if is_reversed {
            flat.contour.reverse();
            flat.notes.push(REVERSED_NOTE.to_owned());
        }
        let by_contour = rise.filter(|_| of_bones.is_none());
        let by_contour = by_contour.map(|rise| if is_reversed { (0.0, rise.x) } else { (rise.x, 0.0) });
        let apart = of_bones.or(by_contour).or_else(|| flat.ends_of_coils(&sensors));
        if flat.guessed && apart.is_none() && sensors.len() > 1 && flat.contour.is_empty() {
            let problem = "which axis leads to the back of the head is not known: no coil is called a tip and no bone was \
                           seen; give back = \"x\" or \"-x\" in a map, or { coil = 1 } for the coil at the tip";
            return Err(wrong(problem.to_owned()));
        }
        let mirrored = flat.guessed && apart.is_some_and(|(front, rear)| front > rear);
        if by_contour.is_some() && flat.guessed {
            flat.notes.push(format!(
                "no two bones were seen: the lower end of the contour is taken for the root, so the back of the head is at {0}x; if that \
                 is wrong, give back = \"{1}x\" in a map",
                if mirrored { "-" } else { "" },
                if mirrored { "" } else { "-" }
            ));
        }
        let side = if mirrored { -1.0 } else { 1.0 };
        let placement = map.placement();
        for place in flat.places.iter_mut().flatten().flatten() {
            place.x *= side;
            *place = placement.as_ref().map_or(*place, |to| to.place(*place));
        }
        let behind = flat.distances_of_coils(&mut sensors);
        if of_bones.is_none() && flat.contour.is_empty() {
            let doubt = flat.check_front(map, &sensors, &bones).map_err(wrong)?;
            flat.notes.extend(doubt);
            let shows_front = recording.channels.iter().any(|c| names::is_in_front(c));
            if mirrored
                && !shows_front
                && recording.format == Format::Tidy
                && let Some(&tip) = sensors.first()
            {
                flat.notes.push(format!(
                    "{} is taken for the coil at the tip and lies at larger x than the others, so the face looks to the right; if it looks \
                     to the left, the coils are exchanged: correct their names, or number them in a map",
                    recording.channels[tip]
                ));
            }
        }
        flat.move_bones_by_coils(&mut bones);
        let marks = |places: &[Option<Point>], likelihood: &[f32], of: &[usize]| -> Vec<Option<Mark>> {
            let marks = of.iter().map(|&c| {
                let in_file = recording.sigma[c].map(|sigma| sigma * flat.metres);
                let sd = map.sd(&recording.channels[c], &flat.roles[c], in_file)
                    / likelihood.get(c).map_or(1.0, |l| f64::from(*l)).sqrt();
                places[c].map(|at| Mark { at, sd })
            });
            marks.collect()
        };
        let names =
            |of: &[usize]| -> Vec<String> { of.iter().map(|&c| recording.channels[c].clone()).collect() };
        let bone_names = bones.iter().filter_map(|&c| match &flat.roles[c] {
            Role::Bone(name) => Some(name.clone()),
            _ => None,
        });
        let frames = recording.samples.iter().zip(&flat.times).zip(&flat.places);
        let frames = frames.map(|((sample, time_s), places)| AlignedFrame {
            time_s: *time_s,
            contour: marks(places, &sample.likelihood, &flat.contour),
            sensors: marks(places, &sample.likelihood, &sensors),
            bones: bones.iter().map(|&c| places[c]).collect(),
        });
        Ok(Self {
            name: recording.name.clone(),
            speaker: recording.speaker.clone(),
            contour: names(&flat.contour),
            sensors: sensors.iter().zip(behind).map(|(&c, m)| (recording.channels[c].clone(), m)).collect(),
            measured: sensors.iter().map(|&c| matches!(flat.roles[c], Role::Surface(_))).collect(),
            bones: bone_names.collect(),
            ignored: names(&Role::channels(&flat.roles, |role| *role == Role::Ignored)),
            mirrored: mirrored != (flat.back.1 < 0.0),
            stated: map.stated(),
            labels: recording.labels.clone(),
            frames: frames.collect(),
            notes: flat.notes,
        })
    }
}

impl Flat<'_> {
    /// Median vector from the first to the last seen point of the contour, m.
    fn rise_of_contour(&self) -> Option<Point> {
        median_point(self.places.iter().filter_map(|frame| {
            let mut seen = self.contour.iter().filter_map(|&c| frame[c]);
            let first = seen.next()?;
            Some(seen.next_back()? - first)
        }))
    }

    /// Median x of the coil at the tip and of the coil farthest from it along x.
    fn ends_of_coils(&self, sensors: &[usize]) -> Option<(f64, f64)> {
        let known = sensors.iter().filter_map(|c| match self.roles[*c] {
            Role::Surface(at) => Some((at, *c)),
            Role::Coil(Some(nth)) => Some((f64::from(nth), *c)),
            _ => None,
        });
        let front = known.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, c)| c);
        let is_tip = |c: &usize| {
            names::is_tip(&self.recording.channels[*c]) && matches!(self.roles[*c], Role::Coil(None))
        };
        let front = front.or_else(|| sensors.iter().copied().find(is_tip))?;
        let x = self.place(front)?.x;
        let others = sensors.iter().filter(|c| **c != front).filter_map(|c| Some(self.place(*c)?.x));
        let rear = others.max_by(|a, b| (a - x).abs().total_cmp(&(b - x).abs()))?;
        Some((x, rear))
    }

    /// Sorts coils from the tip backwards and returns the distance of each behind the tip, m: the measured or the usual one.
    fn distances_of_coils(&self, sensors: &mut [usize]) -> Vec<f64> {
        let nth = |c: usize| match self.roles[c] {
            Role::Coil(Some(nth)) => f64::from(nth),
            _ => f64::INFINITY,
        };
        let x = |c: usize| self.place(c).map_or(f64::INFINITY, |place| place.x);
        if sensors.iter().any(|&c| matches!(self.roles[c], Role::Coil(_))) {
            sensors.sort_by(|&a, &b| nth(a).total_cmp(&nth(b)).then(x(a).total_cmp(&x(b))));
        }
        let mut out: Vec<f64> = Vec::with_capacity(sensors.len());
        for (n, &c) in sensors.iter().enumerate() {
            out.push(match (&self.roles[c], n.checked_sub(1)) {
                (Role::Surface(at), _) => *at,
                (_, None) => FIRST_COIL_M,
                (_, Some(before)) => {
                    let gaps = self.places.iter().filter_map(|f| Some((f[sensors[before]]? - f[c]?).norm()));
                    out[before] + LONGER_THAN_CHORD * median(gaps).unwrap_or(FIRST_COIL_M)
                }
            });
        }
        out
    }

    /// Several coils that move with one bone also give its rotation: the first of them is moved to a point that they carry along rigidly,
    /// and the others are removed from `bones`. This point is the mental spine, which lies below and behind the incisors. In frames that
    /// lack one of the coils the bone counts as not seen.
    fn move_bones_by_coils(&mut self, bones: &mut Vec<usize>) {
        let all = std::mem::take(bones);
        for &coil in &all {
            if bones.iter().any(|&b| self.roles[b] == self.roles[coil]) {
                continue;
            }
            bones.push(coil);
            let alike = all.iter().copied().filter(|&b| self.roles[b] == self.roles[coil]);
            let (coils, base): (Vec<usize>, Vec<Point>) =
                alike.filter_map(|c| Some((c, self.place(c)?))).unzip();
            let Some(front) = base.iter().min_by(|a, b| a.x.total_cmp(&b.x)) else { continue };
            if base.len() < 2 {
                continue;
            }
            let carried = front + INCISORS_TO_SPINE_M;
            for frame in &mut self.places {
                let here: Option<Vec<Point>> = coils.iter().map(|&c| frame[c]).collect();
                let motion = here.and_then(|here| Similarity::rigid(&base, &here));
                frame[coil] = motion.map(|motion| motion.place(carried));
            }
        }
    }

    /// A doubt about a recording of coils without a contour. `sensors` are the coils on the tongue from the tip backwards, `jaw` those on
    /// the jaw. Channels that the map names are not judged.
    fn check_front(&self, map: &Map, sensors: &[usize], jaw: &[usize]) -> Result<Option<String>, String> {
        let channels = &self.recording.channels;
        let judged = || (0..channels.len()).filter(|&c| !map.names(&channels[c]));
        let placed = |c: usize| Some((channels[c].as_str(), self.place(c)?));
        let lip = |is_upper| judged().find(|&c| names::lip(&channels[c]) == Some(is_upper)).and_then(placed);
        if let Some(((upper, a), (lower, b))) = lip(true).zip(lip(false))
            && a.y < b.y - JUDGED_FROM_M
        {
            return Err(format!(
                "{upper} lies below {lower}: the recording is upside down; give the axis that grows upwards in a map, such as up = \"-y\""
            ));
        }
        let ends =
            sensors.first().zip(sensors.last()).and_then(|(&tip, &rear)| placed(tip).zip(placed(rear)));
        let Some(((first, tip), (_, rear))) = ends else { return Ok(None) };
        let front = judged().filter(|&c| names::is_in_front(&channels[c])).filter_map(placed);
        let front: Vec<(&str, f64)> = front.map(|(name, at)| (name, at.x)).collect();
        if let Some((name, x)) = front.first()
            && sensors.len() > 1
            && (x - tip.x).abs() > (x - rear.x).abs() + JUDGED_FROM_M
        {
            return Err(format!(
                "{name} is nearer to the rear coil than to the one at the tip: the coils are exchanged, or the axis is; correct their names, \
             or back in a map"
            ));
        }
        let behind = front
            .into_iter()
            .map(|(name, x)| (name, x - tip.x))
            .filter(|(_, behind)| *behind > MOST_BEHIND_M);
        let (names, behind): (Vec<&str>, Vec<f64>) = behind.unzip();
        if !names.is_empty() {
            return Ok(Some(format!(
                "{} seen {:.0} mm behind {first}, the first coil on the tongue, which seems to be exchanged with {}; correct their names, or say \
             in a map what they are",
                names.join(" and ") + if names.len() > 1 { " are" } else { " is" },
                behind.iter().fold(0.0, |a: f64, b| a.max(*b)) * 1e3,
                if names.len() > 1 { "one of them" } else { "it" }
            )));
        }
        Ok(jaw.iter().find_map(|&jaw| {
        let name = &channels[jaw];
        let mut above: Vec<f64> =
            self.places.iter().filter_map(|f| Some(f[sensors[0]]?.y - f[jaw]?.y)).collect();
        above.sort_unstable_by(f64::total_cmp);
        let (low, high) = (*above.get(above.len() / 10)?, *above.get(above.len() * 9 / 10)?);
        let (off, side, even) =
            if low > MOST_IN_HEIGHT_M { (low, "above", "lowest") } else { (-high, "below", "highest") };
        (above.len() >= FEWEST_FRAMES && off > MOST_IN_HEIGHT_M).then(|| {
            format!(
                "{first} lies {:.0} mm {side} {name}, a coil on the jaw, even where it is {even}: the coils of tongue and jaw do not seem to \
                 be in one frame; compare both with a picture, or write \"{name}\" = \"ignore\" into a map",
                off * 1e3
            )
        })
    }))
    }
}
