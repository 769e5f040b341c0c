//! The displayed body: the speaker's most probable shape at rest, with the frames on it.

use std::slice;
use std::sync::Arc;

use nalgebra::DVector;

use tongue_core::geometry::Point;

use super::context::TrackingContext;
use super::errors::{Errors, Knots};
use super::frame::Solver;
use super::gauss_newton::{ShapeStep, descend, follow, stepped};
use super::settings::TrackSettings;
use super::shape::RestShape;
use super::shape_jacobian::by_shape;
use super::smoother::{FrameState, Sizes, SmoothedRecording, Smoother};
use super::softplus::Softplus;

/// Weight of the frames for the displayed shape, which is one body and has no intervals.
const TRUST: f64 = 0.5;
/// Standard deviation of levels while the displayed shape is found, as a fraction of the scale of tensions. It is smaller than that of the
/// intervals, so that of two shapes that fit the frames equally well the one with levels nearer to the middle of the prior is displayed.
const LEVEL_SD: f64 = 0.5;
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

/// The displayed body and the frames on it by which it was found.
pub(super) struct DisplayShape {
    /// `None` for the placed body.
    pub body: Option<RestShape>,
    pub courses: Vec<SmoothedRecording>,
    pub levels: DVector<f64>,
}

/// The search on bodies that have the speaker's shape.
///
/// The static and the slow error are left out here, because they describe a body whose shape is not the speaker's. The prior limits the
/// static error only once for all frames, so with many frames the search would change the static error instead of the shape.
pub(super) struct Display<'a> {
    stage: &'a TrackingContext<'a>,
    settings: TrackSettings,
    knots: Knots,
}

impl<'a> Display<'a> {
    pub fn new(stage: &'a TrackingContext<'a>, settings: &TrackSettings) -> Self {
        let errors = Errors { slow_mm: 0.0, static_mm: 0.0, ..settings.errors };
        let knots = Knots::new(errors, &[]);
        let link = Softplus { level_sd_n: LEVEL_SD * settings.link.scale_n(), ..settings.link };
        Self { stage, settings: TrackSettings { errors, link, ..settings.clone() }, knots }
    }

    /// A recording without slow errors, at the states that it has on the placed body.
    fn plain(at: &Smoother<'_, '_>, course: &SmoothedRecording) -> SmoothedRecording {
        let mut out = at.course(Arc::clone(&course.frames));
        for (here, before) in out.here.iter_mut().zip(&course.here) {
            here.z.copy_from(&before.z.rows(0, at.sizes.state()));
            here.positions.clone_from(&before.positions);
        }
        out
    }

    /// A recording on the displayed body at its levels, from the states of the frames by which that body was found.
    pub fn course(
        &self,
        shown: &DisplayShape,
        sizes: Sizes,
        course: &SmoothedRecording,
        sample: &SmoothedRecording,
    ) -> SmoothedRecording {
        let (mut out, body) = (course.clone(), shown.body.as_ref());
        self.on(body, (sizes, &shown.levels, true), slice::from_mut(&mut out), slice::from_ref(sample));
        out
    }

    /// Finds recordings on a body, the placed one where there is none, from the states of a sample of their frames. Returns the levels,
    /// which are held or found too.
    fn on(
        &self,
        body: Option<&RestShape>,
        (sizes, levels, holds): (Sizes, &DVector<f64>, bool),
        courses: &mut [SmoothedRecording],
        samples: &[SmoothedRecording],
    ) -> DVector<f64> {
        let Self { stage, settings, knots } = self;
        let system = body.map_or(stage.system, |body| &body.system);
        let solver = || Solver::new(system, stage.followed, settings.link).with_freed(stage.freed);
        let at = Smoother::new(Sizes { knots: 0, ..sizes }, settings, knots, &solver);
        let mut at = Smoother { shared: levels.clone(), holds, ..at };
        courses.iter_mut().for_each(|course| *course = Self::plain(&at, course));
        carry(courses, stage.system.rest(), system.rest());
        courses.iter_mut().zip(samples).for_each(|(course, sample)| begin_beside(course, sample));
        descend(&mut at, courses, settings.rounds, &|_| ());
        at.shared
    }

    /// The displayed body, which has the most probable shape for frames evenly spaced over the recordings: the Gauss-Newton method for
    /// shape and tensions together, with damping (Levenberg 1944). The linearisation holds only near a shape, so the frames are solved
    /// again on each body, and a step that increases the total cost is tried again with more damping.
    ///
    /// Where the shape is kept ([`RestShape::as_found`], or a body placed by coils), the frames are found on the body itself.
    pub fn shown(
        &self,
        shape: &RestShape,
        mode: &Smoother<'_, '_>,
        courses: &[SmoothedRecording],
    ) -> DisplayShape {
        let Self { stage, settings, knots } = self;
        let (link, sizes) = (settings.link, Sizes { knots: 0, ..mode.sizes });
        let solver = || Solver::new(stage.system, stage.followed, link).with_freed(stage.freed);
        let mut at = Smoother::new(sizes, settings, knots, &solver);
        at.shared.copy_from(&mode.shared.rows(0, sizes.muscles));
        // Two bodies can differ less in cost than a linearisation at a state nearby is wrong, so none is kept.
        at.keeps = false;
        let plain: Vec<SmoothedRecording> = courses.iter().map(|course| Self::plain(&at, course)).collect();
        let mut sample = sampled(&at, &plain);
        let mut least = descend(&mut at, &mut sample, SHAPE_ROUNDS, &|_| ()) * TRUST;
        let mut amounts = DVector::zeros(shape.count());
        let (mut damping, mut out) = (SHAPE_DAMPING, None::<RestShape>);
        // The derivatives by the shape, until a step is taken.
        let mut known: Option<Vec<_>> = None;
        let steps = if shape.is_kept() { 0 } else { SHAPES };
        for _ in 0..steps {
            if damping > MOST_DAMPING {
                break;
            }
            let here = out.as_ref().unwrap_or(shape);
            let system = out.as_ref().map_or(stage.system, |s| &s.system);
            let solver = || Solver::new(system, stage.followed, link).with_freed(stage.freed);
            let from = Smoother { solver: &solver, ..at.clone() };
            let damped: Vec<Vec<f64>> = sample.iter().map(|c| vec![damping; c.frames.len()]).collect();
            let of = |course: &SmoothedRecording| by_shape(&from, course, Some(here));
            let rates = known.take().unwrap_or_else(|| sample.iter().map(of).collect());
            let of_shape = ShapeStep { shape: here, rates: &rates, weight: 1.0 / TRUST, damping };
            let Some((step, steps)) = stepped(&from, &sample, &damped, Some(of_shape)) else { break };
            let n = at.shared.len();
            let there = shape.stepped(&amounts, &step.rows(n, step.len() - n).into_owned());
            let Some(body) = shape.moved(&there) else {
                (damping, known) = (damping * MORE, Some(rates));
                continue;
            };
            let solver = || Solver::new(&body.system, stage.followed, link).with_freed(stage.freed);
            let mut again = Smoother { solver: &solver, ..at.clone() };
            let before: Vec<Vec<FrameState>> = sample.iter().map(|c| c.here.clone()).collect();
            carry(&mut sample, system.rest(), body.system.rest());
            follow(&again, &mut sample, &(&at.shared + step.rows(0, n)), &steps);
            again.shared += step.rows(0, n);
            let cost = descend(&mut again, &mut sample, SHAPE_ROUNDS, &|_| ()) * TRUST + shape.price(&there);
            if cost < least {
                let is_done = least - cost < SHAPE_WON * cost;
                at.shared.copy_from(&again.shared);
                damping *= LESS;
                if is_done {
                    out = Some(body);
                    break;
                }
                out = Some(body.expanded(&there));
                (amounts, least) = (there, cost);
            } else {
                sample.iter_mut().zip(before).for_each(|(course, here)| course.here = here);
                (damping, known) = (damping * MORE, Some(rates));
            }
        }
        let mut courses = courses.to_vec();
        let levels = self.on(out.as_ref(), (sizes, &at.shared, false), &mut courses, &sample);
        DisplayShape { body: out, courses, levels }
    }
}

/// Frames evenly spread over recordings, by which the displayed shape is found.
pub(super) fn sampled(mode: &Smoother<'_, '_>, courses: &[SmoothedRecording]) -> Vec<SmoothedRecording> {
    let frames: usize = courses.iter().map(SmoothedRecording::count).sum();
    mode.thinned(courses, frames.div_ceil(SHAPE_FRAMES).max(1))
}

/// Sets the state of every frame to that of the frame of a sample that is nearest in time.
pub(super) fn begin_beside(course: &mut SmoothedRecording, sample: &SmoothedRecording) {
    let found: Vec<(f64, &FrameState)> = sample.frames.iter().map(|f| f.time_s).zip(&sample.here).collect();
    for (frame, here) in course.frames.iter().zip(&mut course.here) {
        let apart = |(time_s, _): &(f64, &FrameState)| (time_s - frame.time_s).abs();
        let known = found.iter().filter(|(_, h)| h.linear.is_some());
        if let Some((_, nearest)) = known.min_by(|a, b| apart(a).total_cmp(&apart(b))) {
            here.z.copy_from(&nearest.z);
            here.positions.clone_from(&nearest.positions);
        }
    }
}

/// Shapes of all frames after a change of the body at rest: every node moves with it, including nodes on bone, which no equilibrium
/// moves.
fn carry(courses: &mut [SmoothedRecording], before: &[Point], rest: &[Point]) {
    let positions = courses.iter_mut().flat_map(|c| &mut c.here).filter_map(|h| h.positions.as_mut());
    for positions in positions {
        let positions = Arc::make_mut(positions);
        positions.iter_mut().zip(before.iter().zip(rest)).for_each(|(p, (a, b))| *p += b - a);
    }
}
