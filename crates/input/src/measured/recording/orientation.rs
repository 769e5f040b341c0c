//! How a recording lies in the head, from its map, bones, contour and coils: which way the back of the head is, and which end of a contour
//! or chain of coils is the tip. Lips, incisors and coils on the jaw tell whether axes or coils are exchanged.

use std::collections::BTreeMap;

use tongue_core::body::{HYOID, MANDIBLE};
use tongue_core::geometry::Point;

use super::super::error::ReadError;
use super::channels::{carry_by_coils, median_place, median_x, places_of_coils, rise_of_contour};
use super::contour_frame::{self, SampleFrame};
use super::dynamics::FEW;
use super::flat::Flat;
use super::{AlignedFrame, AlignedRecording, Format, Map, Mark, Recording, Role, names};

/// Ends of a contour whose heights differ by less are level, m: the first point is then taken for the root.
const LEVEL_M: f64 = 1e-3;
/// Fewer points do not show which end is at the root.
const FEWEST_OF_ARCH: usize = 4;
const REVERSED: &str =
    "the contour runs from the tip to the root (its lower end is the root), and was turned round";

/// Differences below this mean nothing, m.
const APART_M: f64 = 5e-3;
/// A coil on the jaw is at the lower incisors and in front of the tongue's first coil, which lies behind the tip: it is not farther
/// behind that one than this, m.
const BEHIND_M: f64 = 3e-3;
/// When the tongue is low, its first coil lies at about the height of the lower incisors, 2 to 8 mm above the coil below them; farther
/// above or below it than this, m, the two are not in one frame.
const APART_IN_HEIGHT_M: f64 = 15e-3;

impl AlignedRecording {
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
        let apart =
            of_bones.or(by_contour).or_else(|| ends_of_coils(&sensors, &roles, &recording.channels, &places));
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
}

/// The median x of the coil at the tip and of the coil farthest from it.
fn ends_of_coils(
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

/// A recording of coils without a contour, x to the back of the head.
struct Front<'a> {
    pub channels: &'a [String],
    pub places: &'a [Vec<Option<Point>>],
    pub map: &'a Map,
}

impl Front<'_> {
    /// Adds what is doubtful to `notes`. `sensors`: the coils on the tongue from the tip backwards; `bones`: those on the jaw.
    pub fn check(&self, sensors: &[usize], bones: &[usize], notes: &mut Vec<String>) -> Result<(), String> {
        if let Some(problem) = self.lips(sensors) {
            return Err(problem);
        }
        if let Some(&first) = sensors.first() {
            notes
                .extend(self.behind(first).or_else(|| bones.iter().find_map(|&jaw| self.height(first, jaw))));
        }
        Ok(())
    }

    /// The channels whose meaning is taken from their names alone: those that the map does not name.
    fn judged(&self) -> impl Iterator<Item = usize> {
        (0..self.channels.len()).filter(|&c| !self.map.names(&self.channels[c]))
    }

    /// The problem of coils that lie in front of lips, incisors and jaw, or of lips that are upside down.
    fn lips(&self, sensors: &[usize]) -> Option<String> {
        let [upper, lower] = [true, false].map(|upper| {
            let found = self.judged().find(|&c| names::lip(&self.channels[c]) == Some(upper));
            found.and_then(|c| Some((&self.channels[c], median_place(self.places, c)?)))
        });
        if let Some(((upper, a), (lower, b))) = upper.zip(lower)
            && a.y < b.y - APART_M
        {
            let what = format!("{upper} lies below {lower}: the recording is upside down");
            return Some(format!("{what}; give the axis that grows upwards in a map, such as up = \"-y\""));
        }
        let (tip, rear) =
            (median_x(self.places, *sensors.first()?)?, median_x(self.places, *sensors.last()?)?);
        let front = self.judged().filter(|&c| names::is_in_front(&self.channels[c]));
        let (name, at) =
            front.filter_map(|c| Some((&self.channels[c], median_place(self.places, c)?))).next()?;
        (sensors.len() > 1 && (at.x - tip).abs() > (at.x - rear).abs() + APART_M).then(|| {
            format!(
                "{name} is nearer to the rear coil than to the one at the tip: the coils are exchanged, or the axis is; correct their \
                 names, or back in a map"
            )
        })
    }

    /// A note where coils of lips, incisors or jaw lie behind the first coil on the tongue.
    fn behind(&self, first: usize) -> Option<String> {
        let x = |c: usize| median_x(self.places, c);
        let front = self.judged().filter(|&c| names::is_in_front(&self.channels[c]));
        let all = front.filter_map(|c| Some((self.channels[c].as_str(), x(c)? - x(first)?)));
        let (names, behind): (Vec<&str>, Vec<f64>) = all.filter(|(_, behind)| *behind > BEHIND_M).unzip();
        (!names.is_empty()).then(|| {
            format!(
                "{} seen {:.0} mm behind {}, the first coil on the tongue, which seems to be exchanged with {}; correct their names, or say \
                 in a map what they are",
                names.join(" and ") + if names.len() > 1 { " are" } else { " is" },
                behind.iter().fold(0.0, |a: f64, b| a.max(*b)) * 1e3,
                self.channels[first],
                if names.len() > 1 { "one of them" } else { "it" }
            )
        })
    }

    /// A note where the first coil on the tongue always lies far above or below a coil on the jaw.
    fn height(&self, first: usize, jaw: usize) -> Option<String> {
        let (tongue, name) = (&self.channels[first], &self.channels[jaw]);
        let mut above: Vec<f64> = self.places.iter().filter_map(|f| Some(f[first]?.y - f[jaw]?.y)).collect();
        above.sort_unstable_by(f64::total_cmp);
        let (low, high) = (*above.get(above.len() / 10)?, *above.get(above.len() * 9 / 10)?);
        let (off, side, even) =
            if low > APART_IN_HEIGHT_M { (low, "above", "lowest") } else { (-high, "below", "highest") };
        (above.len() >= FEW && off > APART_IN_HEIGHT_M).then(|| {
            format!(
                "{tongue} lies {:.0} mm {side} {name}, a coil on the jaw, even where it is {even}: the coils of tongue and jaw do not seem to \
                 be in one frame; compare both with a picture, or write \"{name}\" = \"ignore\" into a map",
                off * 1e3
            )
        })
    }
}
