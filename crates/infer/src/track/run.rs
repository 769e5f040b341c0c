//! All recordings of a speaker: the most probable tensions, rejected observations, draws, and results.

use nalgebra::DVector;

use crate::inverse::FreedBone;
use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statistics::upper_median;
use tongue_core::system::System;
use tongue_input::measured::recording::{Fault, FaultKind};

use super::consider::{self, Draws};
use super::descend::{descend, follow, stepped};
use super::errors::Knots;
use super::found::{Found, Tracked, TrackedRecording, tracked};
use super::frame::{Followed, Frame, Solver, Tension};
use super::gesture::{gestures, segments};
use super::mode::{CHUNK, Course, FEWEST, Here, Mode, Sizes};
use super::settings::TrackSettings;
use super::shape::RestShape;

/// Largest number of frames by which the displayed shape is found.
const SHAPE_FRAMES: usize = 60;
/// Largest number of steps to it; the last step is one that reduces the cost by less than this part.
const SHAPES: usize = 40;
const SHAPE_WON: f64 = 3e-3;
/// Rounds in which the tensions follow a new shape.
const SHAPE_ROUNDS: usize = 4;
/// First and largest damping of these steps, in units of the precision in the prior, and its factors after a step that reduced the cost
/// and after one that did not.
const SHAPE_DAMPING: f64 = 1.0;
const MOST_DAMPING: f64 = 100.0;
const LESS: f64 = 0.4;
const MORE: f64 = 4.0;
/// A residual is not noise if it is larger than this many standard deviations.
const MOST_SD: f64 = 4.0;

/// A body on which recordings are tracked.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// The body.
    pub system: &'a System<2>,
    /// Bones that are moved to their observed places.
    pub followed: &'a [Followed],
    /// Bones whose displacement is unknown ([`BONE_SD_M`](crate::inverse::BONE_SD_M), remembered like tensions).
    pub freed: &'a [FreedBone<2>],
    /// Uncertainty of its shape; `None` if the shape is known.
    pub shape: Option<&'a RestShape>,
}

/// Finds the tensions in all frames of recordings of one speaker. `progress` is called with the finished part of the whole. `None` where
/// covariances cannot be factorised, which has not been observed for finite recordings.
pub fn track(
    stage: &Stage<'_>,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Vec<TrackedRecording>> {
    let passes = settings.rounds + 3;
    let link = Tension::Soft(settings.link);
    let solver = || Solver::new(stage.system, stage.followed, link).with_freed(stage.freed);
    let along: Vec<_> = recordings.iter().flatten().map(|f| f.along.as_slice()).collect();
    let knots = Knots::new(settings.errors, &along);
    let muscles = stage.system.contracting().len();
    let sizes = Sizes { muscles, bones: 2 * stage.freed.len(), knots: knots.len() };
    let mut mode = Mode::new(sizes, settings, &knots, &solver);
    let mut courses: Vec<Course> = recordings.into_iter().map(|frames| mode.course(frames)).collect();
    descend(&mut mode, &mut courses, settings.rounds, &|round| progress(round, passes));
    let (faults, lost) = without_outliers(&mode, &mut courses);
    if faults.iter().flatten().any(|f| !f.is_empty()) {
        descend(&mut mode, &mut courses, settings.rounds, &|round| progress(round, passes));
    }
    progress(settings.rounds, passes);
    let draws = consider::draws(&mode, &courses, stage.shape)?;
    let placed: Vec<Vec<Here>> = courses.iter().map(|c| c.here.clone()).collect();
    let shown = match stage.shape {
        Some(shape) if !shape.is_placed_by_coils() => shown(stage, shape, &mut mode, &mut courses),
        _ => None,
    };
    let system = shown.as_ref().map_or(stage.system, |s| &s.system);
    let shaped = || Solver::new(system, stage.followed, link).with_freed(stage.freed);
    let again = Mode { solver: &shaped, ..mode };
    progress(settings.rounds + 1, passes);
    let all = courses.iter().zip(&placed).zip(&draws).zip(faults.iter().zip(&lost));
    let out = all
        .map(|(((course, placed), draws), (faults, lost))| told(&again, course, placed, draws, faults, lost))
        .collect();
    progress(passes, passes);
    Some(out)
}

/// The displayed body, which has the most probable shape for frames evenly spaced over the recordings: the Gauss-Newton method for shape
/// and tensions together, with damping (Levenberg 1944). The linearisation holds only near a shape, so the frames are solved again on each
/// body, and a step that increases the total cost is tried again with more damping.
///
/// The static error is left out here. Its prior is paid once, so over many frames it would be used in place of the shape, and contours
/// would be missed by several millimetres.
fn shown(
    stage: &Stage<'_>,
    shape: &RestShape,
    mode: &mut Mode<'_, '_>,
    courses: &mut [Course],
) -> Option<RestShape> {
    let link = Tension::Soft(mode.settings.link);
    let frames: usize = courses.iter().map(Course::count).sum();
    let trust = mode.settings.trust;
    let mut sample = mode.thinned(courses, frames.div_ceil(SHAPE_FRAMES).max(1));
    let mut at = mode.without_static();
    let mut least = descend(&mut at, &mut sample, SHAPE_ROUNDS, &|_| ()) * trust;
    let mut amounts = DVector::zeros(shape.count());
    let (mut damping, mut out) = (SHAPE_DAMPING, None::<RestShape>);
    for _ in 0..SHAPES {
        let here = out.as_ref().unwrap_or(shape);
        let system = out.as_ref().map_or(stage.system, |s| &s.system);
        let solver = || Solver::new(system, stage.followed, link).with_freed(stage.freed);
        let from = Mode { solver: &solver, ..at.clone() };
        let damped: Vec<Vec<f64>> = sample.iter().map(|c| vec![damping; c.frames.len()]).collect();
        let of_shape = Some((here, 1.0 / trust, damping));
        let Some((step, steps)) = stepped(&from, &sample, &damped, of_shape) else { break };
        let n = at.shared.len();
        let there = shape.stepped(&amounts, &step.rows(n, step.len() - n).into_owned());
        let Some(body) = shape.moved(&there) else { break };
        let solver = || Solver::new(&body.system, stage.followed, link).with_freed(stage.freed);
        let mut again = Mode { solver: &solver, ..at.clone() };
        let before: Vec<Vec<Here>> = sample.iter().map(|c| c.here.clone()).collect();
        carry(&mut sample, system.rest(), body.system.rest());
        follow(&again, &mut sample, &(&at.shared + step.rows(0, n)), &steps);
        again.shared += step.rows(0, n);
        let cost = descend(&mut again, &mut sample, SHAPE_ROUNDS, &|_| ()) * trust + shape.price(&there);
        if cost < least {
            let is_done = least - cost < SHAPE_WON * cost;
            at.shared.copy_from(&again.shared);
            (amounts, least, out) = (there, cost, Some(body));
            damping *= LESS;
            if is_done {
                break;
            }
        } else {
            sample.iter_mut().zip(before).for_each(|(course, here)| course.here = here);
            damping *= MORE;
            if damping > MOST_DAMPING {
                break;
            }
        }
    }
    let body = out?;
    let solver = || Solver::new(&body.system, stage.followed, link).with_freed(stage.freed);
    let mut last = Mode { solver: &solver, ..at.clone() };
    carry(courses, stage.system.rest(), body.system.rest());
    for (course, sample) in courses.iter_mut().zip(&sample) {
        begin_beside(course, sample);
    }
    descend(&mut last, courses, mode.settings.rounds, &|_| ());
    mode.shared.copy_from(&last.shared);
    Some(body)
}

/// Sets the state of every frame to that of the frame of a sample that is nearest in time.
fn begin_beside(course: &mut Course, sample: &Course) {
    let found: Vec<(f64, &Here)> = sample.frames.iter().map(|f| f.time_s).zip(&sample.here).collect();
    for (frame, here) in course.frames.iter().zip(&mut course.here) {
        let apart = |(time_s, _): &(f64, &Here)| (time_s - frame.time_s).abs();
        let known = found.iter().filter(|(_, h)| h.linear.is_some());
        if let Some((_, nearest)) = known.min_by(|a, b| apart(a).total_cmp(&apart(b))) {
            here.z.copy_from(&nearest.z);
            here.positions.clone_from(&nearest.positions);
        }
    }
}

/// Shapes of all frames after a change of the body at rest: every node moves with it, including nodes on bone, which no equilibrium
/// moves.
fn carry(courses: &mut [Course], before: &[Point], rest: &[Point]) {
    let positions = courses.iter_mut().flat_map(|c| &mut c.here).filter_map(|h| h.positions.as_mut());
    for positions in positions {
        positions.iter_mut().zip(before.iter().zip(rest)).for_each(|(p, (a, b))| *p += b - a);
    }
}

/// Removes observations that are much farther from the surface than their error and than all others, because they are not points of this
/// tongue. Returns the faults of every frame, and whether the frame is lost.
#[allow(clippy::type_complexity, reason = "two lists of a frame each")]
fn without_outliers(mode: &Mode<'_, '_>, courses: &mut [Course]) -> (Vec<Vec<Vec<Fault>>>, Vec<Vec<bool>>) {
    let far = |course: &Course, t: usize| -> Vec<f64> {
        let Some(residuals) = mode.residuals_mm(course, t, &course.here[t], &mode.shared) else {
            return Vec::new();
        };
        let errors = course.errors[t].as_ref();
        residuals.iter().enumerate().map(|(i, r)| r.abs() / errors.map_or(1.0, |e| e.sd(i))).collect()
    };
    let all: Vec<Vec<Vec<f64>>> =
        courses.iter().map(|c| (0..c.frames.len()).map(|t| far(c, t)).collect()).collect();
    let usual = 1.4826 * upper_median(all.iter().flatten().flatten().copied()).unwrap_or(0.0);
    let (mut faults, mut lost) = (Vec::new(), Vec::new());
    for (course, far) in courses.iter_mut().zip(&all) {
        let (mut of_frames, mut lost_frames) = (Vec::new(), Vec::new());
        for (t, frame) in course.frames.iter_mut().enumerate() {
            let mut lost = frame.observations.len() >= FEWEST && course.here[t].linear.is_none();
            let mut faults = Vec::new();
            let wrong = |i: &usize| far[t].get(*i).is_some_and(|f| *f > MOST_SD * usual.max(1.0));
            let mut points: Vec<String> =
                (0..frame.names.len()).filter(wrong).map(|i| frame.names[i].clone()).collect();
            points.dedup();
            if !points.is_empty() {
                let all = points.len() * 3 > frame.names.len();
                let kept: Vec<usize> =
                    (0..frame.names.len()).filter(|&i| !all && !points.contains(&frame.names[i])).collect();
                frame.observations = kept.iter().map(|&i| frame.observations[i].clone()).collect();
                frame.along = kept.iter().map(|&i| frame.along[i]).collect();
                frame.names = kept.iter().map(|&i| frame.names[i].clone()).collect();
                faults.push(Fault { kind: FaultKind::FarFromFit, points });
                lost |= all;
            }
            of_frames.push(faults);
            lost_frames.push(lost);
        }
        mode.take_errors(course);
        faults.push(of_frames);
        lost.push(lost_frames);
    }
    (faults, lost)
}

/// Results for every frame of a recording, on the body with the most probable shape; `placed` are the frames on the placed body.
fn told(
    mode: &Mode<'_, '_>,
    course: &Course,
    placed: &[Here],
    draws: &Draws,
    faults: &[Vec<Fault>],
    lost: &[bool],
) -> TrackedRecording {
    let frames = course.frames.len();
    let means: Vec<Vec<f64>> = (0..mode.sizes.muscles)
        .map(|i| {
            let count = draws.tensions.first().map_or(0, |f| f[i].len());
            let of =
                |d: usize| draws.tensions.iter().map(|f| f64::from(f[i][d])).sum::<f64>() / frames as f64;
            (0..count).map(of).collect()
        })
        .collect();
    let unknowns: Vec<_> = course.here.iter().map(|h| mode.unknowns(&h.z, &mode.shared)).collect();
    let numbers: Vec<usize> = (0..frames).collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    let finish = |chunk: &&[usize]| -> Vec<Tracked> {
        let (mut solver, mut relaxed) = ((mode.solver)(), None);
        let neighbour = |t: usize| {
            let there = course.here.get(t).filter(|h| h.linear.is_some())?;
            Some((&course.frames[t], &unknowns[t], there.positions.as_deref()?))
        };
        let one = |&t: &usize| {
            let beside = [t.checked_sub(1), Some(t + 1)];
            let found = Found {
                neighbours: beside.into_iter().flatten().filter_map(neighbour).collect(),
                frame: &course.frames[t],
                x: &unknowns[t],
                linear: course.here[t].linear.as_ref(),
                positions: course.here[t].positions.as_deref(),
                placed: placed[t].positions.as_deref(),
                lost: lost[t],
                means: &means,
                number: t,
            };
            tracked(&mut solver, &mut relaxed, &found, draws, mode.settings, faults[t].clone())
        };
        chunk.iter().map(one).collect()
    };
    let times: Vec<f64> = course.frames.iter().map(|f| f.time_s).collect();
    let labels: Vec<&[usize]> = course.frames.iter().map(|f| f.labels.as_slice()).collect();
    TrackedRecording {
        rest: (mode.solver)().system.rest().to_vec(),
        frames: parallel::map(&chunks, finish).into_iter().flatten().collect(),
        gestures: gestures(&times, draws, &means),
        segments: segments(&labels, draws, &means),
    }
}
