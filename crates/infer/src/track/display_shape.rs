//! The displayed body, which has the speaker's most probable shape at rest, and the frames on it.

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use tongue_core::statistics::least_by;
use tongue_core::system::System;

use crate::least_squares::{self, Rule};
use crate::standard_deviations::SHOWN_LEVEL;

use super::gauss_newton::{self, ROUNDS, ShapeStep, StateStep, apply_steps, iterate, solve_step};
use super::ornstein_uhlenbeck::Softplus;
use super::rest_shape::RestShape;
use super::settings::{TrackSettings, TrackingContext};
use super::smoother::{FrameState, SmoothedRecording, Smoother, shape_jacobians};
use crate::error_model::{ErrorModel, Knots};

/// Weight of the frames for the displayed shape, which has no intervals.
const TRUST: f64 = 0.5;
/// Largest number of frames by which the displayed shape is found.
pub(super) const SHAPE_FRAMES: usize = 60;
/// Rounds in which the tensions are adapted to a new shape.
const SHAPE_ROUNDS: usize = 4;
/// Damping is in units of the prior precision.
const SEARCH: Rule = Rule {
    max_steps: 40,
    relative_tolerance: 3e-3,
    first_damping: 1.0,
    least_damping: 0.0,
    most_damping: 100.0,
    damping_decrease: 0.4,
    ..Rule::UNDAMPED
};

struct Candidate {
    amounts: DVector<f64>,
    /// `None` for the placed body.
    body: Option<RestShape>,
    levels: DVector<f64>,
    sample: Vec<SmoothedRecording>,
    cost: f64,
    rates: OnceLock<Vec<Vec<Option<DMatrix<f64>>>>>,
}

/// The displayed body and the frames by which it was found.
pub(super) struct DisplayShape {
    /// `None` for the placed body.
    pub body: Option<RestShape>,
    pub recordings: Vec<SmoothedRecording>,
    pub levels: DVector<f64>,
}

/// The search on bodies that have the speaker's shape.
///
/// Static and slow errors, which describe a body of another shape, are left out. The prior limits the static error only once for all
/// frames, so with many frames the search would change that error instead of the shape.
pub(super) struct Display<'a> {
    context: &'a TrackingContext<'a>,
    settings: TrackSettings,
    knots: Knots,
}

impl<'a> Display<'a> {
    pub fn new(context: &'a TrackingContext<'a>, settings: &TrackSettings) -> Self {
        let errors = ErrorModel { slow_mm: 0.0, static_mm: 0.0, ..settings.errors };
        let knots = Knots::new(errors, &[]);
        // Of two shapes that fit equally well, the one with levels nearer to the middle of the prior is displayed.
        let link = Softplus { level_sd_n: SHOWN_LEVEL * settings.link.scale_n(), ..settings.link };
        Self { context, settings: TrackSettings { errors, link, ..settings.clone() }, knots }
    }

    /// A recording without slow errors, in its states on the placed body.
    fn without_slow_errors(at: &Smoother<'_>, recording: &SmoothedRecording) -> SmoothedRecording {
        let mut out = at.start(Arc::clone(&recording.frames));
        for (here, before) in out.here.iter_mut().zip(&recording.here) {
            here.z.copy_from(&before.z.rows(0, at.sizes.state()));
            here.positions.clone_from(&before.positions);
        }
        out
    }

    /// Finds recordings on a body (`None`: the placed one) from the states of a sample of their frames. Returns the levels, too; `holds`
    /// tells whether they stay as given.
    pub fn find_on_body(
        &self,
        body: Option<&RestShape>,
        (levels, holds): (&DVector<f64>, bool),
        recordings: &[SmoothedRecording],
        samples: &[SmoothedRecording],
    ) -> (Vec<SmoothedRecording>, DVector<f64>) {
        let at = Smoother::new(self.context.on_body(body), &self.settings, &self.knots);
        let mut at = Smoother { shared: levels.clone(), holds, ..at };
        let mut recordings: Vec<SmoothedRecording> =
            recordings.iter().map(|recording| Self::without_slow_errors(&at, recording)).collect();
        move_with_rest(&mut recordings, self.context.system, at.context.system);
        recordings.iter_mut().zip(samples).for_each(|(recording, sample)| begin_beside(recording, sample));
        iterate(&mut at, &mut recordings, ROUNDS, &|_| ());
        (recordings, at.shared)
    }

    /// The most probable shape for frames evenly spaced over the recordings, by damped Gauss-Newton for shape and tensions together
    /// (Levenberg 1944). The frames are solved again on each body, because the linearisation holds only near it.
    ///
    /// Where the shape is kept ([`RestShape::as_found`], or a body placed by coils), the frames are found on the body itself.
    pub fn fit_shape(
        &self,
        shape: &RestShape,
        smoother: &Smoother<'_>,
        recordings: &[SmoothedRecording],
    ) -> DisplayShape {
        let mut at = Smoother::new(*self.context, &self.settings, &self.knots);
        at.shared.copy_from(&smoother.shared.rows(0, at.sizes.muscles));
        // The costs of two bodies may differ by less than the error of a kept linearisation.
        at.keeps = false;
        let plain: Vec<SmoothedRecording> =
            recordings.iter().map(|recording| Self::without_slow_errors(&at, recording)).collect();
        let mut sample = at.thinned(&plain, SHAPE_FRAMES);
        iterate(&mut at, &mut sample, SHAPE_ROUNDS, &|_| ());
        let cost = gauss_newton::cost(&at, &sample) * TRUST;
        let (amounts, levels) = (DVector::zeros(shape.count()), at.shared.clone());
        let begin = Candidate { amounts, body: None, levels, sample, cost, rates: OnceLock::new() };
        let step = |from: &Candidate, damping: f64| {
            let here = from.body.as_ref().unwrap_or(shape);
            let context = TrackingContext { shape: Some(here), ..self.context.on_body(from.body.as_ref()) };
            let smoother = Smoother { context, shared: from.levels.clone(), ..at.clone() };
            let damped: Vec<Vec<f64>> = from.sample.iter().map(|c| vec![damping; c.frames.len()]).collect();
            let sample = from.sample.iter();
            let rates =
                from.rates.get_or_init(|| sample.map(|own| shape_jacobians(&smoother, own)).collect());
            let of_shape = ShapeStep { shape: here, rates, weight: 1.0 / TRUST, damping };
            let by = solve_step(&smoother, &from.sample, &damped, Some(of_shape))?;
            Some(least_squares::TrialStep { size: by.0.amax(), by, predicted_decrease: None, is_last: false })
        };
        let moved = |from: &Candidate, (step, steps): &(DVector<f64>, Vec<StateStep>)| {
            let n = from.levels.len();
            let there = shape.after_step(&from.amounts, &step.rows(n, step.len() - n).into_owned());
            let body = shape.moved(&there)?;
            let levels = &from.levels + step.rows(0, n);
            let context = self.context.on_body(Some(&body));
            let mut smoother = Smoother { context, shared: from.levels.clone(), ..at.clone() };
            let mut sample = from.sample.clone();
            move_with_rest(&mut sample, self.context.on_body(from.body.as_ref()).system, context.system);
            apply_steps(&smoother, &mut sample, &levels, steps);
            smoother.shared = levels;
            iterate(&mut smoother, &mut sample, SHAPE_ROUNDS, &|_| ());
            let cost = gauss_newton::cost(&smoother, &sample) * TRUST + shape.relative_cost(&there);
            let levels = smoother.shared.clone();
            let body = Some(body.expanded(&there));
            Some(Candidate { amounts: there, body, levels, sample, cost, rates: OnceLock::new() })
        };
        let rule = Rule { max_steps: if shape.is_kept() { 0 } else { SEARCH.max_steps }, ..SEARCH };
        let Candidate { body, levels, sample, .. } =
            least_squares::descend(begin, &rule, |c| c.cost, step, moved).here;
        let (recordings, levels) = self.find_on_body(body.as_ref(), (&levels, false), recordings, &sample);
        DisplayShape { body, recordings, levels }
    }
}

/// Sets the state of every frame to that of the nearest frame in time of a sample.
pub(super) fn begin_beside(recording: &mut SmoothedRecording, sample: &SmoothedRecording) {
    let found: Vec<(f64, &FrameState)> = sample.frames.iter().map(|f| f.time_s).zip(&sample.here).collect();
    for (frame, here) in recording.frames.iter().zip(&mut recording.here) {
        let known = found.iter().filter(|(_, h)| h.linear.is_some());
        if let Some((_, nearest)) = least_by(known, |(time_s, _)| (time_s - frame.time_s).abs()) {
            here.z.copy_from(&nearest.z);
            here.positions.clone_from(&nearest.positions);
        }
    }
}

/// Moves all nodes of the frames with the body at rest, including those on bone, which no equilibrium moves.
fn move_with_rest(recordings: &mut [SmoothedRecording], before: &System<2>, after: &System<2>) {
    let positions = recordings.iter_mut().flat_map(|c| &mut c.here).filter_map(|h| h.positions.as_mut());
    for positions in positions {
        let rest = before.rest().iter().zip(after.rest());
        Arc::make_mut(positions).iter_mut().zip(rest).for_each(|(p, (a, b))| *p += b - a);
    }
}
