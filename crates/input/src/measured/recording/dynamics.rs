//! Quantities of the motion in a recording: stuck channels, frames out of order, speeds, jumps of a point or of the head.

use tongue_core::geometry::Point;
use tongue_core::statistics::median;

use super::flat::median_point;
use super::map::BONE_POINT_SD_M;
use super::{AlignedRecording, Mark};

/// A quantity, and the name of the point that has it.
pub(super) type NamedValue = (f64, String);

pub(super) fn unnamed(value: f64) -> NamedValue {
    (value, String::new())
}

/// Recordings and tracks with fewer frames are not checked.
pub(super) const FEWEST_FRAMES: usize = 20;
/// The speed of a track is checked if its standard deviation is more than this number of those of its noise.
const MOVES_SD: f64 = 2.5;
/// A track with more than this number of standard deviations of its noise is not a held posture.
const HELD_SD: f64 = 1.5;
/// The speed of a track is not checked if its frames are farther apart, s.
const MOST_APART_S: f64 = 0.05;
/// Largest accelerations of a point of the tongue and of a bone, m/s².
const ACCELERATION_M_S2: f64 = 30.0;
const ACCELERATION_OF_BONES_M_S2: f64 = 10.0;

struct PointTrack<'a> {
    name: &'a str,
    times: Vec<f64>,
    marks: Vec<Mark>,
    apart_s: f64,
    /// Mean square distance from the mean position, m².
    variance: f64,
}

impl<'a> PointTrack<'a> {
    fn new(name: &'a str, seen: impl Iterator<Item = (f64, Mark)>) -> Self {
        let (times, marks): (Vec<f64>, Vec<Mark>) = seen.unzip();
        let mean = marks.iter().map(|m| m.at).sum::<Point>() / marks.len() as f64;
        let variance = marks.iter().map(|m| (m.at - mean).norm_squared()).sum::<f64>() / marks.len() as f64;
        let apart_s = median(times.windows(2).map(|w| w[1] - w[0])).unwrap_or(0.0);
        Self { name, times, marks, apart_s, variance }
    }

    /// Distances between frames that are `lag` apart, m, in ascending order.
    fn moved(&self, lag: usize) -> Vec<f64> {
        let pairs = self.marks.iter().zip(self.marks.get(lag..).unwrap_or_default());
        let mut moved: Vec<f64> = pairs.map(|(a, b)| (b.at - a.at).norm()).collect();
        moved.sort_unstable_by(f64::total_cmp);
        moved
    }

    fn sd(&self) -> f64 {
        self.marks.first().map_or(0.0, |m| m.sd)
    }

    /// Whether the point moves by more than `sds` standard deviations of its noise; the variance has two axes.
    fn moves_by(&self, sds: f64) -> bool {
        self.apart_s > 0.0 && self.variance > 2.0 * (sds * self.sd()).powi(2)
    }

    /// Part of the frames with exactly the position of the frame before.
    fn part_still(&self) -> f64 {
        let moved = self.moved(1);
        moved.iter().filter(|m| **m == 0.0).count() as f64 / moved.len().max(1) as f64
    }

    /// The squared step from frame to frame over twice the variance, which is about 1 for frames in random order. The mean of the squared
    /// steps is too large where a point jumps, and their median where the tongue often rests, so the smaller ratio is returned.
    fn disorder(&self) -> f64 {
        let squares = |lag: usize| {
            let later = self.marks.iter().cycle().skip(lag);
            self.marks.iter().zip(later).map(|(a, b)| (b.at - a.at).norm_squared())
        };
        let steps = self.marks.len() - 1;
        let mean = squares(1).take(steps).sum::<f64>() / steps as f64 / (2.0 * self.variance);
        let medians = median(squares(1).take(steps)).zip(median(squares(self.marks.len() / 2)));
        medians.map_or(mean, |(near, far)| mean.min(near / far))
    }

    /// The speed that is exceeded in a tenth of the time, m/s: over 20 ms or, if the point moves by far more than its noise, from frame to
    /// frame.
    fn fastest_tenth_m_s(&self) -> f64 {
        const OVER_S: f64 = 20e-3;
        const FASTEST_M_S: f64 = 1.5;
        let tenth = |lag: usize| {
            let moved = self.moved(lag);
            moved.get(moved.len() * 9 / 10).copied().unwrap_or(0.0)
        };
        let lag = ((OVER_S / self.apart_s).ceil() as usize).clamp(1, self.marks.len());
        // 90th percentile of the distance between two measurements of a point at rest: sqrt(2) sqrt(2 ln 10) standard deviations.
        let noise = 3.035 * self.sd();
        let over = (tenth(lag).powi(2) - noise.powi(2)).max(0.0).sqrt() / (lag as f64 * self.apart_s);
        let step = tenth(1) / self.apart_s;
        if tenth(1) > 6.0 * self.sd() && step > FASTEST_M_S { step.max(over) } else { over }
    }

    /// The largest part of its whole path that the point covers in 0.15 s, without noise, and the time for the whole path at that speed, s.
    fn quickest(&self) -> Option<(f64, f64)> {
        const OVER_S: f64 = 0.15;
        /// If frames are farther apart, their postures may be unrelated.
        const APART_S: f64 = 0.45;
        let lag = ((OVER_S / self.apart_s).round() as usize).max(1);
        let over_s = lag as f64 * self.apart_s;
        let moved = self.moved(lag);
        let most = moved.get(moved.len() * 99 / 100).filter(|_| self.apart_s <= APART_S)?;
        // The noise is at most the assumed one, and at most that of the second differences, whose median is 2.88 standard deviations.
        let bends = self.marks.windows(3).map(|w| (w[0].at - w[1].at * 2.0 + w[2].at).norm());
        let sd = self.sd().min(median(bends)? / 2.88);
        let way = 2.5 * (self.variance - 2.0 * sd.powi(2)).max(0.0).sqrt();
        let part = (most.powi(2) - (3.96 * sd).powi(2)).max(0.0).sqrt() / way;
        part.is_finite().then(|| (part * (OVER_S / over_s).min(1.0), over_s / part))
    }

    /// Name of the point, time (s) of the first jump that is larger than this acceleration allows and after which the point stays, and the
    /// length of the jump, mm.
    fn slip(&self, acceleration_m_s2: f64) -> Option<(&'a str, f64, f64)> {
        const SLIP_M: f64 = 8e-3;
        const STAYS: usize = 4;
        let step = |f: usize| (self.marks[f].at - self.marks[f - 1].at).norm();
        let frame = (2..self.marks.len().saturating_sub(STAYS)).find(|f| {
            let by = step(*f);
            let apart = self.times[*f] - self.times[f - 1];
            let least =
                SLIP_M + 4.0 * self.sd() + acceleration_m_s2 * apart.powi(2) + step(f - 1).max(step(f + 1));
            // A point that was elsewhere just before returns from a jump.
            let is_held = (0..STAYS).all(|k| (self.marks[f + k].at - self.marks[f - 1].at).norm() > 0.5 * by)
                && (1..STAYS.min(*f))
                    .all(|k| (self.marks[f - 1 - k].at - self.marks[f - 1].at).norm() <= 0.5 * by);
            by > least && apart < 1.5 * self.apart_s && is_held
        })?;
        Some((self.name, self.times[frame], step(frame) * 1e3))
    }
}

/// Whether a bone jumps farther than a bone can move, and stays there.
pub(super) fn bone_slips(seen: impl Iterator<Item = (f64, Point)>) -> bool {
    let track = PointTrack::new("", seen.map(|(time_s, at)| (time_s, Mark { at, sd: BONE_POINT_SD_M })));
    track.marks.len() >= FEWEST_FRAMES && track.slip(ACCELERATION_OF_BONES_M_S2).is_some()
}

pub(super) struct PointTracks<'a> {
    recording: &'a AlignedRecording,
    tracks: Vec<PointTrack<'a>>,
    bones: Vec<PointTrack<'a>>,
}

impl<'a> PointTracks<'a> {
    pub fn of(recording: &'a AlignedRecording) -> Self {
        let all = recording.names().enumerate();
        let mut tracks: Vec<PointTrack<'_>> =
            all.map(|(point, name)| PointTrack::new(name, recording.positions_over_time(point))).collect();
        let mut bones = tracks.split_off(recording.contour.len() + recording.sensors.len());
        [&mut tracks, &mut bones]
            .into_iter()
            .for_each(|all| all.retain(|track| track.marks.len() >= FEWEST_FRAMES));
        Self { recording, tracks, bones }
    }

    /// Whether at least half of the points move by more than their noise.
    pub fn is_moving(&self) -> bool {
        let moving = self.tracks.iter().filter(|track| track.moves_by(HELD_SD)).count();
        moving > 0 && 2 * moving >= self.tracks.len()
    }

    fn is_any_moving(&self) -> bool {
        self.tracks.iter().any(|track| track.moves_by(MOVES_SD))
    }

    pub fn disorder(&self) -> Option<NamedValue> {
        self.middle(true, |track| Some(track.disorder())).map(unnamed)
    }

    pub fn fastest_tenth_mm_s(&self) -> Option<NamedValue> {
        self.middle(true, |track| Some(track.fastest_tenth_m_s() * 1e3)).map(unnamed)
    }

    /// The median over the points that move; `None` if these are less than half, because the jumps of one point among others at rest
    /// do not describe the recording.
    fn middle(&self, continuous: bool, of: impl Fn(&PointTrack<'_>) -> Option<f64>) -> Option<f64> {
        let least = if continuous { MOVES_SD } else { HELD_SD };
        let moving = self.tracks.iter().filter(|track| track.moves_by(least) && track.part_still() <= 0.5);
        let values: Vec<f64> =
            moving.filter(|track| !continuous || track.apart_s < MOST_APART_S).filter_map(of).collect();
        median(values.iter().copied()).filter(|_| 2 * values.len() >= self.tracks.len())
    }

    /// The number of frames, if no point ever moves.
    pub fn frozen(&self) -> Option<NamedValue> {
        let tracks = &self.tracks;
        let still = !tracks.is_empty() && tracks.iter().all(|track| track.part_still() == 1.0);
        still.then(|| unnamed(self.recording.frames.len() as f64))
    }

    /// The part of the frames that repeat all positions of the frame before, if some points move.
    pub fn repeated(&self) -> Option<NamedValue> {
        let repeats = (1..self.recording.frames.len()).filter(|f| self.repeats(*f)).count();
        let part = repeats as f64 / self.recording.frames.len().saturating_sub(1).max(1) as f64;
        self.is_any_moving().then(|| unnamed(part))
    }

    /// Whether a frame that shows a point has exactly the positions of the frame before.
    fn repeats(&self, frame: usize) -> bool {
        let places = |f: usize| self.recording.frames[f].points().map(|m| Some(m?.at));
        places(frame).eq(places(frame - 1)) && places(frame).flatten().next().is_some()
    }

    /// The largest number of successive frames with exactly the same positions, and when they begin.
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

    /// The largest part of the frames in which a point stays, and the points that mostly stay, if others move.
    pub fn stuck(&self) -> Option<NamedValue> {
        let parts = self.tracks.iter().map(|track| (track.name, track.part_still()));
        let stuck = parts.filter(|(_, part)| *part > 0.5);
        let (names, parts): (Vec<&str>, Vec<f64>) = stuck.unzip();
        let most = parts.into_iter().fold(0.0, f64::max);
        self.is_any_moving().then(|| (most, names.join(" and ")))
    }

    /// The part of the points that stay in most frames, if most points move by more than their noise.
    pub fn part_rounded(&self) -> Option<NamedValue> {
        let tracks = &self.tracks;
        let moving = tracks.iter().filter(|track| track.moves_by(MOVES_SD)).count();
        let staying = tracks.iter().filter(|track| track.part_still() > 0.5).count();
        (2 * moving > tracks.len()).then(|| unnamed(staying as f64 / tracks.len() as f64))
    }

    pub fn quickest_part(&self) -> Option<NamedValue> {
        let whole_s = self.middle(false, |track| Some(track.quickest()?.1))?;
        Some((self.middle(false, |track| Some(track.quickest()?.0))?, format!("{whole_s:.2} s")))
    }

    pub fn slips_of_bones(&self) -> impl Iterator<Item = (&'a str, f64, f64)> {
        self.bones.iter().filter_map(|bone| bone.slip(ACCELERATION_OF_BONES_M_S2))
    }

    /// The first point or bone that jumps and stays, unless most points do.
    pub fn slipped_points_mm(&self) -> Option<NamedValue> {
        let mut slips: Vec<_> =
            self.tracks.iter().filter_map(|track| track.slip(ACCELERATION_M_S2)).collect();
        if 2 * slips.len() > self.tracks.len() {
            return None;
        }
        slips.extend(self.slips_of_bones());
        let ((first, time_s, by_mm), others) = slips.split_first()?;
        let others: Vec<&str> = others.iter().map(|(name, ..)| *name).collect();
        let more =
            if others.is_empty() { String::new() } else { format!(" (as does {})", others.join(", ")) };
        Some((*by_mm, format!("{first} jumps by {by_mm:.0} mm at {time_s:.3} s and stays there{more}")))
    }

    /// The first displacement of all points at once that is larger than a tongue or its bones can move and that stays: the head or the
    /// probe has slipped.
    pub fn slip_mm(&self) -> Option<NamedValue> {
        const SLIP_M: f64 = 5e-3;
        const ACCELERATION_OF_ALL_M_S2: f64 = 15.0;
        let frames = &self.recording.frames;
        // From each frame to the next: the median displacement of points, the mean one of bones, the largest distance of a point's
        // displacement from the median, the largest standard deviation of a point, and the time.
        let shifts = Vec::from_iter((0..frames.len().saturating_sub(1)).map(|f| {
            let (here, next) = (&frames[f], &frames[f + 1]);
            let pairs = here.points().zip(next.points());
            let pairs: Vec<(Point, f64)> = pairs.filter_map(|(a, b)| Some((b?.at - a?.at, a?.sd))).collect();
            let bones: Vec<Point> =
                here.bones.iter().zip(&next.bones).filter_map(|(a, b)| Some((*b)? - (*a)?)).collect();
            let bones = bones.iter().sum::<Point>() / bones.len() as f64;
            let middle = median_point(pairs.iter().map(|(d, _)| *d))?;
            let unlike = pairs.iter().map(|(d, _)| (d - middle).norm()).fold(0.0, f64::max);
            let noise = pairs.iter().map(|(_, sd)| *sd).fold(0.0, f64::max);
            (pairs.len() >= 3).then_some((middle, bones, unlike, noise, next.time_s - here.time_s))
        }));
        let slips = shifts.windows(3).zip(1..).filter_map(|(w, f)| {
            let (before, (by, bones, unlike, noise, apart), after) = (w[0]?, w[1]?, w[2]?);
            let least = |acceleration: f64| SLIP_M.max(acceleration * apart * apart);
            // The neighbouring displacements are added, because a point that jumps returns in the next frame.
            let of_tongue =
                least(ACCELERATION_OF_ALL_M_S2) + 2.0 * noise + before.0.norm().max(after.0.norm());
            // Without bones `bones` is NaN, and every comparison with it is false.
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
