//! TR-BDF2 with error control: the trapezoidal rule to an inner point, then the second backward differentiation formula.
//!
//! ```text
//! 0      | 0
//! 2 g    | g  g            g = 1 - sqrt(2)/2,  w = sqrt(2)/4
//! 1      | w  w  g
//! ```
//!
//! It has order two, is L-stable, and solves both implicit stages with one matrix (Bank, Coughran, Fichtner, Grosse, Rose and Smith 1985).
//! The last stage is the result, and its derivative is the first one of the next step; in the stiff limit the next derivative does not
//! depend on it, so that its rounding does not accumulate. The error of a step is the difference from an embedded formula of order three
//! (Hosea and Shampine 1996), in m: the largest of the errors of positions, of `g h` times those of velocities, and of those of
//! contractile elements.
//!
//! The trapezoidal stage reverses the sign of an imbalance of forces and keeps its magnitude. After a sudden pull a fixed step far beyond
//! the time scale of the motion would lead to impossible shapes. Such a step is made by backward Euler, which damps the imbalance
//! (Rannacher 1984), and counted in [`StepCounts::damped`]. With error control the step is shortened instead.

use nalgebra::SVector;

use super::stage::StageSolver;
use super::{Control, Integrator, Motion, MotionStatus, SHORTEST_STEP, State, StateRates, StepCounts, cut};

/// Tolerance of the corrections of Newton's method at a fixed step, m.
const FIXED_STEP_TOLERANCE: f64 = 1e-12;
/// Tolerance of the corrections of Newton's method over the error allowed in a step.
const TOLERANCE_FRACTION: f64 = 0.02;
/// The step is chosen for this part of the largest step that the error allows.
const SAFETY: f64 = 0.9;
/// Bounds of the change of the step.
const CHANGE: (f64, f64) = (0.2, 5.0);
/// A step that could grow by less than this factor is kept, which saves a factorisation.
const KEPT_GROWTH: f64 = 1.2;
/// The first step that is tried, as a part of the whole time.
const FIRST_STEP: f64 = 1e-4;
/// Shortest step over the time at the end of the interval.
const SMALLEST_STEP: f64 = 1e-13;

const ROOT_2: f64 = std::f64::consts::SQRT_2;
/// `g` of the table above.
pub const GAMMA: f64 = 1.0 - 0.5 * ROOT_2;
/// `w` of the table above.
pub const W: f64 = 0.25 * ROOT_2;
/// Number of stages, of which the first is explicit.
pub const STAGES: usize = 3;
/// Times of the stages, as parts of the step.
pub const NODES: [f64; STAGES] = [0.0, 2.0 * GAMMA, 1.0];
/// Weights of the earlier stages in the second and in the third stage.
const WEIGHTS: [&[f64]; STAGES - 1] = [&[GAMMA], &[W, W]];
/// Weights of the embedded formula of order three.
pub const EMBEDDED: [f64; STAGES] = [(1.0 - W) / 3.0, (3.0 * W + 1.0) / 3.0, GAMMA / 3.0];
/// Weights of the result minus those of the embedded formula.
const ERROR: [f64; STAGES] = [W - EMBEDDED[0], W - EMBEDDED[1], GAMMA - EMBEDDED[2]];
/// Order of the error of a step in its length.
const ERROR_POWER: f64 = 3.0;

#[derive(Debug, Clone)]
struct Derivative<const D: usize> {
    velocity: Vec<SVector<f64, D>>,
    acceleration: Vec<SVector<f64, D>>,
    internal: Vec<f64>,
}

impl<const D: usize> Derivative<D> {
    /// Sets it to that of the stage that the solver found from its known parts over the step `g`, s.
    fn set(&mut self, nodes: &[usize], StageSolver { stage, known: from, .. }: &StageSolver<D>, g: f64) {
        for &i in nodes {
            self.velocity[i] = stage.velocities[i];
            self.acceleration[i] = (stage.velocities[i] - from.velocities[i]) / g;
        }
        for (k, (c, from)) in self.internal.iter_mut().zip(stage.internal.iter().zip(&from.internal)) {
            *k = (c - from) / g;
        }
    }
}

#[derive(Debug)]
pub struct TrBdf2<const D: usize> {
    control: Control,
    /// The next step to try, s; zero before the first one.
    step: f64,
    solver: StageSolver<D>,
    derivatives: [Derivative<D>; STAGES],
}

impl<const D: usize> TrBdf2<D> {
    pub fn new(motion: &Motion<'_, D>, control: Control) -> Self {
        let State { velocities, internal, .. } = motion.at_rest();
        let zero = Derivative { velocity: velocities.clone(), acceleration: velocities, internal };
        let derivatives = std::array::from_fn(|_| zero.clone());
        Self { control, step: 0.0, solver: StageSolver::new(motion), derivatives }
    }

    /// Computes all stages of a step of `h` that ends at `end`, with the result in the solver. Returns whether they were solved.
    fn stages(
        &mut self,
        motion: &Motion<'_, D>,
        state: &State<D>,
        h: f64,
        end: f64,
        counts: &mut StepCounts,
    ) -> bool {
        let tolerance = match self.control {
            Control::Fixed(_) => FIXED_STEP_TOLERANCE,
            Control::Adaptive(tolerance) => TOLERANCE_FRACTION * tolerance,
        };
        let nodes = motion.system.pattern().nodes();
        let g = GAMMA * h;
        for (before, weights) in WEIGHTS.into_iter().enumerate() {
            let number = before + 1;
            let (done, later) = self.derivatives.split_at_mut(number);
            let StageSolver { known, stage, .. } = &mut self.solver;
            known.clone_from(state);
            for (weight, k) in weights.iter().zip(&*done) {
                let w = weight * h;
                for &i in nodes {
                    known.positions[i] += k.velocity[i] * w;
                    known.velocities[i] += k.acceleration[i] * w;
                }
                known.internal.iter_mut().zip(&k.internal).for_each(|(c, r)| *c += w * r);
            }
            // The first guess continues the motion of the stage before.
            let (Some(newest), Some(current)) = (done.last(), later.first_mut()) else { return false };
            let apart = (NODES[number] - NODES[before]) * h;
            stage.positions.copy_from_slice(&state.positions);
            for &i in nodes {
                let velocity = newest.velocity[i] + newest.acceleration[i] * apart;
                current.velocity[i] = known.positions[i] + velocity * g - state.positions[i];
            }
            StageSolver::predict(motion, stage, &current.velocity);
            stage.time = if number == WEIGHTS.len() { end } else { state.time + NODES[number] * h };
            if self.solver.solve(motion, g, tolerance, counts).is_none() {
                return false;
            }
            current.set(nodes, &self.solver, g);
        }
        true
    }

    /// Makes a step of backward Euler, with the result in the solver. Returns whether it was solved.
    fn backward_euler(
        &mut self,
        motion: &Motion<'_, D>,
        state: &State<D>,
        h: f64,
        end: f64,
        counts: &mut StepCounts,
    ) -> bool {
        let Self { solver, derivatives: [.., last], .. } = self;
        solver.known.clone_from(state);
        solver.stage.clone_from(state);
        solver.stage.time = end;
        if solver.solve(motion, h, FIXED_STEP_TOLERANCE, counts).is_none() {
            return false;
        }
        last.set(motion.system.pattern().nodes(), solver, h);
        counts.damped += 1;
        true
    }

    /// The estimated error of the last step, m.
    fn error(&self, motion: &Motion<'_, D>, h: f64) -> f64 {
        let g = GAMMA * h;
        let weighted = ERROR.iter().map(|e| e * h).zip(&self.derivatives);
        let mut largest: f64 = 0.0;
        for &i in motion.system.pattern().nodes() {
            let (mut x, mut v) = (SVector::<f64, D>::zeros(), SVector::<f64, D>::zeros());
            for (w, k) in weighted.clone() {
                x += k.velocity[i] * w;
                v += k.acceleration[i] * w;
            }
            largest = largest.max(x.norm()).max(g * v.norm());
        }
        for n in 0..self.solver.stage.internal.len() {
            let c: f64 = weighted.clone().map(|(w, k)| w * k.internal[n]).sum();
            largest = largest.max(c.abs());
        }
        largest
    }
}

impl<const D: usize> Integrator<D> for TrBdf2<D> {
    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut StepCounts,
    ) -> Result<(), MotionStatus> {
        if self.step == 0.0 {
            let mut rates = motion.rates();
            motion.evaluate(state, &mut rates, counts);
            let (velocity, StateRates { acceleration, internal, .. }) = (state.velocities.clone(), rates);
            self.derivatives[0] = Derivative { velocity, acceleration, internal };
            self.step = match self.control {
                Control::Fixed(dt) => dt,
                Control::Adaptive(_) => FIRST_STEP * (until - state.time),
            };
        }
        loop {
            let (h, end) = cut(self.step, state.time, until);
            let mut solved = self.stages(motion, state, h, end, counts);
            if let (false, Control::Fixed(_)) = (solved, self.control) {
                counts.rejected += 1;
                solved = self.backward_euler(motion, state, h, end, counts);
            }
            let change = match (solved, self.control) {
                (true, Control::Fixed(_)) => 1.0,
                (true, Control::Adaptive(tolerance)) => {
                    let excess = self.error(motion, h) / tolerance;
                    let best = SAFETY * excess.powf(-1.0 / ERROR_POWER);
                    // An error of NaN counts as too large.
                    let change = if best >= CHANGE.0 { best.min(CHANGE.1) } else { CHANGE.0 };
                    if excess <= 1.0 { change } else { -change }
                }
                (false, Control::Fixed(_)) => {
                    counts.rejected += 1;
                    return Err(MotionStatus::NotSolved);
                }
                (false, Control::Adaptive(_)) => -CHANGE.0,
            };
            if change > 0.0 {
                if let Control::Adaptive(_) = self.control {
                    let next = if (1.0..KEPT_GROWTH).contains(&change) { h } else { h * change };
                    // The step length does not change after a step that the end of the interval shortened.
                    self.step = if h < self.step { next.max(self.step) } else { next };
                }
                self.derivatives.swap(0, STAGES - 1);
                std::mem::swap(state, &mut self.solver.stage);
                counts.steps += 1;
                return Ok(());
            }
            counts.rejected += 1;
            self.step = -change * h;
            if self.step < (SMALLEST_STEP * until.abs()).max(SHORTEST_STEP) {
                return Err(MotionStatus::StepTooSmall);
            }
        }
    }
}
