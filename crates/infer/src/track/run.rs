//! All recordings of a speaker: the most probable tensions, rejected observations, draws, and results.

use std::sync::Arc;

use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statistics::upper_median;
use tongue_input::measured::recording::{Fault, FaultKind};

use super::branch::ways;
use super::by_shape::{ByShape, by_shape};
use super::consider;
use super::descend::descend;
use super::draws::Sampler;
use super::eliminate::Eliminated;
use super::errors::Knots;
use super::foretell::foretell;
use super::found::{Foretold, Found, Tracked, TrackedRecording, tracked};
use super::frame::{Frame, Solver};
use super::listen;
use super::mode::{CHUNK, Course, FEWEST, Mode};
use super::segments::Segments;
use super::settings::TrackSettings;
use super::shape::RestShape;
use super::shown::{Shown, sampled, shown};
use super::stage::Stage;

/// A residual larger than this many standard deviations is a fault of the observation.
const MOST_SD: f64 = 4.0;

/// Finds the tensions in all frames of recordings of one speaker. `progress` is called with the finished part of the whole. `None` where
/// covariances cannot be factorised, which has not been observed for finite recordings.
pub fn track(
    stage: &Stage<'_>,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Option<Vec<TrackedRecording>> {
    let passes = settings.rounds + 3;
    let solver = || Solver::new(stage.system, stage.followed, settings.link).with_freed(stage.freed);
    let knots = knots(&recordings, settings);
    let mut mode = Mode::new(stage.sizes(&knots), settings, &knots, &solver);
    let mut courses: Vec<Course> =
        recordings.into_iter().map(|frames| mode.course(Arc::new(frames))).collect();
    let (faults, lost) = placed(&mut mode, &mut courses, &|round| progress(round, passes));
    progress(settings.rounds, passes);
    let foretold = foretell(&mode, &courses);
    let shown = stage.shape.map(|shape| shown(stage, shape, &mode, &courses));
    let (system, found, shared) = match &shown {
        Some(Shown { body, courses, levels }) => {
            (body.as_ref().map_or(stage.system, |body| &body.system), courses, levels)
        }
        None => (stage.system, &courses, &mode.shared),
    };
    let shaped = || Solver::new(system, stage.followed, settings.link).with_freed(stage.freed);
    let again = Mode { solver: &shaped, shared: shared.clone(), ..mode.clone() };
    progress(settings.rounds + 1, passes);
    let columns = stage.shape.map_or(0, RestShape::count);
    let by_shape: Vec<_> = courses.iter().map(|course| by_shape(&mode, course, stage.shape)).collect();
    let of_shape: Vec<_> =
        by_shape.iter().map(|all| |t: usize| all[t].as_ref().map(|b: &ByShape| b.seen.clone())).collect();
    let linear =
        courses.iter().zip(&of_shape).map(|(c, by_shape)| Eliminated::new(&mode, c, &[], by_shape, columns));
    let linear = linear.collect::<Option<Vec<_>>>()?;
    let shared = consider::draws(&mode, &courses, &linear, stage.shape)?;
    let mut out = Vec::with_capacity(courses.len());
    for (number, faults) in faults.into_iter().enumerate() {
        let course = &courses[number];
        let sampler = Sampler {
            mode: &mode,
            course,
            linear: &linear[number],
            by_shape: &by_shape[number],
            heard: listen::rates(&mode, course, stage.shape),
            shared: &shared,
            number,
        };
        out.push(told(&again, &found[number], &sampler, &foretold[number], (faults, &lost[number])));
    }
    progress(passes, passes);
    Some(out)
}

/// A speaker's shape at rest.
#[derive(Debug, Clone)]
pub struct RestFound {
    /// The nodes, m.
    pub nodes: Vec<Point>,
    /// Root mean square distance of the observations from the tongue that is fitted to each frame, m.
    pub rms_m: f64,
}

/// The shape at rest with which a speaker's recordings are displayed, found from up to 60 of their frames, spread evenly. `progress` is
/// called with the finished part of the whole. `None` where no frame has an equilibrium with enough points.
pub fn rest_shape(
    stage: &Stage<'_>,
    shape: &RestShape,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    progress: &dyn Fn(usize, usize),
) -> Option<RestFound> {
    let solver = || Solver::new(stage.system, stage.followed, settings.link).with_freed(stage.freed);
    let knots = knots(&recordings, settings);
    let mut mode = Mode::new(stage.sizes(&knots), settings, &knots, &solver);
    let courses: Vec<Course> = recordings.into_iter().map(|frames| mode.course(Arc::new(frames))).collect();
    let mut courses = sampled(&mode, &courses);
    placed(&mut mode, &mut courses, &|round| progress(round, settings.rounds));
    let Shown { body, courses, .. } = shown(stage, shape, &mode, &courses);
    let frames = courses.iter().flat_map(|course| course.frames.iter().zip(&course.here));
    let (mut squares, mut count) = (0.0, 0);
    for (frame, linear) in frames.filter_map(|(frame, here)| Some((frame, here.linear.as_ref()?))) {
        let distances = linear.residuals.iter().zip(&frame.observations).map(|(r, o)| r / o.weight);
        squares += distances.map(|d| d * d).sum::<f64>();
        count += frame.observations.len();
    }
    if count == 0 {
        return None;
    }
    let rms_m = (squares / count as f64).sqrt();
    let nodes = body.as_ref().map_or(stage.system, |body| &body.system).rest().to_vec();
    Some(RestFound { nodes, rms_m })
}

/// Knots of the errors, over all that the recordings show of the contour.
fn knots(recordings: &[Vec<Frame>], settings: &TrackSettings) -> Knots {
    let along: Vec<_> = recordings.iter().flatten().map(|f| f.along.as_slice()).collect();
    Knots::new(settings.errors, &along)
}

/// Finds the most probable tensions on the placed body, without observations that are not points of this tongue. Returns the faults of
/// every frame, and whether the frame is lost.
#[allow(clippy::type_complexity, reason = "two lists of a frame each")]
fn placed(
    mode: &mut Mode<'_, '_>,
    courses: &mut [Course],
    progress: &dyn Fn(usize),
) -> (Vec<Vec<Vec<Fault>>>, Vec<Vec<bool>>) {
    let rounds = mode.settings.rounds;
    descend(mode, courses, rounds, progress);
    let (faults, lost) = without_outliers(mode, courses);
    if faults.iter().flatten().any(|f| !f.is_empty()) {
        descend(mode, courses, rounds, progress);
    }
    (faults, lost)
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
        for (t, frame) in Arc::make_mut(&mut course.frames).iter_mut().enumerate() {
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
                course.here[t].linear = None;
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

/// Results for every frame of a recording, on the body with the most probable shape; the draws are those of the placed body.
fn told(
    mode: &Mode<'_, '_>,
    course: &Course,
    draws: &Sampler<'_, '_>,
    foretold: &[Vec<Foretold>],
    (mut faults, lost): (Vec<Vec<Fault>>, &[bool]),
) -> TrackedRecording {
    let count = course.frames.len();
    let unknowns: Vec<_> = course.here.iter().map(|h| mode.unknowns(&h.z, &mode.shared)).collect();
    let ways = if mode.settings.branch { ways(mode, course, &unknowns) } else { Vec::new() };
    let labels: Vec<&[usize]> = course.frames.iter().map(|f| f.labels.as_slice()).collect();
    let mut segments = Segments::new(&labels);
    let mut frames: Vec<Tracked> = Vec::with_capacity(count);
    draws.draw(|window, drawn, means| {
        let numbers: Vec<usize> = window.clone().collect();
        let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
        let finish = |chunk: &&[usize]| -> Vec<Tracked> {
            let mut solver = (mode.solver)();
            let one = |&t: &usize| {
                let found = Found {
                    way: ways.get(t).and_then(Option::as_ref),
                    frame: &course.frames[t],
                    x: &unknowns[t],
                    linear: course.here[t].linear.as_deref(),
                    positions: course.here[t].positions.as_deref(),
                    placed: draws.course.here[t].positions.as_deref(),
                    foretold: &foretold[t],
                    lost: lost[t],
                    means,
                    number: t - window.start,
                    is_shown: mode.settings.is_shown(t, count),
                };
                tracked(&mut solver, &found, drawn, mode.settings)
            };
            chunk.iter().map(one).collect()
        };
        frames.extend(parallel::map(&chunks, finish).into_iter().flatten());
        segments.take(window, drawn, means);
    });
    frames.iter_mut().zip(&mut faults).for_each(|(frame, faults)| frame.faults = std::mem::take(faults));
    TrackedRecording { rest: (mode.solver)().system.rest().to_vec(), frames, segments: segments.finish() }
}
