//! The most probable tensions of all frames on one body, by the Gauss-Newton method.
//!
//! The state of a frame is the deviation of each muscle from its level, displacements of bones that were not observed, and the slow error
//! at a few knots of the contour. All frames share the level of each muscle and the static error. The shape at rest is fixed.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, stack};

use tongue_core::geometry::Point;
use tongue_core::parallel;
use tongue_core::statistics::median;

use super::frame::{Frame, FrameSolver};
use super::jacobian::Linearisation;
use super::ornstein_uhlenbeck::OrnsteinUhlenbeck;
use super::rest_shape::RestShape;
use super::settings::{Sizes, TrackSettings, TrackingContext};
use crate::error_model::{Along, FrameErrors, Knots};

/// Number of frames in a chunk, of which the first is solved from rest. Chunks do not depend on threads, so results do not either.
pub(super) const CHUNK: usize = 32;

/// Results of `work` for all frames, which gets the numbers of the frames of a chunk.
pub(super) fn in_chunks<T: Send>(frames: Range<usize>, work: impl Fn(&[usize]) -> Vec<T> + Sync) -> Vec<T> {
    let numbers: Vec<usize> = frames.collect();
    let chunks: Vec<&[usize]> = numbers.chunks(CHUNK).collect();
    parallel::map(&chunks, |chunk| work(chunk)).into_iter().flatten().collect()
}

/// Fewest observations of a frame with data.
pub const FEWEST: usize = 3;

#[derive(Debug, Clone)]
pub(super) struct FrameState {
    pub z: DVector<f64>,
    /// Linearisation, which may be that at a near state during the search; `None` without an equilibrium or data.
    pub linear: Option<Arc<Linearisation>>,
    pub positions: Option<Arc<[Point]>>,
}

impl FrameState {
    /// Sets the linearisation; without one the last positions are kept.
    pub fn take(&mut self, linear: Option<Linearisation>) {
        if let Some(linear) = &linear {
            self.positions = Some(Arc::clone(&linear.positions));
        }
        self.linear = linear.map(Arc::new);
    }
}

#[derive(Clone)]
pub(super) struct SmoothedRecording {
    pub frames: Arc<Vec<Frame>>,
    pub chain: OrnsteinUhlenbeck,
    /// `None` where a frame has too few observations.
    pub errors: Vec<Option<Arc<FrameErrors>>>,
    pub here: Vec<FrameState>,
}

impl SmoothedRecording {
    pub fn count(&self) -> usize {
        self.errors.iter().flatten().count()
    }
}

/// Whitened residuals of a frame and their derivatives. Levels and static error have the derivatives of deviations and slow error.
pub(super) struct WhitenedRows {
    pub residuals: DVector<f64>,
    pub by_state: DMatrix<f64>,
    /// Zeros for a frame without derivatives by the shape; no columns without a shape.
    pub by_shape: DMatrix<f64>,
}

#[derive(Clone)]
pub(super) struct Smoother<'a> {
    pub context: TrackingContext<'a>,
    pub sizes: Sizes,
    pub settings: &'a TrackSettings,
    pub knots: &'a Knots,
    /// Deviation of each muscle's level from its prior mean before the transform (N/m), then the static error at its knots (mm).
    pub shared: DVector<f64>,
    /// Prior precision of the shared unknowns.
    pub shared_precision: DMatrix<f64>,
    /// Whether frames keep their linearisation during the search while they are near it.
    pub keeps: bool,
    /// Whether the shared unknowns are held.
    pub holds: bool,
}

impl<'a> Smoother<'a> {
    pub fn new(context: TrackingContext<'a>, settings: &'a TrackSettings, knots: &'a Knots) -> Self {
        let (m, k) = (context.system.contracting().len(), knots.len());
        let sizes = Sizes { muscles: m, bones: 2 * context.freed.len(), knots: k };
        let levels = DMatrix::identity(m, m) / settings.link.level_sd_n.powi(2);
        let shared_precision = stack![levels, 0; 0, knots.precision(settings.errors.static_mm)];
        let shared = DVector::zeros(sizes.shared());
        Self { context, sizes, settings, knots, shared, shared_precision, keeps: true, holds: false }
    }

    pub fn solver(&self) -> FrameSolver<'a> {
        FrameSolver::new(self.context, self.settings.link)
    }

    /// Precision of the shared unknowns, followed by those of a shape, in the prior, and gradient of its cost. A shape is given with the
    /// weight of its prior and its damping, in units of that prior's precision.
    pub fn shared_prior(&self, shape: Option<(&RestShape, f64, f64)>) -> (DMatrix<f64>, DVector<f64>) {
        let gradient = &self.shared_precision * &self.shared;
        let Some((RestShape { prior, .. }, weight, damping)) = shape else {
            return (self.shared_precision.clone(), gradient);
        };
        let of_shape = &prior.precision * (weight * (1.0 + damping));
        (stack![self.shared_precision, 0; 0, of_shape], stack![gradient; &prior.gradient * weight])
    }

    pub fn start(&self, frames: Arc<Vec<Frame>>) -> SmoothedRecording {
        let Sizes { muscles, bones, .. } = self.sizes;
        let deviations = DMatrix::identity(muscles, muscles) * self.settings.link.deviation_sd_n.powi(-2);
        let slow = self.knots.precision(self.settings.errors.slow_mm);
        let precision = stack![deviations, 0, 0; 0, DMatrix::identity(bones, bones), 0; 0, 0, slow];
        let times: Vec<f64> = frames.iter().map(|f| f.time_s).collect();
        let chain = OrnsteinUhlenbeck::new(precision, self.settings.memory_s, &times);
        let z = DVector::zeros(self.sizes.state());
        let here = vec![FrameState { z, linear: None, positions: None }; frames.len()];
        let mut recording = SmoothedRecording { frames, chain, errors: Vec::new(), here };
        self.take_errors(&mut recording);
        recording
    }

    /// At most this many frames with data, evenly spread over all recordings, in their present states.
    pub fn thinned(&self, recordings: &[SmoothedRecording], most: usize) -> Vec<SmoothedRecording> {
        let frames: usize = recordings.iter().map(SmoothedRecording::count).sum();
        let (every, mut before) = (frames.div_ceil(most.max(1)).max(1), 0);
        Vec::from_iter(recordings.iter().map(|recording| {
            let seen = (0..recording.frames.len()).filter(|&t| recording.errors[t].is_some());
            let taken: Vec<usize> =
                seen.enumerate().filter(|(n, _)| (before + n) % every == every / 2).map(|(_, t)| t).collect();
            before += recording.count();
            let frames = taken.iter().map(|&t| recording.frames[t].clone()).collect();
            let mut out = self.start(Arc::new(frames));
            out.here = taken.iter().map(|&t| recording.here[t].clone()).collect();
            out
        }))
    }

    /// Sets the errors of the frames for their present observations.
    pub fn take_errors(&self, recording: &mut SmoothedRecording) {
        let period_s = median(recording.frames.windows(2).map(|pair| pair[1].time_s - pair[0].time_s))
            .unwrap_or(f64::INFINITY);
        // Frames with the same points and standard deviations share their errors.
        let mut last: Option<(Vec<Along>, Option<Arc<FrameErrors>>)> = None;
        recording.errors = Vec::from_iter(recording.frames.iter().map(|frame| {
            let along: Vec<Along> = frame.observations.iter().map(|o| o.along).collect();
            let found = match &last {
                Some((other, found)) if *other == along => found.clone(),
                _ if along.len() < FEWEST => None,
                _ => self.knots.frame(&along, period_s).map(Arc::new),
            };
            last = Some((along, found.clone()));
            found
        }));
    }

    /// Unknowns of a frame's equilibrium: tensions before the transform, and displacements.
    pub fn unknowns(&self, z: &DVector<f64>, shared: &DVector<f64>) -> DVector<f64> {
        let Sizes { muscles, bones, .. } = self.sizes;
        let middle = self.settings.link.middle_n;
        DVector::from_fn(muscles + bones, |i, _| if i < muscles { middle + shared[i] + z[i] } else { z[i] })
    }

    /// The unknowns of a frame in its present state.
    pub fn unknowns_of(&self, recording: &SmoothedRecording, t: usize) -> DVector<f64> {
        self.unknowns(&recording.here[t].z, &self.shared)
    }

    /// Residuals of a frame, mm, less the errors at the knots.
    pub fn residuals_mm(
        &self,
        recording: &SmoothedRecording,
        t: usize,
        here: &FrameState,
        shared: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let errors = recording.errors[t].as_ref()?;
        let linear = here.linear.as_ref()?;
        let Sizes { muscles, bones, knots } = self.sizes;
        let known = here.z.rows(muscles + bones, knots) + shared.rows(muscles, knots);
        let moved = self.unknowns(&here.z, shared) - &linear.x;
        let mut residuals = &linear.residuals + &linear.jacobian * moved;
        let units = recording.frames[t].observations.iter().map(|o| 1e3 / o.observation.weight);
        residuals.iter_mut().zip(units).for_each(|(r, unit)| *r *= unit);
        Some(residuals - &errors.basis * known)
    }

    /// The unknowns of a state with the same derivatives as the shared ones: deviations for levels, the slow error for the static one.
    pub fn states_of_shared(&self) -> Vec<usize> {
        let Sizes { muscles, bones, .. } = self.sizes;
        (0..muscles).chain(muscles + bones..self.sizes.state()).collect()
    }

    /// Linearised residuals of a frame after a step of its state and of the shared unknowns.
    pub fn residuals_after_step(
        &self,
        rows: &WhitenedRows,
        state: &DVector<f64>,
        shared: &DVector<f64>,
    ) -> DVector<f64> {
        let mut step = state.clone();
        self.states_of_shared().into_iter().enumerate().for_each(|(i, state)| step[state] += shared[i]);
        let by_shape = &rows.by_shape * shared.rows(self.sizes.shared(), rows.by_shape.ncols());
        &rows.residuals + &rows.by_state * step + by_shape
    }
}

/// Derivatives of the observations of all frames by the shape, mm; `None` where the shape is known or a frame has no equilibrium.
pub(super) fn shape_jacobians(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
) -> Vec<Option<DMatrix<f64>>> {
    let Some(shape) = smoother.context.shape else { return vec![None; recording.frames.len()] };
    in_chunks(0..recording.frames.len(), |chunk| {
        let known: Vec<usize> =
            chunk.iter().copied().filter(|&t| recording.here[t].linear.is_some()).collect();
        let x: Vec<_> = known.iter().map(|&t| smoother.unknowns_of(recording, t)).collect();
        let postures = Vec::from_iter(known.iter().zip(&x).map(|(&t, x)| {
            let from = recording.here[t].linear.as_ref().map(|linear| &*linear.positions);
            (&recording.frames[t], x, from)
        }));
        let mut rates = shape.rates(&mut smoother.solver(), &postures).into_iter();
        Vec::from_iter(chunk.iter().map(|&t| {
            recording.here[t].linear.as_ref()?;
            Some(rates.next()??.jacobian_of_fitted())
        }))
    })
}
