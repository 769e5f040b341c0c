//! One implicit stage: the equations of motion at a time, solved by Newton's method for the positions.
//!
//! For the known parts `x0, v0, c0` and the step `g` it solves
//!
//! ```text
//! x = x0 + g v      v = v0 + g F(x, v, c) / m      c = c0 + g dc/dt(x, c)
//! ```
//!
//! `v` and `c` follow from `x`, so that the unknowns and the pattern of the matrix `m/g² + C/g + K` are those of the equilibrium; every
//! contractile element is eliminated by itself.

use nalgebra::SVector;

use super::{Motion, State, StepCounts};
use crate::effect::{Configuration, Tangent};
use crate::geometry;
use crate::sparse::BlockMatrix;
use crate::sparse::cholesky::Factor;

/// A factor is replaced if the ratio of two successive corrections is above this.
const REFACTOR_RATIO: f64 = 0.2;
/// Exponent with which the ratio of one solve is used in the next.
const CONTRACTION_EXPONENT: f64 = 0.8;
/// Corrections below this part of the body's size count as rounding.
const ROUNDING: f64 = 1e-15;
/// Corrections that no longer shrink count as rounding below this part of the body's size, because the softest mode magnifies rounding in
/// long steps.
const STALLED_ROUNDING: f64 = 1e-10;
const MOST_ITERATIONS: usize = 25;
/// A solve fails if its corrections grow more often than this, each time with a new factor.
const MOST_GROWTHS: usize = 3;

/// Solves stages. It keeps its factor as long as Newton's method converges fast.
#[derive(Debug)]
pub(super) struct StageSolver<const D: usize> {
    /// The known parts x0, v0 and c0.
    pub known: State<D>,
    /// The stage: the first guess before a solve, the result after it.
    pub stage: State<D>,
    matrix: BlockMatrix<D>,
    factor: Factor<D>,
    /// The step of the factor; zero without a factor.
    factor_step: f64,
    /// Ratio of the last two corrections.
    contraction: f64,
    force: Vec<SVector<f64, D>>,
    step: Vec<SVector<f64, D>>,
    unknowns: Vec<SVector<f64, D>>,
    tensions: Vec<f64>,
    /// Largest correction that counts as rounding, m.
    rounding: f64,
}

impl<const D: usize> StageSolver<D> {
    pub(super) fn new(motion: &Motion<'_, D>) -> Self {
        let system = motion.system;
        let zeros = vec![SVector::zeros(); system.rest().len()];
        let size = geometry::largest(system.rest());
        let stage = motion.at_rest();
        Self {
            known: stage.clone(),
            stage,
            matrix: BlockMatrix::zeros(system.pattern()),
            factor: Factor::new(system.pattern()),
            factor_step: 0.0,
            contraction: 1.0,
            force: zeros.clone(),
            step: zeros,
            unknowns: vec![SVector::zeros(); system.pattern().unknowns()],
            tensions: vec![0.0; system.muscle_count()],
            rounding: ROUNDING * size,
        }
    }

    /// Moves the nodes by `way`, m, or by a part of it if a cell would be inverted.
    pub(super) fn predict(motion: &Motion<'_, D>, state: &mut State<D>, way: &[SVector<f64, D>]) {
        let at = Configuration { positions: &state.positions, tensions: &[] };
        let part = motion.system.step_limit(at, way);
        for &i in motion.system.pattern().nodes() {
            state.positions[i] += way[i] * part;
        }
    }

    /// Solves for the stage at its time, starting from its positions, until the estimated error is below `tolerance`, m. `None` if
    /// Newton's method does not converge, or finds a number that is not finite.
    pub(super) fn solve(
        &mut self,
        motion: &Motion<'_, D>,
        g: f64,
        tolerance: f64,
        counts: &mut StepCounts,
    ) -> Option<()> {
        // The ratio of an earlier solve becomes less reliable with time (Hairer and Wanner 1996, IV.8).
        self.contraction = self.contraction.powf(CONTRACTION_EXPONENT);
        let mut last = f64::INFINITY;
        let mut growths = 0;
        for _ in 0..MOST_ITERATIONS {
            self.update_velocities(motion, g);
            motion.force(&self.stage, &mut self.force);
            counts.force_evaluations += 1;
            if self.factor_step != g {
                self.factorise(motion, g, counts)?;
            }
            let correction = self.correct(motion, g)?;
            if last.is_finite() {
                self.contraction = correction / last;
            }
            let left = if self.contraction < 1.0 {
                correction * self.contraction / (1.0 - self.contraction)
            } else {
                correction
            };
            let stalled = last.is_finite()
                && self.contraction > 0.5
                && correction <= self.rounding * (STALLED_ROUNDING / ROUNDING);
            if left <= tolerance || correction <= self.rounding || stalled {
                self.update_velocities(motion, g);
                return Some(());
            }
            if last.is_finite() && self.contraction > REFACTOR_RATIO {
                self.factor_step = 0.0;
                growths += usize::from(self.contraction >= 1.0);
                if growths > MOST_GROWTHS {
                    break;
                }
            }
            last = correction;
        }
        self.factor_step = 0.0;
        self.contraction = 1.0;
        None
    }

    /// Computes velocities and internal states from the positions.
    fn update_velocities(&mut self, motion: &Motion<'_, D>, g: f64) {
        let (known, stage) = (&self.known, &mut self.stage);
        for &i in motion.system.pattern().nodes() {
            stage.velocities[i] = (stage.positions[i] - known.positions[i]) / g;
        }
        stage.internal.copy_from_slice(&known.internal);
        motion.tensions.write_at(stage.time, &mut self.tensions);
        motion.update_internal_state(&self.tensions, g, stage);
    }

    fn factorise(&mut self, motion: &Motion<'_, D>, g: f64, counts: &mut StepCounts) -> Option<()> {
        let pattern = motion.system.pattern();
        // With a long step the exact matrix can be indefinite near buckling; the convex one cannot.
        for tangent in [Tangent::Exact, Tangent::Convex] {
            // The matrix is symmetric, because the change of direction of the dampers is left out; later iterations correct for that.
            self.matrix.clear();
            motion.add_stiffness(&self.stage, g, tangent, &mut self.matrix);
            motion.add_damping(&self.stage, 1.0 / g, &mut self.matrix);
            self.matrix.shift(pattern, motion.mass / (g * g));
            counts.factorisations += 1;
            if self.factor.factorise(pattern, &self.matrix) {
                self.factor_step = g;
                return Some(());
            }
        }
        self.factor_step = 0.0;
        None
    }

    /// Moves the positions by one correction. Returns its largest length, m; `None` if that is not finite.
    fn correct(&mut self, motion: &Motion<'_, D>, g: f64) -> Option<f64> {
        let pattern = motion.system.pattern();
        let inertia = motion.mass / g;
        for (u, &i) in self.unknowns.iter_mut().zip(pattern.nodes()) {
            *u = self.force[i] - (self.stage.velocities[i] - self.known.velocities[i]) * inertia;
        }
        self.factor.solve(pattern, &mut self.unknowns);
        let mut largest: f64 = 0.0;
        for (u, &i) in self.unknowns.iter().zip(pattern.nodes()) {
            let size = u.norm_squared();
            if !size.is_finite() {
                self.factor_step = 0.0;
                return None;
            }
            largest = largest.max(size);
            self.step[i] = *u;
        }
        Self::predict(motion, &mut self.stage, &self.step);
        Some(largest.sqrt())
    }
}
