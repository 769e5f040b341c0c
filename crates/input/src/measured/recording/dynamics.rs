//! What is measured of the motion in a recording: stuck channels, frames out of order, speeds, a head or a point that slips.

use tongue_core::geometry::Point;
use tongue_core::statistics::upper_median;

use super::flat::upper_median_point;
use super::map::BONE_SD_M;
use super::{AlignedRecording, Mark};

/// What was measured, and the name of what has it.
pub(super) type NamedValue = (f64, String);

pub(super) fn bare(value: f64) -> NamedValue {
    (value, String::new())
}

/// Fewer frames are not judged.
pub(super) const FEW: usize = 20;
/// The speed of a course is judged if it moves by this many standard deviations of its noise.
const MOVES_SD: f64 = 2.5;
/// A course that moves by this many is no held posture.
const HELD_SD: f64 = 1.5;
/// Longer steps are not compared, s.
const CONTINUOUS_S: f64 = 0.05;
/// Largest acceleration of a tongue, and of bones, m/s².
const ACCELERATION_M_S2: f64 = 30.0;
const ACCELERATION_OF_BONES_M_S2: f64 = 10.0;

/// The course of a point of the tongue over the frames that show it.
struct PointTrack<'a> {
    name: &'a str,
    times: Vec<f64>,
    marks: Vec<Mark>,
    apart_s: f64,
    /// Mean square distance from the mean place, m².
    variance: f64,
}

impl<'a> PointTrack<'a> {
    fn new(name: &'a str, seen: impl Iterator<Item = (f64, Mark)>) -> Self {
        let (times, marks): (Vec<f64>, Vec<Mark>) = seen.unzip();
        let mean = marks.iter().map(|m| m.at).sum::<Point>() / marks.len() as f64;
        let variance = marks.iter().map(|m| (m.at - mean).norm_squared()).sum::<f64>() / marks.len() as f64;
        let apart_s = upper_median(times.windows(2).map(|w| w[1] - w[0])).unwrap_or(0.0);
        Self { name, times, marks, apart_s, variance }
    }

    /// Distances over so many frames, m, in ascending order.
    fn moved(&self, lag: usize) -> Vec<f64> {
        let pairs = self.marks.iter().zip(self.marks.get(lag..).unwrap_or_default());
        let mut moved: Vec<f64> = pairs.map(|(a, b)| (b.at - a.at).norm()).collect();
        moved.sort_unstable_by(f64::total_cmp);
        moved
    }

    fn sd(&self) -> f64 {
        self.marks.first().map_or(0.0, |m| m.sd)
    }

    /// Noise has two axes.
    fn moves_by(&self, sds: f64) -> bool {
        self.apart_s > 0.0 && self.variance > 2.0 * (sds * self.sd()).powi(2)
    }

    fn moves(&self) -> bool {
        self.moves_by(MOVES_SD)
    }

    /// Part of the frames with exactly the position before.
    fn part_still(&self) -> f64 {
        let moved = self.moved(1);
        moved.iter().filter(|m| **m == 0.0).count() as f64 / moved.len().max(1) as f64
    }

    /// The squared step from frame to frame over twice the variance, which is about 1 for frames in random order. The mean of the squared
    /// steps is too large where a point jumps, and their median where the tongue often rests; so the smaller of the two results is returned.
    fn disorder(&self) -> f64 {
        let squares = |lag: usize| {
            let later = self.marks.iter().cycle().skip(lag);
            self.marks.iter().zip(later).map(|(a, b)| (b.at - a.at).norm_squared())
        };
        let steps = self.marks.len() - 1;
        let mean = squares(1).take(steps).sum::<f64>() / steps as f64 / (2.0 * self.variance);
        let medians = upper_median(squares(1).take(steps)).zip(upper_median(squares(self.marks.len() / 2)));
        medians.map_or(mean, |(near, far)| mean.min(near / far))
    }

    /// The speed that is exceeded in a tenth of the time, over 20 ms or, where the point moves by far more than its noise, from frame to
    /// frame, m/s.
    fn fastest_tenth_m_s(&self) -> f64 {
        const OVER_S: f64 = 20e-3;
        const FASTEST_M_S: f64 = 1.5;
        let tenth = |lag: usize| {
            let moved = self.moved(lag);
            moved.get(moved.len() * 9 / 10).copied().unwrap_or(0.0)
        };
        let lag = ((OVER_S / self.apart_s).ceil() as usize).clamp(1, self.marks.len());
        // Nine of ten distances between two places of a point that rests are shorter.
        let noise = 3.035 * self.sd();
        let over = (tenth(lag).powi(2) - noise.powi(2)).max(0.0).sqrt() / (lag as f64 * self.apart_s);
        let step = tenth(1) / self.apart_s;
        if tenth(1) > 6.0 * self.sd() && step > FASTEST_M_S { step.max(over) } else { over }
    }

    /// The part of its whole way that the point goes in its quickest 0.15 s, without noise, and the time of the whole way at that speed, s.
    fn quickest(&self) -> Option<(f64, f64)> {
        const OVER_S: f64 = 0.15;
        /// Postures that are farther apart in time need not have anything to do with one another.
        const APART_S: f64 = 0.45;
        let lag = ((OVER_S / self.apart_s).round() as usize).max(1);
        let over_s = lag as f64 * self.apart_s;
        let moved = self.moved(lag);
        let most = moved.get(moved.len() * 99 / 100).filter(|_| self.apart_s <= APART_S)?;
        // The noise is at most what is assumed, and what the second differences show.
        let bends = self.marks.windows(3).map(|w| (w[0].at - w[1].at * 2.0 + w[2].at).norm());
        let sd = self.sd().min(upper_median(bends)? / 2.88);
        let way = 2.5 * (self.variance - 2.0 * sd.powi(2)).max(0.0).sqrt();
        let part = (most.powi(2) - (3.96 * sd).powi(2)).max(0.0).sqrt() / way;
        part.is_finite().then(|| (part * (OVER_S / over_s).min(1.0), over_s / part))
    }

    /// Its name, the time, s, at which it jumps farther than this acceleration allows and stays there, and by how much, mm.
    fn slip(&self, acceleration_m_s2: f64) -> Option<(&'a str, f64, f64)> {
        const SLIP_M: f64 = 8e-3;
        const STAYS: usize = 4;
        let step = |f: usize| (self.marks[f].at - self.marks[f - 1].at).norm();
        let frame = (2..self.marks.len().saturating_sub(STAYS)).find(|f| {
            let by = step(*f);
            let apart = self.times[*f] - self.times[f - 1];
            let least =
                SLIP_M + 4.0 * self.sd() + acceleration_m_s2 * apart.powi(2) + step(f - 1).max(step(f + 1));
            // A point that comes back from a jump has been elsewhere just before.
            let is_held = (0..STAYS).all(|k| (self.marks[f + k].at - self.marks[f - 1].at).norm() > 0.5 * by)
                && (1..STAYS.min(*f))
                    .all(|k| (self.marks[f - 1 - k].at - self.marks[f - 1].at).norm() <= 0.5 * by);
            by > least && apart < 1.5 * self.apart_s && is_held
        })?;
        Some((self.name, self.times[frame], step(frame) * 1e3))
    }
}

/// Whether the tracking of a bone slips: it jumps farther than a bone can move, and stays there.
pub(super) fn bone_slips(seen: impl Iterator<Item = (f64, Point)>) -> bool {
    let course = PointTrack::new("", seen.map(|(time_s, at)| (time_s, Mark { at, sd: BONE_SD_M })));
    course.marks.len() >= FEW && course.slip(ACCELERATION_OF_BONES_M_S2).is_some()
}

/// The courses of all points of the tongue, and of all bones, that enough frames show.
pub(super) struct PointCourses<'a> {
    recording: &'a AlignedRecording,
    courses: Vec<PointTrack<'a>>,
    bones: Vec<PointTrack<'a>>,
}

impl<'a> PointCourses<'a> {
    pub fn of(recording: &'a AlignedRecording) -> Self {
        let all = recording.names().enumerate();
        let mut courses: Vec<PointTrack<'_>> =
            all.map(|(point, name)| PointTrack::new(name, recording.positions_over_time(point))).collect();
        let mut bones = courses.split_off(recording.contour.len() + recording.sensors.len());
        [&mut courses, &mut bones].into_iter().for_each(|all| all.retain(|course| course.marks.len() >= FEW));
        Self { recording, courses, bones }
    }

    /// Whether at least half of the points move by more than their noise.
    pub fn is_moving(&self) -> bool {
        let moving = self.courses.iter().filter(|c| c.moves_by(HELD_SD)).count();
        moving > 0 && 2 * moving >= self.courses.len()
    }

    pub fn has_slipping_bone(&self) -> bool {
        self.bones.iter().any(|bone| bone.slip(ACCELERATION_OF_BONES_M_S2).is_some())
    }

    pub fn disorder(&self) -> Option<NamedValue> {
        self.middle(true, |c| Some(c.disorder())).map(bare)
    }

    pub fn fastest_tenth_mm_s(&self) -> Option<NamedValue> {
        self.middle(true, |c| Some(c.fastest_tenth_m_s() * 1e3)).map(bare)
    }

    /// The median over the points that move; `None` if these are less than half, since one that jumps among others that rest says nothing of
    /// the recording.
    fn middle(&self, continuous: bool, of: impl Fn(&PointTrack<'_>) -> Option<f64>) -> Option<f64> {
        let least = if continuous { MOVES_SD } else { HELD_SD };
        let moving = self.courses.iter().filter(|c| c.moves_by(least) && c.part_still() <= 0.5);
        let values: Vec<f64> =
            moving.filter(|c| !continuous || c.apart_s < CONTINUOUS_S).filter_map(of).collect();
        upper_median(values.iter().copied()).filter(|_| 2 * values.len() >= self.courses.len())
    }

    /// The number of frames, if all points have the same place in all of them.
    pub fn frozen(&self) -> Option<NamedValue> {
        let courses = &self.courses;
        let still = !courses.is_empty() && courses.iter().all(|c| c.part_still() == 1.0);
        still.then(|| bare(self.recording.frames.len() as f64))
    }

    /// The part of the frames that repeat all places of the one before, if some points move.
    pub fn repeated(&self) -> Option<NamedValue> {
        let repeats = (1..self.recording.frames.len()).filter(|f| self.repeats(*f)).count();
        let part = repeats as f64 / self.recording.frames.len().saturating_sub(1).max(1) as f64;
        self.courses.iter().any(PointTrack::moves).then(|| bare(part))
    }

    /// Whether a frame has exactly the places of the one before, of which at least one was seen.
    fn repeats(&self, frame: usize) -> bool {
        let places = |f: usize| self.recording.frames[f].points().map(|m| Some(m?.at));
        places(frame).eq(places(frame - 1)) && places(frame).flatten().next().is_some()
    }

    /// The most frames one after another in which all points have exactly the same places, with where they begin.
    pub fn longest_freeze(&self) -> Option<NamedValue> {
        let frames = &self.recording.frames;
        let (mut longest, mut from) = ((1, 0), 0);
        for f in 1..frames.len() {
            if !self.repeats(f) {
                from = f;
            }
            longest = longest.max((f - from + 1, from));
        }
        let (count, from) = longest;
        frames.get(from).map(|frame| (count as f64, format!("{:.3} s", frame.time_s)))
    }

    /// The part of the frames in which points stay while others move.
    pub fn stuck(&self) -> Option<NamedValue> {
        let courses = &self.courses;
        let stuck = courses.iter().map(|c| (c.name, c.part_still())).filter(|(_, part)| *part > 0.5);
        let (names, parts): (Vec<&str>, Vec<f64>) = stuck.unzip();
        let most = parts.into_iter().fold(0.0, f64::max);
        courses.iter().any(PointTrack::moves).then(|| (most, names.join(" and ")))
    }

    /// The part of the points that stay in most frames, though most points move by more than their noise.
    pub fn part_rounded(&self) -> Option<NamedValue> {
        let courses = &self.courses;
        let moving = courses.iter().filter(|course| course.moves()).count();
        let staying = courses.iter().filter(|course| course.part_still() > 0.5).count();
        (2 * moving > courses.len()).then(|| bare(staying as f64 / courses.len() as f64))
    }

    pub fn quickest_part(&self) -> Option<NamedValue> {
        let whole_s = self.middle(false, |c| Some(c.quickest()?.1))?;
        Some((self.middle(false, |c| Some(c.quickest()?.0))?, format!("{whole_s:.2} s")))
    }

    /// Points and bones that jump and stay, while most points do not.
    pub fn slipped_points_mm(&self) -> Option<NamedValue> {
        let Self { courses, bones, .. } = self;
        let mut slips: Vec<_> = courses.iter().filter_map(|c| c.slip(ACCELERATION_M_S2)).collect();
        if 2 * slips.len() > courses.len() {
            return None;
        }
        slips.extend(bones.iter().filter_map(|b| b.slip(ACCELERATION_OF_BONES_M_S2)));
        let ((first, time_s, by_mm), others) = slips.split_first()?;
        let others: Vec<&str> = others.iter().map(|(name, ..)| *name).collect();
        let more =
            if others.is_empty() { String::new() } else { format!(" (as does {})", others.join(", ")) };
        Some((*by_mm, format!("{first} jumps by {by_mm:.0} mm at {time_s:.3} s and stays there{more}")))
    }

    /// The first shift of all points alike at once by more than a tongue, or its bones, can move, which stays: the head or the probe has
    /// slipped.
    pub fn slip_mm(&self) -> Option<NamedValue> {
        const SLIP_M: f64 = 5e-3;
        /// Largest acceleration of a whole tongue, m/s².
        const ACCELERATION_OF_ALL_M_S2: f64 = 15.0;
        let frames = &self.recording.frames;
        // From a frame to the next one: the median shift of the points, the mean one of the bones, the largest difference of a point's shift
        // from the median, the largest standard deviation of a point, and the time.
        let shifts = Vec::from_iter((0..frames.len().saturating_sub(1)).map(|f| {
            let (here, next) = (&frames[f], &frames[f + 1]);
            let pairs = here.points().zip(next.points());
            let pairs: Vec<(Point, f64)> = pairs.filter_map(|(a, b)| Some((b?.at - a?.at, a?.sd))).collect();
            let bones: Vec<Point> =
                here.bones.iter().zip(&next.bones).filter_map(|(a, b)| Some((*b)? - (*a)?)).collect();
            let bones = bones.iter().sum::<Point>() / bones.len() as f64;
            let middle = upper_median_point(pairs.iter().map(|(d, _)| *d))?;
            let unlike = pairs.iter().map(|(d, _)| (d - middle).norm()).fold(0.0, f64::max);
            let noise = pairs.iter().map(|(_, sd)| *sd).fold(0.0, f64::max);
            (pairs.len() >= 3).then_some((middle, bones, unlike, noise, next.time_s - here.time_s))
        }));
        let slips = shifts.windows(3).zip(1..).filter_map(|(w, f)| {
            let (before, (by, bones, unlike, noise, apart), after) = (w[0]?, w[1]?, w[2]?);
            let least = |acceleration: f64| SLIP_M.max(acceleration * apart * apart);
            // A point that comes back in the next frame has jumped.
            let of_tongue =
                least(ACCELERATION_OF_ALL_M_S2) + 2.0 * noise + before.0.norm().max(after.0.norm());
            // Without bones their shift is no number, and no comparison with it is true.
            let of_bones = least(ACCELERATION_OF_BONES_M_S2) + before.1.norm().max(after.1.norm());
            let is_of_bones = bones.norm() > of_bones && (by - bones).norm() < 0.4 * bones.norm();
            let is_slip = (by.norm() > of_tongue || is_of_bones) && unlike < 0.4 * by.norm() + 4.0 * noise;
            is_slip.then(|| (by.norm() * 1e3, frames[f + 1].time_s))
        });
        let slips: Vec<(f64, f64)> = slips.collect();
        let ((by_mm, time_s), others) = slips.split_first()?;
        let more =
            if others.is_empty() { String::new() } else { format!(" (and {} times more)", others.len()) };
        Some((*by_mm, format!("at {time_s:.3} s{more}")))
    }
}
