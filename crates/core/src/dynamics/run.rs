//! Runs a motion to its end in steps, with samples at given times.

use nalgebra::SVector;
use serde::Serialize;

use super::step_limit::Growth;
use super::{Integrator, Motion, SHORTEST_STEP, State, StepCounts};

/// A motion has diverged when a node's distance from the origin is this many times that of the farthest node at rest.
const DIVERGED: f64 = 100.0;
/// Number of explicit steps, which are very short, between two checks of the cells and reports of progress.
const STRIDE: u64 = 64;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionStatus {
    Completed,
    /// Even the shortest step had too large an error or could not be solved.
    StepTooSmall,
    /// Newton's method did not converge at the fixed step; take a smaller one.
    NotSolved,
    /// The step is beyond the present stability limit of the body, so that its fastest mode grows.
    Unstable,
    /// A node has diverged, because the step is far beyond the stability limit.
    Diverged,
    NotFinite,
    InvertedCell,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotionOutcome {
    pub status: MotionStatus,
    /// Time of the last valid state, s.
    pub time_s: f64,
    pub counts: StepCounts,
}

pub trait Observer<const D: usize> {
    /// Receives the positions of all nodes, m, at one of the sample times, s (cubic Hermite interpolation between steps).
    fn sample(&mut self, time: f64, positions: &[SVector<f64, D>]);

    /// Receives the time reached, s, after some of the steps.
    fn progress(&mut self, _time: f64) {}
}

impl<const D: usize> Observer<D> for () {
    fn sample(&mut self, _time: f64, _positions: &[SVector<f64, D>]) {}
}

/// `count` equidistant times from 0 to `t_end`, s, both included.
pub fn sample_times(t_end: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(|i| if i + 1 == count && i > 0 { t_end } else { t_end * i as f64 / last }).collect()
}

/// Runs to `t_end`, s. `state` is the beginning, and at the end the last valid state; `observer` gets the body at the ascending times of
/// `samples`. Steps end at every kink of the tensions.
///
/// It never panics and never leaves a number that is not finite in the state.
#[inline(never)]
pub fn run<const D: usize>(
    motion: &Motion<'_, D>,
    integrator: &mut dyn Integrator<D>,
    state: &mut State<D>,
    t_end: f64,
    samples: &[f64],
    observer: &mut dyn Observer<D>,
) -> MotionOutcome {
    let system = motion.system;
    let size = system.rest().iter().map(|p| p.norm()).fold(0.0, f64::max);
    let far = (DIVERGED * size).powi(2);
    let stride = if integrator.explicit_step().is_some() { STRIDE } else { 1 };
    let mut counts = StepCounts::default();
    let mut before = state.clone();
    let mut between = state.positions.clone();
    let mut growth = Growth::new(motion, integrator, state);
    let mut samples = samples.iter().peekable();
    let mut status = MotionStatus::Completed;
    loop {
        while let Some(&time) = samples.next_if(|&&t| t <= state.time) {
            interpolate(&before, state, time, &mut between);
            system.place_path_nodes(&mut between);
            observer.sample(time, &between);
        }
        if state.time >= t_end {
            break;
        }
        before.clone_from(state);
        let until = motion.tensions.next_kink(state.time).min(t_end);
        if until - state.time < SHORTEST_STEP {
            state.time = until;
            continue;
        }
        if let Err(failure) = integrator.step(motion, state, until, &mut counts) {
            status = failure;
            break;
        }
        let vectors = state.positions.iter().chain(&state.velocities).flatten();
        let is_finite = vectors.chain(&state.internal).all(|x| x.is_finite());
        if !is_finite || system.pattern().nodes().iter().any(|&i| state.positions[i].norm_squared() > far) {
            status = if is_finite { MotionStatus::Diverged } else { MotionStatus::NotFinite };
            std::mem::swap(state, &mut before);
            break;
        }
        if counts.steps % stride == 0 || state.time >= t_end {
            if system.cell_ratios(&state.positions).0 <= 0.0 {
                status = MotionStatus::InvertedCell;
                break;
            }
            observer.progress(state.time);
        }
        if growth.is_detected(motion, (&before, state), counts.steps, state.time >= t_end) {
            status = MotionStatus::Unstable;
            break;
        }
    }
    system.place_path_nodes(&mut state.positions);
    MotionOutcome { status, time_s: state.time, counts }
}

/// Positions at a time between two states, by the cubic with their positions and velocities.
fn interpolate<const D: usize>(a: &State<D>, b: &State<D>, time: f64, out: &mut [SVector<f64, D>]) {
    let h = b.time - a.time;
    if time >= b.time || h == 0.0 {
        return out.copy_from_slice(&b.positions);
    }
    let s = (time - a.time) / h;
    let r = 1.0 - s;
    let (pa, pb) = (r * r * (1.0 + 2.0 * s), s * s * (1.0 + 2.0 * r));
    let (va, vb) = (h * s * r * r, -h * s * s * r);
    for (i, o) in out.iter_mut().enumerate() {
        *o = a.positions[i] * pa + b.positions[i] * pb + a.velocities[i] * va + b.velocities[i] * vb;
    }
}
