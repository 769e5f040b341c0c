//! The search for the most probable states of all frames: the Gauss-Newton method with a separate damping for every frame (Levenberg 1944,
//! Marquardt 1963). A frame that responds nonlinearly takes a part of its step or none; this does not shorten the steps of other frames.

use std::sync::Arc;

use nalgebra::DVector;

use crate::least_squares::symmetric_cholesky;

use super::eliminate::{Eliminated, windows};
use super::jacobian::Linearisation;
use super::shape::RestShape;
use super::shape_jacobian::ShapeJacobian;
use super::smoother::{FrameState, SmoothedRecording, Smoother, in_chunks};

/// Largest number of rounds of the search for the most probable tensions.
pub(super) const ROUNDS: usize = 40;
/// A round is quiet if it changes the cost by less than this part. The search ends after a quiet round in which no frame was held back, and
/// after two quiet rounds in any case.
const WON: f64 = 5e-4;
/// In recordings with more frames than this, some frames are held back in every round, so a round in which only a few are counts as quiet.
const MANY_FRAMES: usize = 150;
/// Parts of the step that a frame tries.
const PARTS: [f64; 3] = [1.0, 0.4, 0.1];
/// A frame's step is too long if its cost exceeds both the previous and the expected cost by this factor plus this amount.
const TOO_FAR: (f64, f64) = (1.1, 1.0);
/// Damping: in the first round, at least for a frame that was held back, and the value from which on a frame stays where it is; in units
/// of the precision of a course.
const DAMPING: (f64, f64, f64) = (0.3, 0.3, 1e4);
/// Factor of the damping of a frame that responded as expected.
const LESS: f64 = 0.2;
/// A frame keeps its linearisation until an unknown is farther from where it was made than this, in standard deviations of a course.
const NEAR: f64 = 0.08;
/// Largest difference of unknowns that are the same but for rounding.
const SAME: f64 = 1e-9;

/// A frame after a step.
struct Tried {
    here: FrameState,
    /// The cost of its errors before the step, if there was an equilibrium, and after it.
    was: Option<f64>,
    cost: f64,
    damping: f64,
}

/// A step of the states of a recording.
pub(super) struct StateStep {
    states: Vec<DVector<f64>>,
    /// The cost of each frame if it responded linearly.
    expected: Vec<f64>,
}

/// Minimises the cost in at most this number of rounds and returns the cost at the end; `progress` is called with the number of every
/// round.
pub(super) fn minimise(
    smoother: &mut Smoother<'_>,
    recordings: &mut [SmoothedRecording],
    rounds: usize,
    progress: &dyn Fn(usize),
) -> f64 {
    for recording in recordings.iter_mut() {
        let is_open = |t: usize| recording.errors[t].is_some() && recording.here[t].linear.is_none();
        for (t, linear) in linearised(smoother, recording, is_open) {
            recording.here[t].take(linear);
        }
    }
    let mut damping: Vec<Vec<f64>> = recordings.iter().map(|c| vec![DAMPING.0; c.frames.len()]).collect();
    let frames: usize = recordings.iter().map(|c| c.frames.len()).sum();
    let won = WON * (frames as f64 / MANY_FRAMES as f64).clamp(1.0, 4.0);
    let mut quiet = 0;
    for round in 0..rounds {
        let Some((step, steps)) = stepped(smoother, recordings, &damping, None) else { break };
        let shared = &smoother.shared + step;
        let all = recordings.iter().zip(&steps).zip(&damping);
        let tried: Vec<Vec<Tried>> = all
            .map(|((recording, step), damping)| solved(smoother, recording, &shared, step, damping))
            .collect();
        let before = prior(smoother, recordings, &smoother.shared, |nth, t| &recordings[nth].here[t].z);
        let after = prior(smoother, recordings, &shared, |nth, t| &tried[nth][t].here.z);
        let (mut cost, mut gain, mut held_back) = (before, before - after, 0);
        for (tried, damping) in tried.iter().zip(&mut damping) {
            for (tried, damping) in tried.iter().zip(damping) {
                cost += tried.was.unwrap_or(0.0);
                // A frame that had no equilibrium before has no earlier cost to compare with.
                gain += tried.was.map_or(0.0, |was| was - tried.cost);
                held_back += usize::from(tried.damping > *damping && *damping < DAMPING.2);
                *damping = tried.damping;
            }
        }
        progress(round + 1);
        quiet = if gain.abs() <= won * cost { quiet + 1 } else { 0 };
        if gain > 0.0 {
            smoother.shared = shared;
            for (recording, tried) in recordings.iter_mut().zip(tried) {
                recording.here = tried.into_iter().map(|t| t.here).collect();
            }
            if quiet > 1 || quiet == 1 && held_back * MANY_FRAMES < frames.max(MANY_FRAMES) {
                break;
            }
        } else {
            damping.iter_mut().flatten().for_each(|d| *d = (*d * 5.0).max(DAMPING.1));
            if damping.iter().flatten().all(|d| *d > DAMPING.2) {
                break;
            }
        }
    }
    recordings.iter_mut().for_each(|recording| relinearise(smoother, recording));
    costs(smoother, recordings)
}

/// Total cost of states and shared unknowns.
fn costs(smoother: &Smoother<'_>, recordings: &[SmoothedRecording]) -> f64 {
    let frames = recordings.iter().flat_map(|recording| {
        (0..recording.frames.len())
            .filter_map(|t| own_cost(smoother, recording, t, &recording.here[t], &smoother.shared))
    });
    prior(smoother, recordings, &smoother.shared, |nth, t| &recordings[nth].here[t].z) + frames.sum::<f64>()
}

/// A shape that takes a step together with the states.
#[derive(Clone, Copy)]
pub(super) struct ShapeStep<'a> {
    pub shape: &'a RestShape,
    /// Its derivatives in every frame of every recording.
    pub rates: &'a [Vec<Option<ShapeJacobian>>],
    /// The weight of its prior, and its damping in units of that prior's precision.
    pub weight: f64,
    pub damping: f64,
}

/// The step of the shared unknowns, those of the shape behind the others, and of every state.
pub(super) fn stepped(
    smoother: &Smoother<'_>,
    recordings: &[SmoothedRecording],
    damping: &[Vec<f64>],
    shape: Option<ShapeStep<'_>>,
) -> Option<(DVector<f64>, Vec<StateStep>)> {
    let (mut curvature, mut gradient) =
        smoother.shared_prior(shape.map(|ShapeStep { shape, weight, damping, .. }| (shape, weight, damping)));
    let more = gradient.len() - smoother.sizes.shared();
    let mut all = Vec::with_capacity(recordings.len());
    for (nth, (recording, damping)) in recordings.iter().zip(damping).enumerate() {
        let by_shape = shape.map_or(&[][..], |s| &s.rates[nth][..]);
        let eliminated = Eliminated::new(smoother, recording, damping, (by_shape, more))?;
        curvature += &eliminated.curvature;
        gradient += &eliminated.gradient;
        all.push(eliminated);
    }
    let step = if smoother.holds {
        DVector::zeros(gradient.len())
    } else {
        -symmetric_cholesky(&curvature)?.solve(&gradient)
    };
    let steps = all.iter().map(|e| {
        let (mut states, mut expected) =
            (Vec::with_capacity(e.steps.len()), Vec::with_capacity(e.steps.len()));
        for window in windows(e.steps.len()) {
            let here = e.window(&window);
            for ((rows, answer), t) in here.rows.iter().zip(&here.answers).zip(window) {
                let state = -(answer * &step) - e.steps[t].column(0);
                expected.push(
                    rows.as_ref()
                        .map_or(f64::INFINITY, |rows| smoother.expected(rows, &state, &step).norm_squared()),
                );
                states.push(state);
            }
        }
        StateStep { states, expected }
    });
    let steps = steps.collect();
    Some((step, steps))
}

/// Moves the states of recordings by a step to which the unknowns `shared` belong, each frame as far as it can, on a body that is not the
/// one of their linearisations.
pub(super) fn follow(
    smoother: &Smoother<'_>,
    recordings: &mut [SmoothedRecording],
    shared: &DVector<f64>,
    steps: &[StateStep],
) {
    for (recording, step) in recordings.iter_mut().zip(steps) {
        let damping = vec![0.0; recording.frames.len()];
        let after: Vec<FrameState> =
            solved(smoother, recording, shared, step, &damping).into_iter().map(|t| t.here).collect();
        for (here, after) in recording.here.iter_mut().zip(after) {
            let is_old =
                here.linear.as_ref().zip(after.linear.as_ref()).is_some_and(|(a, b)| Arc::ptr_eq(a, b));
            let linear = after.linear.clone().filter(|_| !is_old);
            *here = FrameState { linear, ..after };
        }
    }
}

/// Cost of states and shared unknowns in the prior.
fn prior<'z>(
    smoother: &Smoother<'_>,
    recordings: &[SmoothedRecording],
    shared: &DVector<f64>,
    state: impl Fn(usize, usize) -> &'z DVector<f64>,
) -> f64 {
    let mut sum = shared.dot(&(&smoother.shared_precision * shared));
    for (nth, recording) in recordings.iter().enumerate() {
        let z: Vec<DVector<f64>> = (0..recording.frames.len()).map(|t| state(nth, t).clone()).collect();
        sum += z.iter().zip(recording.chain.image(&z)).map(|(z, q)| z.dot(&q)).sum::<f64>();
    }
    sum
}

/// Cost of the errors of a frame.
fn own_cost(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    t: usize,
    here: &FrameState,
    shared: &DVector<f64>,
) -> Option<f64> {
    let residuals = smoother.residuals_mm(recording, t, here, shared)?;
    let whitened = recording.errors[t].as_ref()?.whitened(nalgebra::DMatrix::from_columns(&[residuals]));
    Some(whitened.norm_squared())
}

/// Linearisations of the frames that are `open`, in their states. Frames that have not been solved yet start from the first one of their
/// chunk, and that one from rest.
fn linearised(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    is_open: impl Fn(usize) -> bool + Sync,
) -> Vec<(usize, Option<Linearisation>)> {
    in_chunks(0..recording.frames.len(), |chunk| {
        let mut solver = smoother.solver();
        let open: Vec<usize> = chunk.iter().copied().filter(|&t| is_open(t)).collect();
        let x: Vec<DVector<f64>> = open.iter().map(|&t| smoother.unknowns_of(recording, t)).collect();
        let positions = |t: usize| recording.here[t].positions.as_deref();
        let unsolved = open.iter().zip(&x).find(|(t, _)| positions(**t).is_none());
        let solved = chunk.iter().find_map(|&t| positions(t)).map(<[_]>::to_vec);
        let first = unsolved.and_then(|(&t, x)| {
            solved.or_else(|| solver.solve(&recording.frames[t], x, None).map(<[_]>::to_vec))
        });
        let postures = open.iter().zip(&x);
        let postures: Vec<_> =
            postures.map(|(&t, x)| (&recording.frames[t], x, positions(t).or(first.as_deref()))).collect();
        let linear = solver.linearise_all(&postures);
        open.into_iter().zip(linear).collect()
    })
}

/// Linearises frames at the end of the search that have another state than their linearisations. A frame without an equilibrium there goes
/// back to the state of its last one.
fn relinearise(smoother: &Smoother<'_>, recording: &mut SmoothedRecording) {
    let has_moved = |t: usize| {
        let linear = recording.here[t].linear.as_ref();
        linear.is_some_and(|l| (&l.x - smoother.unknowns_of(recording, t)).amax() > SAME)
    };
    for (t, linear) in linearised(smoother, recording, has_moved) {
        match (linear, recording.here[t].linear.clone()) {
            (None, Some(last)) => {
                let back = &last.x - smoother.unknowns_of(recording, t);
                let mut state = recording.here[t].z.rows_mut(0, back.len());
                state += back;
            }
            (linear, _) => recording.here[t].take(linear),
        }
    }
}

/// The frames of a recording after a step, each as far as it can move.
fn solved(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    shared: &DVector<f64>,
    step: &StateStep,
    damping: &[f64],
) -> Vec<Tried> {
    in_chunks(0..recording.frames.len(), |chunk| {
        let mut solver = smoother.solver();
        let to_trial = |&t: &usize| Trial::new(smoother, recording, shared, step, (t, damping[t]));
        let trials: Vec<Trial<'_>> = chunk.iter().map(to_trial).collect();
        let mut tried: Vec<Option<Tried>> =
            trials.iter().map(|trial| trial.unseen().or_else(|| trial.near())).collect();
        for part in PARTS {
            let open: Vec<usize> = (0..trials.len()).filter(|&i| tried[i].is_none()).collect();
            let x: Vec<DVector<f64>> = open.iter().map(|&i| trials[i].unknowns(part)).collect();
            let postures = Vec::from_iter(open.iter().zip(&x).map(|(&i, x)| {
                (&recording.frames[trials[i].t], x, recording.here[trials[i].t].positions.as_deref())
            }));
            for (&i, linear) in open.iter().zip(solver.linearise_all(&postures)) {
                tried[i] = linear.and_then(|linear| trials[i].judged(part, linear));
            }
        }
        tried.into_iter().zip(&trials).map(|(tried, trial)| tried.unwrap_or_else(|| trial.stayed())).collect()
    })
}

/// A frame that is to take a step.
struct Trial<'a> {
    smoother: &'a Smoother<'a>,
    recording: &'a SmoothedRecording,
    /// The shared unknowns after the step.
    shared: &'a DVector<f64>,
    t: usize,
    /// Its state after the whole step.
    z: DVector<f64>,
    /// The unknowns of its equilibrium before and after it.
    was: DVector<f64>,
    whole: DVector<f64>,
    /// The cost before, if there is an equilibrium, and the cost after the whole step if the frame responded linearly.
    cost: Option<f64>,
    expected: f64,
    damping: f64,
}

impl<'a> Trial<'a> {
    fn new(
        smoother: &'a Smoother<'a>,
        recording: &'a SmoothedRecording,
        shared: &'a DVector<f64>,
        step: &StateStep,
        (t, damping): (usize, f64),
    ) -> Self {
        let before = &recording.here[t];
        let z = &before.z + &step.states[t];
        let (was, whole) = (smoother.unknowns(&before.z, &smoother.shared), smoother.unknowns(&z, shared));
        let cost = own_cost(smoother, recording, t, before, &smoother.shared);
        Self { smoother, recording, shared, t, z, was, whole, cost, expected: step.expected[t], damping }
    }

    fn before(&self) -> &'a FrameState {
        &self.recording.here[self.t]
    }

    /// The cost of its errors after the step.
    fn cost_at(&self, here: &FrameState) -> Option<f64> {
        own_cost(self.smoother, self.recording, self.t, here, self.shared)
    }

    /// The result for a frame without data.
    fn unseen(&self) -> Option<Tried> {
        if self.recording.errors[self.t].is_some() {
            return None;
        }
        let here = FrameState { z: self.z.clone(), linear: None, positions: self.before().positions.clone() };
        Some(Tried { here, was: None, cost: 0.0, damping: self.damping })
    }

    /// The frame after a step, with the linearisation that it has; `None` if the step is too long for that to hold, or if none is kept.
    fn near(&self) -> Option<Tried> {
        let moved = &self.whole - &self.before().linear.as_ref().filter(|_| self.smoother.keeps)?.x;
        let (muscles, sd) = (self.smoother.sizes.muscles, self.smoother.settings.link.course_sd_n);
        if !moved.iter().enumerate().all(|(i, by)| by.abs() < NEAR * if i < muscles { sd } else { 1.0 }) {
            return None;
        }
        let here = FrameState { z: self.z.clone(), ..self.before().clone() };
        let cost = self.cost_at(&here)?;
        Some(Tried { here, was: self.cost, cost, damping: self.damping * LESS })
    }

    /// The unknowns of the equilibrium after a part of the step.
    fn unknowns(&self, part: f64) -> DVector<f64> {
        &self.was + (&self.whole - &self.was) * part
    }

    /// The state after a part of the step. A shorter step applies to tensions and displacements only, because the residuals are linear in
    /// the errors.
    fn state(&self, part: f64) -> DVector<f64> {
        let mut z = self.z.clone();
        let mut x = z.rows_mut(0, self.was.len());
        x -= (&self.whole - &self.was) * (1.0 - part);
        z
    }

    /// The frame after a part of the step; `None` if that is too long.
    fn judged(&self, part: f64, linear: Linearisation) -> Option<Tried> {
        let positions = Some(Arc::clone(&linear.positions));
        let here = FrameState { z: self.state(part), linear: Some(Arc::new(linear)), positions };
        let there = self.cost_at(&here)?;
        let most = self.cost.map_or(f64::INFINITY, |c| c.max(self.expected) * TOO_FAR.0 + TOO_FAR.1);
        let off = (there - self.expected).abs();
        let expected = self.cost.map_or(0.0, |c| (c - self.expected).abs());
        let damping = match part {
            1.0 if off <= 0.25 * expected + 0.01 => self.damping * LESS,
            1.0 if off <= 0.75 * expected + 0.1 => self.damping,
            _ => (self.damping * 4.0).max(DAMPING.1),
        };
        (there <= most).then_some(Tried { here, was: self.cost, cost: there, damping })
    }

    /// The frame where it was, after a step of which no part is short enough.
    fn stayed(&self) -> Tried {
        let here = FrameState { z: self.state(0.0), ..self.before().clone() };
        let cost = self.cost_at(&here).unwrap_or(0.0);
        Tried { here, was: self.cost, cost, damping: (self.damping * 10.0).max(DAMPING.1) }
    }
}
