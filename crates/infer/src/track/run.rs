//! All recordings of a speaker: the most probable tensions, rejected observations, draws, and results.

use std::collections::BTreeMap;
use std::slice;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statistics::upper_median;
use tongue_input::measured::recording::{Fault, FaultKind};

use super::display_shape::{Display, DisplayShape, begin_beside, sampled};
use super::draws::Sampler;
use super::eliminate::Eliminated;
use super::errors::Knots;
use super::frame::{Frame, FrameSolver};
use super::gauss_newton::minimise;
use super::prediction::{judged, predict_hidden};
use super::reachability::ways;
use super::results::{FrameSolution, HeldOutPrediction, Tracked, TrackedRecording, tracked};
use super::segments::Segments;
use super::settings::{TrackSettings, TrackingContext};
use super::shape::RestShape;
use super::shape_jacobian::{ShapeJacobian, shape_jacobians};
use super::smoother::{CHUNK, FEWEST, SmoothedRecording, Smoother};
use super::{draws, formants};

/// A residual larger than this many standard deviations is a fault of the observation.
const MOST_SD: f64 = 4.0;

/// What follows a search: its progress, and what becomes of each recording.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Called with the finished part of the whole.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
    /// Whether the recording of this number is searched. All of them say what the recordings share.
    pub is_wanted: &'a (dyn Fn(usize) -> bool + Sync),
    /// Gets each recording as soon as it is found, with its number.
    pub take: &'a (dyn Fn(usize, TrackedRecording) + Sync),
}

impl Watch<'_> {
    /// All recordings that a search finds, in their order.
    pub fn collect<E>(search: impl FnOnce(&Watch<'_>) -> Result<(), E>) -> Result<Vec<TrackedRecording>, E> {
        let found: Mutex<BTreeMap<usize, TrackedRecording>> = Mutex::default();
        let take = |number: usize, one: TrackedRecording| {
            found.lock().unwrap_or_else(PoisonError::into_inner).insert(number, one);
        };
        search(&Watch { progress: &|_, _| (), is_wanted: &|_| true, take: &take })?;
        Ok(found.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect())
    }
}

/// Covariances cannot be factorised, which has not been observed for finite recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite;

/// Finds the tensions in all frames of recordings of one speaker.
pub fn track(
    stage: &TrackingContext<'_>,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    watch: &Watch<'_>,
) -> Result<(), NotFinite> {
    let Watch { progress, is_wanted, take } = *watch;
    let wanted: Vec<usize> = (0..recordings.len()).filter(|number| is_wanted(*number)).collect();
    let passes = settings.rounds + 2 + wanted.len();
    let knots = knots(&recordings, settings);
    let solver = || FrameSolver::new(stage.system, stage.followed, settings.link).with_freed(stage.freed);
    let mut mode = Smoother::new(stage.sizes(&knots), settings, &knots, &solver);
    let courses: Vec<SmoothedRecording> =
        recordings.into_iter().map(|frames| mode.start(Arc::new(frames))).collect();
    let frames: usize = courses.iter().map(SmoothedRecording::count).sum();
    let is_whole = frames <= settings.shared_frames;
    let mut sample = if is_whole {
        courses.clone()
    } else {
        mode.thinned(&courses, frames.div_ceil(settings.shared_frames.max(1)))
    };
    let (usual, outliers) = placed(&mut mode, &mut sample, None, &|round| progress(round, passes));
    progress(settings.rounds, passes);
    let process = judged(&mode, &sample);
    let display = Display::new(stage, settings);
    let shown = stage.shape.map(|shape| display.fit_shape(shape, &mode, &sample));
    progress(settings.rounds + 1, passes);
    let columns = stage.shape.map_or(0, RestShape::count);
    let of_sample: Vec<_> = sample.iter().map(|course| shape_jacobians(&mode, course, stage.shape)).collect();
    let of_shape = Vec::from_iter(
        of_sample.iter().map(|all| |t: usize| all[t].as_ref().map(|b: &ShapeJacobian| b.seen.clone())),
    );
    let linear =
        sample.iter().zip(&of_shape).map(|(c, by_shape)| Eliminated::new(&mode, c, &[], by_shape, columns));
    let linear = linear.collect::<Option<Vec<_>>>().ok_or(NotFinite)?;
    let shared = draws::draws(&mode, &sample, &linear, stage.shape).ok_or(NotFinite)?;
    drop(linear);
    let done = AtomicUsize::new(settings.rounds + 2);
    mode.holds = !is_whole;
    parallel::map(&wanted, |&number| {
        let mut mode = mode.clone();
        let mut course = sample[number].clone();
        let (mut faults, mut lost) = outliers[number].clone();
        if !is_whole {
            course = courses[number].clone();
            begin_beside(&mut course, &sample[number]);
            let (_, own) = placed(&mut mode, slice::from_mut(&mut course), Some(usual), &|_| ());
            (faults, lost) = own.into_iter().next().unwrap_or_default();
        }
        let own = (!is_whole).then(|| shape_jacobians(&mode, &course, stage.shape));
        let by_shape = own.as_ref().unwrap_or(&of_sample[number]);
        let seen = |t: usize| by_shape[t].as_ref().map(|b: &ShapeJacobian| b.seen.clone());
        let linear = Eliminated::new(&mode, &course, &[], &seen, columns).ok_or(NotFinite)?;
        let predicted = predict_hidden(&mode, &course, process.as_ref());
        let displayed = shown.as_ref().map(|shown| {
            if is_whole {
                shown.courses[number].clone()
            } else {
                display.recording(shown, mode.sizes, &course, &shown.courses[number])
            }
        });
        let (system, levels) = match &shown {
            Some(DisplayShape { body, levels, .. }) => {
                (body.as_ref().map_or(stage.system, |body| &body.system), levels)
            }
            None => (stage.system, &mode.shared),
        };
        let shaped = || FrameSolver::new(system, stage.followed, settings.link).with_freed(stage.freed);
        let again = Smoother { solver: &shaped, shared: levels.clone(), ..mode.clone() };
        let heard = formants::rates(&mode, &course, stage.shape);
        let sampler = Sampler {
            mode: &mode,
            course: &course,
            linear: &linear,
            by_shape,
            heard,
            shared: &shared,
            number,
        };
        let found = displayed.as_ref().unwrap_or(&course);
        take(number, summarise(&again, found, &sampler, &predicted, (faults, &lost)));
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, passes);
        Ok(())
    })
    .into_iter()
    .collect()
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
    stage: &TrackingContext<'_>,
    shape: &RestShape,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    progress: &dyn Fn(usize, usize),
) -> Option<RestFound> {
    let knots = knots(&recordings, settings);
    let solver = || FrameSolver::new(stage.system, stage.followed, settings.link).with_freed(stage.freed);
    let mut mode = Smoother::new(stage.sizes(&knots), settings, &knots, &solver);
    let courses: Vec<SmoothedRecording> =
        recordings.into_iter().map(|frames| mode.start(Arc::new(frames))).collect();
    let mut courses = sampled(&mode, &courses);
    placed(&mut mode, &mut courses, None, &|round| progress(round, settings.rounds));
    let DisplayShape { body, courses, .. } = Display::new(stage, settings).fit_shape(shape, &mode, &courses);
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

/// Faults that the search found in every frame of a recording, and whether the frame is lost.
type Outliers = (Vec<Vec<Fault>>, Vec<bool>);

/// Finds the most probable tensions on the placed body, without observations that are not points of this tongue. Returns the usual
/// residual, in standard deviations, which is that of these recordings unless it is given, and the outliers of every recording.
fn placed(
    mode: &mut Smoother<'_, '_>,
    courses: &mut [SmoothedRecording],
    usual: Option<f64>,
    progress: &dyn Fn(usize),
) -> (f64, Vec<Outliers>) {
    let rounds = mode.settings.rounds;
    minimise(mode, courses, rounds, progress);
    let usual = usual.unwrap_or_else(|| {
        let far = courses.iter().flat_map(|c| (0..c.frames.len()).flat_map(|t| far(mode, c, t)));
        1.4826 * upper_median(far).unwrap_or(0.0)
    });
    let found: Vec<Outliers> = courses.iter_mut().map(|c| without_outliers(mode, c, usual)).collect();
    if found.iter().flat_map(|(faults, _)| faults).any(|f| !f.is_empty()) {
        minimise(mode, courses, rounds, progress);
    }
    (usual, found)
}

/// Absolute residuals of a frame, in standard deviations; none without an equilibrium.
fn far(mode: &Smoother<'_, '_>, course: &SmoothedRecording, t: usize) -> Vec<f64> {
    let Some(residuals) = mode.residuals_mm(course, t, &course.here[t], &mode.shared) else {
        return Vec::new();
    };
    residuals.iter().zip(&course.frames[t].along).map(|(r, along)| r.abs() / along.sd_mm).collect()
}

/// Removes observations of a recording that are much farther from the surface than their error and than is `usual`, because they are not
/// points of this tongue.
fn without_outliers(mode: &Smoother<'_, '_>, course: &mut SmoothedRecording, usual: f64) -> Outliers {
    let all: Vec<Vec<f64>> = (0..course.frames.len()).map(|t| far(mode, course, t)).collect();
    let (mut of_frames, mut lost_frames) = (Vec::new(), Vec::new());
    for ((t, frame), far) in Arc::make_mut(&mut course.frames).iter_mut().enumerate().zip(&all) {
        let mut lost = frame.observations.len() >= FEWEST && course.here[t].linear.is_none();
        let mut faults = Vec::new();
        let mut points: Vec<String> = (0..frame.names.len())
            .filter(|i| far.get(*i).is_some_and(|f| *f > MOST_SD * usual.max(1.0)))
            .map(|i| frame.names[i].clone())
            .collect();
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
    (of_frames, lost_frames)
}

/// Results for every frame of a recording, on the body with the most probable shape; the draws are those of the placed body.
fn summarise(
    mode: &Smoother<'_, '_>,
    course: &SmoothedRecording,
    draws: &Sampler<'_, '_>,
    predicted: &[Vec<Option<HeldOutPrediction>>],
    (mut faults, lost): (Vec<Vec<Fault>>, &[bool]),
) -> TrackedRecording {
    let count = course.frames.len();
    let unknowns: Vec<_> = course.here.iter().map(|h| mode.unknowns(&h.z, &mode.shared)).collect();
    let ways = if mode.settings.branch { ways(mode, course, &unknowns) } else { Vec::new() };
    let mut segments = Segments::new(&course.frames, mode.settings.kept_draws);
    let mut frames: Vec<Tracked> = Vec::with_capacity(count);
    draws.draw(|window, drawn, means| {
        let numbers: Vec<usize> = window.clone().collect();
        let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
        let by_chunk = parallel::map(&chunks, |chunk: &&[usize]| -> Vec<Tracked> {
            let mut solver = (mode.solver)();
            chunk
                .iter()
                .map(|&t| {
                    let found = FrameSolution {
                        way: ways.get(t).and_then(Option::as_ref),
                        frame: &course.frames[t],
                        x: &unknowns[t],
                        linear: course.here[t].linear.as_deref(),
                        positions: course.here[t].positions.as_deref(),
                        placed: draws.course.here[t].positions.as_deref(),
                        predicted: &predicted[t],
                        lost: lost[t],
                        means,
                        number: t - window.start,
                        is_shown: mode.settings.is_shown(t, count),
                    };
                    tracked(&mut solver, &found, drawn, mode.settings)
                })
                .collect()
        });
        frames.extend(by_chunk.into_iter().flatten());
        segments.take(window, &frames, drawn, means);
    });
    frames.iter_mut().zip(&mut faults).for_each(|(frame, faults)| frame.faults = std::mem::take(faults));
    let rest = (mode.solver)().system.rest().to_vec();
    TrackedRecording { rest, frames, ..segments.finish() }
}
