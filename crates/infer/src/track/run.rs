//! Tracking of all recordings of a speaker: the most probable tensions, outliers, draws, and results.

use std::collections::BTreeMap;
use std::slice;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statistics::median;
use tongue_input::measured::recording::{Fault, FaultKind};

use super::display_shape::{Display, DisplayShape, SHAPE_FRAMES, begin_beside};
use super::draws::Sampler;
use super::eliminate::{Eliminated, LinearProblem};
use super::frame::Frame;
use super::gauss_newton::{ROUNDS, iterate};
use super::prediction::{best_process, predict_hidden};
use super::reachability::reachabilities;
use super::rest_shape::RestShape;
use super::results::{FrameSolution, HeldOutPrediction, Tracked, TrackedRecording, frame_result};
use super::segments::Segments;
use super::settings::{TrackSettings, TrackingContext};
use super::smoother::{FEWEST, SmoothedRecording, Smoother, in_chunks, shape_jacobians};
use super::{draws, formants};
use crate::error_model::Knots;

/// Residuals above this number of standard deviations are faults of the observations.
const MOST_SD: f64 = 4.0;
/// Factor of the own errors of points in the search that gives the start.
const WIDER: f64 = 10.0;
/// Rounds of that search. In eleven searches over frames of a speaker, 3 to 5 rounds led to lower minima than 40 did.
const WIDER_ROUNDS: usize = 4;

/// What a search reports, and which recordings it searches.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Gets the finished and the total number of steps.
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
    /// Whether the recording of this number is searched; all recordings determine the shared unknowns.
    pub is_wanted: &'a (dyn Fn(usize) -> bool + Sync),
    /// Gets each recording with its number as soon as it is found.
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

/// A covariance cannot be factorised, which has not been observed for finite recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotFinite;

impl TrackingContext<'_> {
    /// Finds the tensions in all frames of recordings of one speaker.
    pub fn smooth(
        &self,
        recordings: Vec<Vec<Frame>>,
        settings: &TrackSettings,
        watch: &Watch<'_>,
    ) -> Result<(), NotFinite> {
        let Watch { progress, is_wanted, take } = *watch;
        let wanted: Vec<usize> = (0..recordings.len()).filter(|number| is_wanted(*number)).collect();
        let passes = ROUNDS + 2 + wanted.len();
        let knots = knots(&recordings, settings);
        let mut smoother = Smoother::new(*self, settings, &knots);
        let recordings: Vec<SmoothedRecording> =
            recordings.into_iter().map(|frames| smoother.start(Arc::new(frames))).collect();
        let frames: usize = recordings.iter().map(SmoothedRecording::count).sum();
        let is_whole = frames <= settings.shared_frames;
        let mut sample =
            if is_whole { recordings.clone() } else { smoother.thinned(&recordings, settings.shared_frames) };
        let (usual, outliers) =
            fit_placed(&mut smoother, &mut sample, None, &|round| progress(round, passes));
        progress(ROUNDS, passes);
        let process = best_process(&smoother, &sample);
        let display = Display::new(self, settings);
        let shown = self.shape.map(|shape| display.fit_shape(shape, &smoother, &sample));
        progress(ROUNDS + 1, passes);
        let columns = self.shape.map_or(0, RestShape::count);
        let of_sample: Vec<_> =
            sample.iter().map(|recording| shape_jacobians(&smoother, recording)).collect();
        let linear = sample.iter().zip(&of_sample).map(|(recording, by_shape)| {
            Eliminated::new(LinearProblem { smoother: &smoother, recording, damping: &[], by_shape, columns })
        });
        let linear = linear.collect::<Option<Vec<_>>>().ok_or(NotFinite)?;
        let shared = draws::draws(&smoother, &linear).ok_or(NotFinite)?;
        drop(linear);
        let done = AtomicUsize::new(ROUNDS + 2);
        smoother.holds = !is_whole;
        parallel::map(&wanted, |&number| {
            let mut smoother = smoother.clone();
            let mut recording = sample[number].clone();
            let mut outliers = outliers[number].clone();
            let mut by_shape = of_sample[number].clone();
            if !is_whole {
                recording = recordings[number].clone();
                begin_beside(&mut recording, &sample[number]);
                let (_, own) =
                    fit_placed(&mut smoother, slice::from_mut(&mut recording), Some(usual), &|_| ());
                outliers = own.into_iter().next().unwrap_or_default();
                by_shape = shape_jacobians(&smoother, &recording);
            }
            let (smoother, recording) = (&smoother, &recording);
            let problem = LinearProblem { smoother, recording, damping: &[], by_shape: &by_shape, columns };
            let linear = Eliminated::new(problem).ok_or(NotFinite)?;
            let predicted = predict_hidden(smoother, recording, process.as_ref());
            let (mut on_displayed, mut displayed) = (smoother.clone(), recording.clone());
            if let Some(DisplayShape { body, recordings, levels }) = &shown {
                on_displayed.context = self.on_body(body.as_ref());
                on_displayed.shared = levels.clone();
                displayed = recordings[number].clone();
                if !is_whole {
                    let (own, known) = (slice::from_ref(recording), (levels, true));
                    displayed =
                        display.find_on_body(body.as_ref(), known, own, &[displayed]).0.swap_remove(0);
                }
            }
            let formant_jacobians = formants::jacobians(smoother, recording);
            let sampler = Sampler { linear: &linear, formant_jacobians, shared: &shared, number };
            take(number, summarise(&on_displayed, &displayed, &sampler, predicted, outliers));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, passes);
            Ok(())
        })
        .into_iter()
        .collect()
    }
}

/// The nodes of the shape at rest, m, with which a speaker's recordings are displayed, from up to 60 frames spread evenly over them, and the
/// root mean square distance of the observations from the tongue fitted to each frame, m. `None` where no frame has an equilibrium with
/// enough points.
pub fn rest_shape(
    context: &TrackingContext<'_>,
    shape: &RestShape,
    recordings: Vec<Vec<Frame>>,
    settings: &TrackSettings,
    progress: &dyn Fn(usize, usize),
) -> Option<(Vec<Point>, f64)> {
    let knots = knots(&recordings, settings);
    let mut smoother = Smoother::new(*context, settings, &knots);
    let recordings: Vec<SmoothedRecording> =
        recordings.into_iter().map(|frames| smoother.start(Arc::new(frames))).collect();
    let mut recordings = smoother.thinned(&recordings, SHAPE_FRAMES);
    fit_placed(&mut smoother, &mut recordings, None, &|round| progress(round, ROUNDS));
    let DisplayShape { body, recordings, .. } =
        Display::new(context, settings).fit_shape(shape, &smoother, &recordings);
    let frames = recordings.iter().flat_map(|recording| recording.frames.iter().zip(&recording.here));
    let (mut squares, mut count) = (0.0, 0);
    for (frame, linear) in frames.filter_map(|(frame, here)| Some((frame, here.linear.as_ref()?))) {
        let distances =
            linear.residuals.iter().zip(&frame.observations).map(|(r, o)| r / o.observation.weight);
        squares += distances.map(|d| d * d).sum::<f64>();
        count += frame.observations.len();
    }
    if count == 0 {
        return None;
    }
    let nodes = context.on_body(body.as_ref()).system.rest().to_vec();
    Some((nodes, (squares / count as f64).sqrt()))
}

fn knots(recordings: &[Vec<Frame>], settings: &TrackSettings) -> Knots {
    let observations = recordings.iter().flatten().flat_map(|f| &f.observations);
    Knots::new(settings.errors, observations.map(|o| &o.along))
}

/// For every frame of a recording the faults that the search found in it, and whether the frame is lost.
type Outliers = Vec<(Vec<Fault>, bool)>;

/// Finds the most probable tensions on the placed body without outliers. The cost has several minima, so the search begins with some rounds
/// for own errors [`WIDER`] times as large, unless the shared unknowns are held. Returns the usual residual, in standard deviations, found in
/// these recordings if it is not given, and the outliers of every recording. `progress` gets the number of rounds done, up to [`ROUNDS`].
fn fit_placed(
    smoother: &mut Smoother<'_>,
    recordings: &mut [SmoothedRecording],
    usual: Option<f64>,
    progress: &dyn Fn(usize),
) -> (f64, Vec<Outliers>) {
    let mut done = 0;
    if !smoother.holds {
        let errors = recordings.iter_mut().flat_map(|recording| recording.errors.iter_mut().flatten());
        errors.for_each(|errors| Arc::make_mut(errors).sds *= WIDER);
        done = iterate(smoother, recordings, WIDER_ROUNDS, progress);
        recordings.iter_mut().for_each(|recording| smoother.take_errors(recording));
    }
    done += iterate(smoother, recordings, ROUNDS, &|round| progress((done + round).min(ROUNDS)));
    let usual = usual.unwrap_or_else(|| {
        let far = recordings
            .iter()
            .flat_map(|c| (0..c.frames.len()).flat_map(|t| absolute_residuals(smoother, c, t)));
        1.4826 * median(far).unwrap_or(0.0)
    });
    let found: Vec<Outliers> = recordings.iter_mut().map(|c| without_outliers(smoother, c, usual)).collect();
    if found.iter().flatten().any(|(faults, _)| !faults.is_empty()) {
        iterate(smoother, recordings, ROUNDS, &|round| progress((done + round).min(ROUNDS)));
    }
    (usual, found)
}

/// Absolute residuals of a frame, in standard deviations; none without an equilibrium.
fn absolute_residuals(smoother: &Smoother<'_>, recording: &SmoothedRecording, t: usize) -> Vec<f64> {
    let Some(residuals) = smoother.residuals_mm(recording, t, &recording.here[t], &smoother.shared) else {
        return Vec::new();
    };
    residuals.iter().zip(&recording.frames[t].observations).map(|(r, o)| r.abs() / o.along.sd_mm).collect()
}

/// Removes observations whose distance is much larger than their error and the usual residual, so that they are not points of this tongue.
fn without_outliers(smoother: &Smoother<'_>, recording: &mut SmoothedRecording, usual: f64) -> Outliers {
    let all: Vec<Vec<f64>> =
        (0..recording.frames.len()).map(|t| absolute_residuals(smoother, recording, t)).collect();
    let mut out = Vec::with_capacity(all.len());
    for ((t, frame), far) in Arc::make_mut(&mut recording.frames).iter_mut().enumerate().zip(&all) {
        let mut lost = frame.observations.len() >= FEWEST && recording.here[t].linear.is_none();
        let mut faults = Vec::new();
        let is_far = frame.observations.iter().zip(far).filter(|(_, far)| **far > MOST_SD * usual.max(1.0));
        let mut points: Vec<String> = is_far.map(|(o, _)| o.name.clone()).collect();
        points.dedup();
        if !points.is_empty() {
            let all = points.len() * 3 > frame.observations.len();
            frame.observations.retain(|o| !all && !points.contains(&o.name));
            recording.here[t].linear = None;
            faults.push(Fault { kind: FaultKind::FarFromFit, points });
            lost |= all;
        }
        out.push((faults, lost));
    }
    smoother.take_errors(recording);
    out
}

/// Results for every frame of a recording on the body with the most probable shape; the draws are those of the placed body.
fn summarise(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    draws: &Sampler<'_>,
    predicted: Vec<Vec<HeldOutPrediction>>,
    outliers: Outliers,
) -> TrackedRecording {
    let count = recording.frames.len();
    let unknowns: Vec<_> = (0..count).map(|t| smoother.unknowns_of(recording, t)).collect();
    let reachabilities = if smoother.settings.reachability {
        reachabilities(smoother, recording, &unknowns)
    } else {
        Vec::new()
    };
    let mut segments = Segments::new(&recording.frames, smoother.settings.kept_draws);
    let mut frames: Vec<Tracked> = Vec::with_capacity(count);
    draws.draw(|window, drawn, means| {
        frames.extend(in_chunks(window.clone(), |chunk| {
            let mut solver = smoother.solver();
            Vec::from_iter(chunk.iter().map(|&t| {
                let found = FrameSolution {
                    recording,
                    t,
                    x: &unknowns[t],
                    placed: draws.linear.problem.recording.here[t].positions.as_deref(),
                    reachability: reachabilities.get(t).and_then(Option::as_ref),
                    lost: outliers[t].1,
                    means,
                };
                frame_result(&mut solver, &found, &drawn[t - window.start], smoother.settings)
            }))
        }));
        segments.take(window, &frames, drawn, means);
    });
    for ((frame, hidden), (faults, _)) in frames.iter_mut().zip(predicted).zip(outliers) {
        (frame.hidden, frame.faults) = (hidden, faults);
    }
    let rest = smoother.context.system.rest().to_vec();
    TrackedRecording { rest, frames, ..segments.finish() }
}
