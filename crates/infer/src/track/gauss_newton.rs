//! The search for the most probable states of all frames by Gauss-Newton with a separate damping for every frame (Levenberg 1944, Marquardt
//! 1963), so that a nonlinear frame does not shorten the steps of others.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::least_squares::symmetric_cholesky;

use super::eliminate::{Eliminated, LinearProblem, windows};
use super::jacobian::Linearisation;
use super::rest_shape::RestShape;
use super::smoother::{FrameState, SmoothedRecording, Smoother, in_chunks};

/// Largest number of rounds of the search.
pub(super) const ROUNDS: usize = 40;
/// A round is quiet if it changes the cost by less than this part. The search ends after a quiet round in which few frames were held back,
/// or after two quiet rounds.
const RELATIVE_DECREASE: f64 = 5e-4;
/// Number of frames above which a few may be held back in a quiet round.
const MANY_FRAMES: usize = 150;
/// Parts of the step that are tried for a frame.
const PARTS: [f64; 3] = [1.0, 0.4, 0.1];
/// A step is rejected if the frame's cost exceeds both the previous and the expected cost by this factor plus this amount.
const TOO_FAR: (f64, f64) = (1.1, 1.0);
/// Damping of a frame in the first round, least damping after a rejected step, and damping from which the frame stays where it is, in units
/// of the precision of a muscle's deviation from its level.
const DAMPING: (f64, f64, f64) = (0.3, 0.3, 1e4);
/// Factor of the damping of a frame that responded as expected.
const DAMPING_DECREASE: f64 = 0.2;
/// Largest distance of an unknown from a linearisation that is kept, in standard deviations of a muscle's deviation from its level.
const KEPT_RANGE: f64 = 0.08;
/// Largest difference of unknowns that are equal but for rounding.
const ROUNDING: f64 = 1e-9;

struct TrialResult {
    here: FrameState,
    /// Cost of its errors before the step, if there was an equilibrium.
    was: Option<f64>,
    cost: f64,
    damping: f64,
}

pub(super) struct StateStep {
    states: Vec<DVector<f64>>,
    /// Cost of each frame by its linearisation.
    expected: Vec<f64>,
}

/// Minimises [`cost`] in at most this number of rounds and returns how many they were; `progress` gets the number of every round.
pub(super) fn iterate(
    smoother: &mut Smoother<'_>,
    recordings: &mut [SmoothedRecording],
    rounds: usize,
    progress: &dyn Fn(usize),
) -> usize {
    for recording in recordings.iter_mut() {
        let is_open = |t: usize| recording.errors[t].is_some() && recording.here[t].linear.is_none();
        for (t, linear) in linearised(smoother, recording, is_open) {
            recording.here[t].take(linear);
        }
    }
    let mut damping: Vec<Vec<f64>> = recordings.iter().map(|c| vec![DAMPING.0; c.frames.len()]).collect();
    let frames: usize = recordings.iter().map(|c| c.frames.len()).sum();
    let tolerance = RELATIVE_DECREASE * (frames as f64 / MANY_FRAMES as f64).clamp(1.0, 4.0);
    let (mut quiet, mut round) = (0, 0);
    while round < rounds {
        let Some((step, steps)) = solve_step(smoother, recordings, &damping, None) else { break };
        let shared = &smoother.shared + step;
        let all = recordings.iter().zip(&steps).zip(&damping);
        let tried: Vec<Vec<TrialResult>> = all
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
        round += 1;
        progress(round);
        quiet = if gain.abs() <= tolerance * cost { quiet + 1 } else { 0 };
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
    round
}

/// Cost of the present states of all frames and of the shared unknowns.
pub(super) fn cost(smoother: &Smoother<'_>, recordings: &[SmoothedRecording]) -> f64 {
    let frames = recordings.iter().flat_map(|recording| {
        let here = recording.here.iter().enumerate();
        here.filter_map(|(t, here)| own_cost(smoother, recording, t, here, &smoother.shared))
    });
    prior(smoother, recordings, &smoother.shared, |nth, t| &recordings[nth].here[t].z) + frames.sum::<f64>()
}

#[derive(Clone, Copy)]
pub(super) struct ShapeStep<'a> {
    pub shape: &'a RestShape,
    pub rates: &'a [Vec<Option<DMatrix<f64>>>],
    /// Weight of its prior, and its damping in units of that prior's precision.
    pub weight: f64,
    pub damping: f64,
}

/// Step of the shared unknowns, followed by those of the shape, and of every state.
pub(super) fn solve_step(
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
        let problem = LinearProblem { smoother, recording, damping, by_shape, columns: more };
        let eliminated = Eliminated::new(problem)?;
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
        let (mut states, mut expected) = (Vec::new(), Vec::new());
        for window in windows(e.steps.len()) {
            let here = e.window(&window);
            for ((rows, response), t) in here.rows.iter().zip(&here.responses).zip(window) {
                let state = -(response * &step) - e.steps[t].column(0);
                let after = smoother.residuals_after_step(rows, &state, &step);
                expected.push(if after.is_empty() { f64::INFINITY } else { after.norm_squared() });
                states.push(state);
            }
        }
        StateStep { states, expected }
    });
    let steps = steps.collect();
    Some((step, steps))
}

/// Moves the states by a step to the shared unknowns `shared`, each frame as far as it can, on another body than the linearised one.
pub(super) fn apply_steps(
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

fn own_cost(
    smoother: &Smoother<'_>,
    recording: &SmoothedRecording,
    t: usize,
    here: &FrameState,
    shared: &DVector<f64>,
) -> Option<f64> {
    let residuals = smoother.residuals_mm(recording, t, here, shared)?;
    let whitened = recording.errors[t].as_ref()?.whitened(DMatrix::from_columns(&[residuals]));
    Some(whitened.norm_squared())
}

/// Linearisations of the frames that are `open`. Frames without a solution start from the first one of their chunk, and that one from rest.
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

/// Linearises frames that have moved from their linearisations. A frame without an equilibrium goes back to its last one.
fn relinearise(smoother: &Smoother<'_>, recording: &mut SmoothedRecording) {
    let has_moved = |t: usize| {
        let linear = recording.here[t].linear.as_ref();
        linear.is_some_and(|l| (&l.x - smoother.unknowns_of(recording, t)).amax() > ROUNDING)
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
) -> Vec<TrialResult> {
    in_chunks(0..recording.frames.len(), |chunk| {
        let mut solver = smoother.solver();
        let trials: Vec<Trial<'_>> =
            chunk.iter().map(|&t| Trial::new(smoother, recording, shared, step, (t, damping[t]))).collect();
        let mut tried: Vec<Option<TrialResult>> = trials
            .iter()
            .map(|trial| trial.without_data().or_else(|| trial.with_kept_linearisation()))
            .collect();
        for part in PARTS {
            let open: Vec<usize> = (0..trials.len()).filter(|&i| tried[i].is_none()).collect();
            let x: Vec<DVector<f64>> = open.iter().map(|&i| trials[i].unknowns(part)).collect();
            let postures = Vec::from_iter(open.iter().zip(&x).map(|(&i, x)| {
                (&recording.frames[trials[i].t], x, recording.here[trials[i].t].positions.as_deref())
            }));
            for (&i, linear) in open.iter().zip(solver.linearise_all(&postures)) {
                tried[i] = linear.and_then(|linear| trials[i].accepted(part, linear));
            }
        }
        tried
            .into_iter()
            .zip(&trials)
            .map(|(tried, trial)| tried.unwrap_or_else(|| trial.unmoved()))
            .collect()
    })
}

struct Trial<'a> {
    smoother: &'a Smoother<'a>,
    recording: &'a SmoothedRecording,
    shared: &'a DVector<f64>,
    t: usize,
    /// State after the whole step.
    z: DVector<f64>,
    /// Unknowns of the equilibrium before the step, and their change in the whole step.
    x: DVector<f64>,
    change: DVector<f64>,
    /// Cost before, if there is an equilibrium, and cost after the whole step by the linearisation.
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
        let x = smoother.unknowns_of(recording, t);
        let change = smoother.unknowns(&z, shared) - &x;
        let cost = own_cost(smoother, recording, t, before, &smoother.shared);
        Self { smoother, recording, shared, t, z, x, change, cost, expected: step.expected[t], damping }
    }

    fn before(&self) -> &'a FrameState {
        &self.recording.here[self.t]
    }

    fn cost_at(&self, here: &FrameState) -> Option<f64> {
        own_cost(self.smoother, self.recording, self.t, here, self.shared)
    }

    /// The result for a frame without data.
    fn without_data(&self) -> Option<TrialResult> {
        if self.recording.errors[self.t].is_some() {
            return None;
        }
        let here = FrameState { z: self.z.clone(), linear: None, positions: self.before().positions.clone() };
        Some(TrialResult { here, was: None, cost: 0.0, damping: self.damping })
    }

    /// The whole step with the kept linearisation; `None` if the step is too long for it, or if none is kept.
    fn with_kept_linearisation(&self) -> Option<TrialResult> {
        let moved = self.smoother.unknowns(&self.z, self.shared)
            - &self.before().linear.as_ref().filter(|_| self.smoother.keeps)?.x;
        let (muscles, sd) = (self.smoother.sizes.muscles, self.smoother.settings.link.deviation_sd_n);
        if !moved.iter().enumerate().all(|(i, by)| by.abs() < KEPT_RANGE * if i < muscles { sd } else { 1.0 })
        {
            return None;
        }
        let here = FrameState { z: self.z.clone(), ..self.before().clone() };
        let cost = self.cost_at(&here)?;
        Some(TrialResult { here, was: self.cost, cost, damping: self.damping * DAMPING_DECREASE })
    }

    /// Unknowns of the equilibrium after a part of the step.
    fn unknowns(&self, part: f64) -> DVector<f64> {
        &self.x + &self.change * part
    }

    /// State after a part of the step, which applies to tensions and displacements only, because the residuals are linear in the errors.
    fn state(&self, part: f64) -> DVector<f64> {
        let mut z = self.z.clone();
        let mut x = z.rows_mut(0, self.x.len());
        x -= &self.change * (1.0 - part);
        z
    }

    /// The result of a part of the step; `None` if that is too long.
    fn accepted(&self, part: f64, linear: Linearisation) -> Option<TrialResult> {
        let positions = Some(Arc::clone(&linear.positions));
        let here = FrameState { z: self.state(part), linear: Some(Arc::new(linear)), positions };
        let there = self.cost_at(&here)?;
        let most = self.cost.map_or(f64::INFINITY, |c| c.max(self.expected) * TOO_FAR.0 + TOO_FAR.1);
        let off = (there - self.expected).abs();
        let expected = self.cost.map_or(0.0, |c| (c - self.expected).abs());
        let damping = match part {
            1.0 if off <= 0.25 * expected + 0.01 => self.damping * DAMPING_DECREASE,
            1.0 if off <= 0.75 * expected + 0.1 => self.damping,
            _ => (self.damping * 4.0).max(DAMPING.1),
        };
        (there <= most).then_some(TrialResult { here, was: self.cost, cost: there, damping })
    }

    /// The result where no part of the step is short enough.
    fn unmoved(&self) -> TrialResult {
        let here = FrameState { z: self.state(0.0), ..self.before().clone() };
        let cost = self.cost_at(&here).unwrap_or(0.0);
        TrialResult { here, was: self.cost, cost, damping: (self.damping * 10.0).max(DAMPING.1) }
    }
}
