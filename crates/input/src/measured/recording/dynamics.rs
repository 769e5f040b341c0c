//! Plausibility of the motion in a recording: stuck channels, frames out of order, a wrong rate, a head that
//! slips.

use nalgebra::Vector2;

use tongue_core::geometry::Point;
use tongue_core::statistics::upper_median;

use super::doubt::Doubt;
use super::{AlignedRecording, Mark};

/// Minimum number of frames for judging a course.
pub(super) const FEW: usize = 20;
/// Limit of the mean square of steps over twice the variance: 1 for frames in random order, far less for a
/// tongue.
const DISORDER: f64 = 0.6;
/// A course is judged if it moves by this many standard deviations of its noise.
const MOVES_SD: f64 = 2.5;
/// A channel with the same position as before in this part of its frames is stuck, if others move.
const STUCK: f64 = 0.5;
/// Fastest plausible motion of a tongue, m/s (tips reach 0.5).
const FASTEST_M_S: f64 = 1.5;
/// Shortest time over which speeds are measured, s, and the largest plausible speed of the fastest tenth of it,
/// m/s: pellets on the tongue move at 0.06 to 0.13 m/s on average in speech (Tasko and Westbury 2002), and tips at
/// 0.4 m/s in the fastest gestures.
const SPEED_OVER_S: f64 = 20e-3;
const FAST_M_S: f64 = 0.32;
/// In speech, whose syllables follow one another 2 to 7 times a second, a tongue makes half of its motion in
/// 0.03 to 0.15 s: the time in which the mean square of its displacement becomes its variance.
const HALF_MOTION_S: f64 = 0.25;
/// Largest acceleration of a whole tongue, m/s², and smallest slip that is reported, m.
const ACCELERATION_M_S2: f64 = 30.0;
const SLIP_M: f64 = 5e-3;

/// The course of a channel: contour points first, then sensors.
fn course(seen: &AlignedRecording, c: usize) -> Vec<(f64, Mark)> {
    let mark = |f: &super::AlignedFrame| match f.contour.get(c) {
        Some(mark) => *mark,
        None => f.sensors.get(c - f.contour.len()).copied().flatten(),
    };
    seen.frames.iter().filter_map(|f| Some((f.time_s, mark(f)?))).collect()
}

/// The mean square distance of a point from its mean place, m².
fn variance(course: &[(f64, Mark)]) -> f64 {
    let count = course.len() as f64;
    let mean = course.iter().map(|(_, m)| m.at).sum::<Point>() / count;
    course.iter().map(|(_, m)| (m.at - mean).norm_squared()).sum::<f64>() / count
}

/// Checks that successive frames are continuous; `usual_step`: whether the time between them is.
pub(super) fn of_courses(seen: &AlignedRecording, usual_step: bool) -> Vec<Doubt> {
    let mut out = Vec::new();
    let count = seen.contour.len() + seen.sensors.len();
    let name = |c: usize| seen.contour.get(c).unwrap_or_else(|| &seen.sensors[c - seen.contour.len()].0);
    let courses: Vec<_> = (0..count).map(|c| course(seen, c)).collect();
    let mut stuck = Vec::new();
    let (mut disorder, mut jumps) = (Vec::new(), Vec::new());
    let (mut speeds, mut late) = (Vec::new(), Vec::new());
    let (mut still, mut moving) = (0, 0);
    for (c, course) in courses.iter().enumerate().filter(|(_, course)| course.len() >= FEW) {
        let steps: Vec<Vector2<f64>> = course.windows(2).map(|w| w[1].1.at - w[0].1.at).collect();
        let same = steps.iter().filter(|s| s.norm() == 0.0).count();
        still += usize::from(same == steps.len());
        let variance = variance(course);
        let sd = course[0].1.sd;
        let apart = upper_median(course.windows(2).map(|w| w[1].0 - w[0].0)).unwrap_or(0.0);
        // Noise has two axes. Frames far apart in time need not be close in space.
        let moves = apart > 0.0 && variance > 2.0 * (MOVES_SD * sd).powi(2);
        moving += usize::from(moves);
        if same as f64 > STUCK * steps.len() as f64 {
            stuck.push(c);
            continue;
        }
        let lag = (HALF_MOTION_S / apart) as usize;
        if moves && lag > 0 {
            late.extend(
                part_of_variance(course, lag).map(|part| part * HALF_MOTION_S / (lag as f64 * apart)),
            );
        }
        if moves && apart < 0.05 {
            disorder.push(disorder_of(course, variance));
            let fast = course.windows(2).filter(|w| (w[1].1.at - w[0].1.at).norm() > 6.0 * sd);
            let fast =
                fast.filter(|w| (w[1].1.at - w[0].1.at).norm() > FASTEST_M_S * (w[1].0 - w[0].0)).count();
            jumps.push(fast as f64 / steps.len() as f64);
            let lag = ((SPEED_OVER_S / apart).ceil() as usize).clamp(1, course.len());
            let mut moved: Vec<f64> =
                course.iter().zip(&course[lag..]).map(|(a, b)| (b.1.at - a.1.at).norm()).collect();
            moved.sort_unstable_by(f64::total_cmp);
            // Nine of ten distances between two places of a point that rests are shorter.
            let noise = 3.035 * sd;
            let fast = moved.get(moved.len() * 9 / 10).copied().unwrap_or(0.0);
            speeds.push((fast.powi(2) - noise.powi(2)).max(0.0).sqrt() / (lag as f64 * apart));
        }
    }
    let judged = courses.iter().filter(|course| course.len() >= FEW).count();
    if judged > 0 && still == judged {
        out.push(Doubt::told(
            "nothing moves: every frame has the same places; export the recording anew, or give one frame alone".to_owned(),
        ));
    } else if moving > 0 && stuck.len() == judged {
        out.push(Doubt::told(
            "most frames repeat the one before; export the recording at the rate of its video, or take the repeated frames out".to_owned(),
        ));
    } else if moving > 0 && !stuck.is_empty() {
        let names: Vec<&str> = stuck.iter().map(|&c| name(c).as_str()).collect();
        out.push(Doubt::told(format!(
            "{} stays in the very same place in most frames while others move; write \"{}\" = \"ignore\" into a map",
            names.join(", "),
            names[0]
        )));
    }
    let help = "correct rate_hz in the map, or the times, which are in seconds";
    // A point that jumps among others that rest says nothing of the recording.
    let middle = |of: &[f64]| upper_median(of.iter().copied()).filter(|_| 2 * of.len() >= judged);
    if middle(&disorder).is_some_and(|d| d > DISORDER) {
        out.push(Doubt::refused(
            "its frames do not follow one another: points are as far from where they were in the frame before as from anywhere; \
             sort them by time"
                .to_owned(),
        ));
    } else if middle(&jumps).is_some_and(|s| s > 0.1) {
        out.push(Doubt::told(format!(
            "points move faster than {FASTEST_M_S} m/s in more than a tenth of the frames, which no tongue does; correct the rate or \
             the times"
        )));
    } else if let Some(m_s) = middle(&speeds).filter(|s| *s > FAST_M_S && usual_step) {
        out.push(Doubt::told(format!(
            "a tenth of the time the tongue moves faster than {:.0} mm/s, where 80 to 200 are usual in speech; if that is wrong, {help}",
            m_s * 1e3
        )));
    } else if usual_step && middle(&late).is_some_and(|d| d < 1.0) {
        out.push(Doubt::told(format!(
            "the tongue needs more than {HALF_MOTION_S} s for half of its motion, where 0.03 to 0.15 s are usual in speech; if that is \
             wrong, {help}"
        )));
    }
    out.extend(slip(seen));
    out
}

/// The squared step from frame to frame over twice the variance, which is about 1 for frames in random order. The mean of the squared
/// steps is too large where a point jumps, and their median where the tongue often rests; so the smaller of the two results is returned.
fn disorder_of(course: &[(f64, Mark)], variance: f64) -> f64 {
    let squares = |lag: usize| {
        course.iter().zip(course.iter().cycle().skip(lag)).map(|(a, b)| (b.1.at - a.1.at).norm_squared())
    };
    let steps = course.len() - 1;
    let mean = squares(1).take(steps).sum::<f64>() / steps as f64 / (2.0 * variance);
    let medians = upper_median(squares(1).take(steps)).zip(upper_median(squares(course.len() / 2)));
    medians.map_or(mean, |(near, far)| mean.min(near / far))
}

/// The mean square of the displacement over so many frames, in units of the variance, without the rest before and after speech, which
/// says nothing of its rate. `None` for a motion of less than four times as many frames.
fn part_of_variance(course: &[(f64, Mark)], lag: usize) -> Option<f64> {
    let moved = |m: &Mark, from: &Mark| (m.at - from.at).norm() > 2.0 * MOVES_SD * m.sd;
    let (first, last) = (&course.first()?.1, &course.last()?.1);
    let begin = course.iter().position(|(_, m)| moved(m, first))?;
    let end = course.iter().rposition(|(_, m)| moved(m, last))?;
    let spoken = course.get(begin..=end).filter(|spoken| spoken.len() / 4 > lag)?;
    let over = spoken.iter().zip(&spoken[lag..]).map(|(a, b)| (b.1.at - a.1.at).norm_squared());
    Some(over.sum::<f64>() / (spoken.len() - lag) as f64 / variance(spoken))
}

/// A frame in which all points of the tongue are shifted alike at once, more than a tongue can be, and stay
/// there: the head or the probe has slipped.
fn slip(seen: &AlignedRecording) -> Option<Doubt> {
    let points = |f: usize| seen.frames[f].contour.iter().chain(&seen.frames[f].sensors);
    // From a frame to the next one: the median shift of the points, the largest difference of a point's shift from it, the largest
    // standard deviation of a point, and the time.
    let shift = |f: usize| {
        let pairs = points(f)
            .zip(points(f + 1))
            .filter_map(|(a, b)| Some((b.as_ref()?.at - a.as_ref()?.at, a.as_ref()?.sd)));
        let pairs: Vec<(Vector2<f64>, f64)> = pairs.collect();
        let of = |axis: usize| upper_median(pairs.iter().map(|(d, _)| d[axis]));
        let middle = Vector2::new(of(0)?, of(1)?);
        let unlike = pairs.iter().map(|(d, _)| (d - middle).norm()).fold(0.0, f64::max);
        let noise = pairs.iter().map(|(_, sd)| *sd).fold(0.0, f64::max);
        (pairs.len() >= 3).then_some((
            middle,
            unlike,
            noise,
            seen.frames[f + 1].time_s - seen.frames[f].time_s,
        ))
    };
    let shifts: Vec<_> = (0..seen.frames.len().saturating_sub(1)).map(shift).collect();
    let is_slip = |f: &usize| {
        let (Some(before), Some(here), Some(after)) = (shifts[f - 1], shifts[*f], shifts[f + 1]) else {
            return false;
        };
        let (by, unlike, noise, apart) = here;
        let least = SLIP_M.max(ACCELERATION_M_S2 * apart * apart) + 4.0 * noise;
        let neighbours = before.0.norm().max(after.0.norm());
        // A point that comes back in the next frame has jumped.
        by.norm() > least + neighbours && unlike < 0.4 * by.norm() + 4.0 * noise
    };
    let frames: Vec<usize> = (1..shifts.len().saturating_sub(1)).filter(is_slip).collect();
    let &first = frames.first()?;
    let (by, ..) = shifts[first]?;
    let times =
        if frames.len() == 1 { String::new() } else { format!(" (and {} times more)", frames.len() - 1) };
    Some(Doubt::refused(format!(
        "all points of the tongue are shifted by {:.0} mm at once at {:.3} s{times}: the head or the probe has slipped; name points of the \
         head as \"reference\" in a map, or give the parts as recordings of their own",
        by.norm() * 1e3,
        seen.frames[first + 1].time_s
    )))
}
