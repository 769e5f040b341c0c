//! Newton's method in lanes. It is the method of [`crate::statics`] for any body, but for the pressure of triangles in the stiffness.
//!
//! The pressure of a nearly incompressible triangle depends so strongly on its area that a step with the right motion leaves a large error
//! of second order in it, and a stiffness with this pressure makes the next step wrong. So the stiffness uses the pressure that the linear
//! response to the step predicts, as if pressures were unknowns of their own (Magisano, Leonetti and Garcea 2017, mixed integration
//! points). Forces use the true pressure, so the equilibria are the same. A draw of a posterior takes a quarter fewer factors.

use super::{Phase, SimdNewton, of_lane, step_limit};
use crate::sparse::simd::{Simd, SimdPair, vectorised};
use crate::statics::Stability;
use crate::statics::newton::{
    ENERGY_NOISE, MOST_INDEFINITE, NEGLIGIBLE_RESIDUAL, REUSE_REDUCTION, ROUNDING, SUFFICIENT_DECREASE,
};
use crate::system::elements::Elements;
use crate::system::elements::local::{Local, assemble_stiffness, evaluate, predict_pressure};

/// A lane whose step must be shortened to less than this part is given up.
const SHORTEST_STEP: f64 = 1e-4;
/// Largest number of shifts of a singular convex stiffness, each ten times the one before.
const MOST_SHIFTS: usize = 8;

impl<const L: usize> SimdNewton<L> {
    /// Iterates in all lanes until each has converged or is given up.
    pub(super) fn newton(&mut self, elements: &Elements, max_iterations: usize) {
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Converged) {
            lane.phase = Phase::Running;
        }
        let mut here = self.evaluate(elements);
        if self.reset_to_rest(here.energy, here.upright) {
            here = self.evaluate(elements);
        }
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
            lane.done.max_residual_force = here.residual_squared.0[i].sqrt();
            lane.done.energy = here.energy.0[i];
            lane.done.energy_evaluations += 1;
            if !here.upright[i] {
                lane.phase = Phase::GivenUp;
            }
        }
        self.linear_h.copy_from_slice(&self.h);
        let mut reuse = self.factor_ready;
        while self.begin_iteration(max_iterations) {
            if !reuse {
                self.factorise(elements);
            }
            let slope = self.find_step(elements);
            reuse = self.take_step(elements, slope, reuse);
        }
    }

    /// Starts an iteration in the lanes that have not ended. Returns whether there is any.
    fn begin_iteration(&mut self, max_iterations: usize) -> bool {
        let mut any = false;
        for lane in self.lanes.iter_mut().filter(|l| l.phase == Phase::Running) {
            let (residual, floor) = (lane.done.max_residual_force, lane.done.rounding_force);
            if !(residual.is_finite() && lane.done.energy.is_finite()) {
                lane.phase = Phase::GivenUp;
            } else if residual <= lane.tolerance || residual <= floor.min(NEGLIGIBLE_RESIDUAL * lane.pull) {
                lane.phase = Phase::Converged;
            } else if lane.done.iterations == max_iterations {
                lane.phase = Phase::GivenUp;
            } else {
                lane.done.iterations += 1;
                any = true;
            }
        }
        any
    }

    /// Factorises the exact stiffness in all lanes; where it is not positive definite, the convex one plus a growing multiple of the unit
    /// matrix.
    fn factorise(&mut self, elements: &Elements) {
        let mut convex = [false; L];
        let largest = self.assemble(elements, convex);
        for (i, lane) in self.lanes.iter_mut().enumerate() {
            lane.done.rounding_force = ROUNDING * largest.0[i] * lane.extent;
        }
        let mut safe = self.try_factor(elements);
        let mut shift = [0.0; L];
        for tries in 0..=MOST_SHIFTS {
            let mut all_safe = true;
            for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
                if tries == 0 {
                    lane.exact = safe[i];
                    lane.safeguarded_in_a_row = if safe[i] { 0 } else { lane.safeguarded_in_a_row + 1 };
                    lane.done.safeguarded += usize::from(!safe[i]);
                }
                if !safe[i] && (tries == MOST_SHIFTS || lane.safeguarded_in_a_row > MOST_INDEFINITE) {
                    lane.phase = Phase::GivenUp;
                }
                if !safe[i] && lane.phase == Phase::Running {
                    (all_safe, convex[i]) = (false, true);
                }
            }
            if all_safe {
                break;
            }
            let largest = self.assemble(elements, convex);
            for lane in 0..L {
                if !safe[lane] {
                    shift[lane] = if tries == 0 { 1e-6 * largest.0[lane] } else { 10.0 * shift[lane] };
                }
            }
            for d in &mut self.diagonal[..elements.unknowns] {
                d[0] += Simd(shift);
                d[2] += Simd(shift);
            }
            safe = self.try_factor(elements);
        }
        self.factor_ready = true;
    }

    /// Checks the stability of the equilibria whose last factor was not exact, or of all with `certify`. Unstable ones are given up.
    pub(super) fn check_stability(&mut self, elements: &Elements, certify: bool) {
        let open = self.lanes.each_ref().map(|l| l.phase == Phase::Converged && (certify || !l.exact));
        let stable = if open.contains(&true) { self.factorise_exactly(elements) } else { [true; L] };
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Converged) {
            lane.done.stability = if open[i] { Stability::Stable } else { Stability::Near };
            if open[i] && !stable[i] {
                lane.phase = Phase::GivenUp;
            }
        }
    }

    /// Factorises the exact stiffness at the present positions. Returns the lanes in which it is positive definite.
    pub fn factorise_exactly(&mut self, elements: &Elements) -> [bool; L] {
        self.evaluate(elements);
        self.linear_h.copy_from_slice(&self.h);
        self.assemble(elements, [false; L]);
        let safe = self.try_factor(elements);
        self.lanes.iter_mut().zip(safe).for_each(|(lane, safe)| lane.exact = safe);
        // The next solve cannot begin with a factor that is invalid in one lane.
        self.factor_ready = safe == [true; L];
        safe
    }

    fn try_factor(&mut self, elements: &Elements) -> [bool; L] {
        for lane in &mut self.lanes {
            lane.done.factorisations += usize::from(lane.phase != Phase::GivenUp);
        }
        let (pairs, diagonal, factor) = (&self.blocks, &self.diagonal, &mut self.factor);
        vectorised(
            #[inline(always)]
            || elements.factor.factorise(pairs, diagonal, factor),
        )
    }

    /// Assembles the stiffness. Returns the largest entry on its diagonal.
    fn assemble(&mut self, elements: &Elements, convex: [bool; L]) -> Simd<L> {
        let Self { numbers, tension, positions: x, linear_h: h, blocks, diagonal, .. } = self;
        vectorised(
            #[inline(always)]
            || assemble_stiffness(elements, numbers, tension, x, h, convex, (blocks, diagonal)),
        )
    }

    pub(super) fn evaluate(&mut self, elements: &Elements) -> Local<L> {
        let Self { numbers, tension, positions: x, h, force, .. } = self;
        vectorised(
            #[inline(always)]
            || evaluate(elements, numbers, tension, x, h, force),
        )
    }

    /// Solves for the step. Returns the slope of the energy along it, J.
    fn find_step(&mut self, elements: &Elements) -> Simd<L> {
        self.step.copy_from_slice(&self.force[..elements.unknowns]);
        let (factor, b) = (&self.factor, &mut self.step);
        vectorised(
            #[inline(always)]
            || elements.factor.solve(factor, b),
        );
        let along = self.step.iter().zip(&self.force);
        along.fold(Simd::ZERO, |slope, (s, f)| slope - (s[0] * f[0] + s[1] * f[1]))
    }

    /// Backtracking line search in every lane. Returns whether the factor can be used again, which it can if the residual fell fast in
    /// every lane.
    fn take_step(&mut self, elements: &Elements, slope: Simd<L>, reused: bool) -> bool {
        let mut part = Simd(self.lanes.map(|l| if l.phase == Phase::Running { 1.0 } else { 0.0 }));
        let mut taken = part.0.map(|p| p == 0.0);
        let before = self.lanes;
        std::mem::swap(&mut self.positions, &mut self.trial);
        self.positions[elements.unknowns..].copy_from_slice(&self.trial[elements.unknowns..]);
        loop {
            let Self { positions, trial, step, .. } = &mut *self;
            vectorised(
                #[inline(always)]
                || advance(positions, trial, step, part),
            );
            let there = self.evaluate(elements);
            let mut again = false;
            for i in 0..L {
                let (lane, trial, step) = (&mut self.lanes[i], &self.trial, &self.step);
                if taken[i] {
                    continue;
                }
                lane.done.energy_evaluations += 1;
                let (old, energy) = (before[i].done.energy, there.energy.0[i]);
                let promised = SUFFICIENT_DECREASE * part.0[i] * slope.0[i];
                if part.0[i] == 1.0 && !there.upright[i] {
                    part.0[i] = step_limit(elements, |n| {
                        let step = step.get(n).map_or(nalgebra::SVector::zeros(), |s| of_lane(s, i));
                        (of_lane(&trial[n], i), step)
                    });
                    if part.0[i] == 1.0 {
                        // A cell or a spring has reached the barrier, although the step limit, which is one of cells only, allows the
                        // whole step.
                        (part.0[i], taken[i]) = (0.0, true);
                        lane.phase = Phase::GivenUp;
                    }
                    again = true;
                } else if there.upright[i] && energy <= old + promised + ENERGY_NOISE * old.abs() {
                    lane.done.energy = energy;
                    lane.done.max_residual_force = there.residual_squared.0[i].sqrt();
                    taken[i] = true;
                } else {
                    part.0[i] *= 0.5;
                    if part.0[i] < SHORTEST_STEP {
                        (part.0[i], taken[i]) = (0.0, true);
                    }
                    again = true;
                }
            }
            if !again {
                break;
            }
        }
        let Self { numbers, positions: x, trial: from, h, linear_h, .. } = &mut *self;
        vectorised(
            #[inline(always)]
            || predict_pressure(elements, numbers, from, x, h, linear_h),
        );
        let mut reuse = true;
        for (i, lane) in self.lanes.iter_mut().enumerate().filter(|(_, l)| l.phase == Phase::Running) {
            let noise = ENERGY_NOISE * before[i].done.energy.abs();
            let moved = part.0[i] > 0.0
                && (-slope.0[i] * part.0[i] > noise
                    || lane.done.max_residual_force < before[i].done.max_residual_force);
            if !moved && !reused {
                lane.phase = Phase::GivenUp;
            } else {
                reuse &= moved
                    && lane.done.max_residual_force < REUSE_REDUCTION * before[i].done.max_residual_force;
            }
        }
        reuse
    }
}

/// `x = from + part step` of the unknowns; `x` is exactly `from` in lanes whose part is zero.
#[inline(always)]
fn advance<const L: usize>(x: &mut [SimdPair<L>], from: &[SimdPair<L>], step: &[SimdPair<L>], part: Simd<L>) {
    for ((x, from), step) in x.iter_mut().zip(from).zip(step) {
        for axis in 0..2 {
            let there = from[axis] + step[axis] * part;
            for lane in 0..L {
                let stays = part.0[lane] == 0.0;
                x[axis].0[lane] = if stays { from[axis].0[lane] } else { there.0[lane] };
            }
        }
    }
}
