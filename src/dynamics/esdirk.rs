//! Implicit Runge-Kutta methods with a first explicit stage and one diagonal coefficient (ESDIRK), with error control.
//!
//! All stages of a step share one matrix. The last stage is the result (stiffly accurate), and its derivative serves as the
//! first of the next step. The error of a step is the difference to an embedded formula; it is measured in m, as the largest
//! over the nodes of the error of the position, of `gamma h` times that of the velocity, and of the contractile elements.

use nalgebra::SVector;

use super::backward_euler::SOLVED;
use super::stage::StageSolver;
use super::{Control, Counts, Failure, Integrator, Motion, State, after, cut};

/// Newton's method is followed to this part of the error allowed in a step.
const SOLVE_PART: f64 = 0.02;
/// The step is chosen so that the error expected is a little less than allowed.
const SAFETY: f64 = 0.9;
/// Bounds of the change of the step.
const CHANGE: (f64, f64) = (0.2, 5.0);
/// A growth of the step that is not worth a new factor.
const IDLE_GROWTH: f64 = 1.2;
/// The first step tried, as a part of the whole time.
const FIRST_STEP: f64 = 1e-4;
/// Below this part of the time reached a step is none.
const SMALLEST_STEP: f64 = 1e-13;

/// The coefficients of a method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tableau {
    /// Short name, as on the command line.
    pub name: &'static str,
    /// Order of the result.
    pub order: u32,
    /// Power of the step with which the error estimate goes.
    pub estimate_power: i32,
    /// The diagonal coefficient.
    pub gamma: f64,
    /// When the stages lie, as parts of the step; the first at 0, the last at 1.
    pub nodes: &'static [f64],
    /// For the second and later stages the weights of the stages before.
    pub before: &'static [&'static [f64]],
    /// Weights of the result less those of the embedded formula.
    pub error: &'static [f64],
}

#[derive(Debug, Clone)]
struct Derivative<const D: usize> {
    velocity: Vec<SVector<f64, D>>,
    acceleration: Vec<SVector<f64, D>>,
    internal: Vec<f64>,
}

/// An ESDIRK method with fixed or adaptive steps.
#[derive(Debug)]
pub struct Esdirk<const D: usize> {
    tableau: &'static Tableau,
    control: Control,
    /// The step to try next, s; zero before the first.
    step: f64,
    solver: StageSolver<D>,
    stage: State<D>,
    known: State<D>,
    derivatives: Vec<Derivative<D>>,
    started: bool,
}

impl<const D: usize> Esdirk<D> {
    /// The method of `tableau`.
    pub fn new(motion: &Motion<'_, D>, tableau: &'static Tableau, control: Control) -> Self {
        let stage = motion.at_rest();
        let zero = Derivative {
            velocity: stage.velocities.clone(),
            acceleration: stage.velocities.clone(),
            internal: vec![0.0; stage.internal.len()],
        };
        Self {
            tableau,
            control,
            step: 0.0,
            solver: StageSolver::new(motion),
            known: stage.clone(),
            stage,
            derivatives: vec![zero; tableau.nodes.len()],
            started: false,
        }
    }

    fn start(&mut self, motion: &Motion<'_, D>, state: &State<D>, counts: &mut Counts) {
        let mut rates = motion.rates();
        motion.evaluate(state, &mut rates, counts);
        let first = &mut self.derivatives[0];
        first.velocity.copy_from_slice(&state.velocities);
        first.acceleration.copy_from_slice(&rates.acceleration);
        first.internal.copy_from_slice(&rates.internal);
        self.started = true;
    }

    /// Computes all stages of a step of `h` that ends at `end`; the result is in `self.stage`.
    fn stages(
        &mut self,
        motion: &Motion<'_, D>,
        state: &State<D>,
        h: f64,
        end: f64,
        counts: &mut Counts,
    ) -> bool {
        let tolerance = match self.control {
            Control::Fixed(_) => SOLVED,
            Control::Adaptive(tolerance) => SOLVE_PART * tolerance,
        };
        let nodes = motion.system().pattern().nodes();
        let g = self.tableau.gamma * h;
        for (before, weights) in self.tableau.before.iter().enumerate() {
            let number = before + 1;
            let (done, later) = self.derivatives.split_at_mut(number);
            let (known, stage) = (&mut self.known, &mut self.stage);
            known.clone_from(state);
            for (weight, k) in weights.iter().zip(&*done) {
                let w = weight * h;
                for &i in nodes {
                    known.positions[i] += k.velocity[i] * w;
                    known.velocities[i] += k.acceleration[i] * w;
                }
                known.internal.iter_mut().zip(&k.internal).for_each(|(c, r)| *c += w * r);
            }
            // Guess: the velocity goes on as in the stage before.
            let (Some(newest), Some(current)) = (done.last(), later.first_mut()) else { return false };
            let apart = (self.tableau.nodes[number] - self.tableau.nodes[before]) * h;
            stage.positions.copy_from_slice(&state.positions);
            for &i in nodes {
                let velocity = newest.velocity[i] + newest.acceleration[i] * apart;
                current.velocity[i] = known.positions[i] + velocity * g - state.positions[i];
            }
            StageSolver::predict(motion, stage, &current.velocity);
            stage.time = if number == self.tableau.before.len() {
                end
            } else {
                state.time + self.tableau.nodes[number] * h
            };
            if self.solver.solve(motion, known, stage, g, tolerance, counts).is_err() {
                return false;
            }
            for &i in nodes {
                current.velocity[i] = stage.velocities[i];
                current.acceleration[i] = (stage.velocities[i] - known.velocities[i]) / g;
            }
            for (k, (c, from)) in current.internal.iter_mut().zip(stage.internal.iter().zip(&known.internal))
            {
                *k = (c - from) / g;
            }
        }
        true
    }

    /// The error estimate of the step just made, m.
    fn error(&self, motion: &Motion<'_, D>, h: f64) -> f64 {
        let g = self.tableau.gamma * h;
        let weighted = || self.tableau.error.iter().map(|e| e * h).zip(&self.derivatives);
        let mut largest: f64 = 0.0;
        for &i in motion.system().pattern().nodes() {
            let (mut x, mut v) = (SVector::<f64, D>::zeros(), SVector::<f64, D>::zeros());
            for (w, k) in weighted() {
                x += k.velocity[i] * w;
                v += k.acceleration[i] * w;
            }
            largest = largest.max(x.norm()).max(g * v.norm());
        }
        for n in 0..self.stage.internal.len() {
            let c: f64 = weighted().map(|(w, k)| w * k.internal[n]).sum();
            largest = largest.max(c.abs());
        }
        largest
    }
}

impl<const D: usize> Integrator<D> for Esdirk<D> {
    fn name(&self) -> &'static str {
        self.tableau.name
    }

    fn order(&self) -> u32 {
        self.tableau.order
    }

    fn step(
        &mut self,
        motion: &Motion<'_, D>,
        state: &mut State<D>,
        until: f64,
        counts: &mut Counts,
    ) -> Result<(), Failure> {
        if !self.started {
            self.start(motion, state, counts);
            self.step = match self.control {
                Control::Fixed(dt) => dt,
                Control::Adaptive(_) => FIRST_STEP * (until - state.time),
            };
        }
        loop {
            let h = cut(self.step, state.time, until);
            let solved = self.stages(motion, state, h, after(h, state.time, until), counts);
            let change = match (solved, self.control) {
                (true, Control::Fixed(_)) => 1.0,
                (true, Control::Adaptive(tolerance)) => {
                    let excess = self.error(motion, h) / tolerance;
                    let best = SAFETY * excess.powf(-1.0 / f64::from(self.tableau.estimate_power));
                    // An error that is not a number counts as too large.
                    let change = if best >= CHANGE.0 { best.min(CHANGE.1) } else { CHANGE.0 };
                    if excess <= 1.0 { change.max(CHANGE.0) } else { -change }
                }
                (false, Control::Fixed(_)) => {
                    counts.rejected += 1;
                    return Err(Failure::NotSolved);
                }
                (false, Control::Adaptive(_)) => -CHANGE.0,
            };
            if change > 0.0 {
                if let Control::Adaptive(_) = self.control {
                    let next = if (1.0..IDLE_GROWTH).contains(&change) { h } else { h * change };
                    // A step cut short by the end of the interval says nothing against the longer one before.
                    self.step = if h < self.step { next.max(self.step) } else { next };
                }
                let last = self.derivatives.len() - 1;
                self.derivatives.swap(0, last);
                std::mem::swap(state, &mut self.stage);
                counts.steps += 1;
                return Ok(());
            }
            counts.rejected += 1;
            self.step = -change * h;
            if self.step < SMALLEST_STEP * until.abs() {
                return Err(Failure::StepTooSmall);
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Residuals of the conditions for order up to four of the given weights.
    pub(crate) fn order_conditions(t: &Tableau, weights: &[f64]) -> Vec<f64> {
        let s = t.nodes.len();
        let mut a = vec![vec![0.0; s]; s];
        for (i, row) in t.before.iter().enumerate() {
            a[i + 1][..row.len()].copy_from_slice(row);
            a[i + 1][i + 1] = t.gamma;
        }
        let c = t.nodes;
        let sum = |f: &dyn Fn(usize) -> f64| (0..s).map(|i| weights[i] * f(i)).sum::<f64>();
        let times =
            |v: &[f64]| -> Vec<f64> { a.iter().map(|r| r.iter().zip(v).map(|(a, v)| a * v).sum()).collect() };
        let squares: Vec<f64> = c.iter().map(|c| c * c).collect();
        let (ac, ac2) = (times(c), times(&squares));
        let aac = times(&ac);
        for (i, row) in a.iter().enumerate() {
            assert!((row.iter().sum::<f64>() - c[i]).abs() < 1e-12, "row {i} does not add up to its node");
        }
        vec![
            sum(&|_| 1.0) - 1.0,
            sum(&|i| c[i]) - 1.0 / 2.0,
            sum(&|i| c[i] * c[i]) - 1.0 / 3.0,
            sum(&|i| ac[i]) - 1.0 / 6.0,
            sum(&|i| c[i].powi(3)) - 1.0 / 4.0,
            sum(&|i| c[i] * ac[i]) - 1.0 / 8.0,
            sum(&|i| ac2[i]) - 1.0 / 12.0,
            sum(&|i| aac[i]) - 1.0 / 24.0,
        ]
    }

    /// Weights of the result and of the embedded formula.
    pub(crate) fn weights(t: &Tableau) -> (Vec<f64>, Vec<f64>) {
        let mut b = t.before[t.before.len() - 1].to_vec();
        b.push(t.gamma);
        let embedded = b.iter().zip(t.error).map(|(b, e)| b - e).collect();
        (b, embedded)
    }
}
