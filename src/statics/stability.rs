//! Whether an equilibrium is stable, and the way down from one that is not.

use nalgebra::SVector;

use crate::effect::Tangent;
use crate::sparse::cholesky::NotPositiveDefinite;
use crate::system::System;

use super::newton::Newton;
use super::{Connection, Settings, Solution, Stability, Status, Workspace};

/// Eigenvalues nearer to zero than this part of the largest diagonal entry count as zero: a slack chain's are not exactly so.
const ZERO: f64 = 1e-9;
/// Most unstable equilibria that a solve leaves downhill before it gives up.
const MOST_ESCAPES: usize = 8;
/// First way along a direction of negative curvature, as part of the size of the body, and the most doublings of it.
const FIRST_WAY: f64 = 1e-7;
const MOST_DOUBLINGS: usize = 24;

/// Checks the stability of the equilibrium in the workspace by factorising the exact stiffness there; leaves an unstable one
/// along its negative curvature and solves on, until a stable one is found.
pub(super) fn settle<const D: usize>(
    system: &System<D>,
    workspace: &mut Workspace<D>,
    settings: &Settings,
    found: &Solution,
) -> Solution {
    let mut all = *found;
    let tensions = workspace.tensions.clone();
    for escapes in 0..=MOST_ESCAPES {
        let mut newton = Newton::new(system, workspace);
        newton.done = all;
        let (stability, failure) = newton.classify();
        all = newton.done;
        all.stability = stability;
        let Some(failure) = failure.filter(|_| stability == Stability::Unstable) else { break };
        if escapes == MOST_ESCAPES || !newton.leave(&failure) {
            all.status = Status::Unstable;
            break;
        }
        let next = Newton::new(system, workspace).run(&tensions, settings);
        all = Solution {
            iterations: all.iterations + next.iterations,
            factorisations: all.factorisations + next.factorisations,
            energy_evaluations: all.energy_evaluations + next.energy_evaluations,
            safeguarded: all.safeguarded + next.safeguarded,
            load_steps: all.load_steps,
            escapes: all.escapes + 1,
            connection: Connection::Downhill,
            ridges: all.ridges + next.ridges,
            ..next
        };
        if all.status != Status::Converged {
            break;
        }
    }
    all
}

/// Smallest eigenvalue, N/m, of the exact stiffness of the free nodes at the positions and tensions of the last solve: by
/// inverse iteration on the stiffness plus the smallest shift found that makes it positive definite. `None` where there is no
/// unknown or the stiffness is not finite.
pub fn smallest_eigenvalue<const D: usize>(system: &System<D>, workspace: &mut Workspace<D>) -> Option<f64> {
    const ITERATIONS: usize = 300;
    let pattern = system.pattern();
    let mut newton = Newton::new(system, workspace);
    newton.assemble(Tangent::Exact);
    let largest = newton.w.stiffness.largest_diagonal(pattern);
    let mut shift = 0.0;
    let mut next = 1e-12 * largest;
    while newton.try_factor().is_err() {
        if !(next.is_finite() && next < 1e6 * largest) {
            return None;
        }
        newton.w.stiffness.shift(pattern, next - shift);
        shift = next;
        next *= 4.0;
    }
    let w = newton.w;
    w.factor_ready = false;
    let mut quotient = f64::INFINITY;
    // A start that no symmetry of a mesh is likely to share.
    for (i, v) in w.unknowns.iter_mut().enumerate() {
        *v = SVector::from_fn(|d, _| ((i * D + d + 1) as f64 * 0.618_033_988_75).fract() - 0.5);
    }
    let mut image = vec![SVector::zeros(); w.unknowns.len()];
    for _ in 0..ITERATIONS {
        w.factor.solve(pattern, &mut w.unknowns);
        let norm = w.unknowns.iter().map(SVector::norm_squared).sum::<f64>().sqrt();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        w.unknowns.iter_mut().for_each(|v| *v /= norm);
        w.stiffness.multiply(pattern, &w.unknowns, &mut image);
        let before = quotient;
        quotient = w.unknowns.iter().zip(&image).map(|(v, k)| v.dot(k)).sum();
        if (before - quotient).abs() <= 1e-13 * quotient.abs() {
            break;
        }
    }
    Some(quotient - shift)
}

impl<const D: usize> Newton<'_, D> {
    /// What the exact stiffness at the present positions says, and where its factorisation failed if it did.
    fn classify(&mut self) -> (Stability, Option<NotPositiveDefinite>) {
        self.assemble(Tangent::Exact);
        let Err(_) = self.try_factor() else { return (Stability::Stable, None) };
        let pattern = self.system.pattern();
        let shift = ZERO * self.w.stiffness.largest_diagonal(pattern);
        self.w.stiffness.shift(pattern, shift);
        let shifted = self.try_factor();
        self.w.factor_ready = false;
        match shifted {
            Ok(()) => (Stability::Neutral, None),
            Err(failure) => (Stability::Unstable, Some(failure)),
        }
    }

    /// Remembers the direction of negative curvature that a failed factorisation shows.
    pub(super) fn find_curvature(&mut self, failure: &NotPositiveDefinite) {
        let w = &mut *self.w;
        w.factor.negative_curvature(self.system.pattern(), failure, &mut w.curvature);
    }

    /// Moves downhill along the direction of negative curvature that `failure` shows.
    fn leave(&mut self, failure: &NotPositiveDefinite) -> bool {
        self.find_curvature(failure);
        self.done.energy = self.energy();
        self.follow_curvature()
    }

    /// Moves along the remembered direction of negative curvature, to the side on which the force points, as far as doubling
    /// the way lowers the energy. False when not even the shortest way does.
    pub(super) fn follow_curvature(&mut self) -> bool {
        let pattern = self.system.pattern();
        let w = &mut *self.w;
        let (mut uphill, mut longest) = (0.0, 0.0f64);
        w.step.fill(SVector::zeros());
        for (d, &node) in w.curvature.iter().zip(pattern.nodes()) {
            uphill -= d.dot(&w.force[node]);
            longest = longest.max(d.norm());
        }
        let size = extent(self.system.rest());
        let scale = FIRST_WAY * size * if uphill > 0.0 { -1.0 } else { 1.0 } / longest;
        if !scale.is_finite() {
            return false;
        }
        for (d, &node) in w.curvature.iter().zip(pattern.nodes()) {
            w.step[node] = *d * scale;
        }
        w.trial.copy_from_slice(&w.positions);
        let (start, mut lowest) = (self.done.energy, self.done.energy);
        let (mut way, mut best) = (1.0, 0.0);
        // The limit is that of the whole way from the start, so it is asked for at the start.
        for _ in 0..MOST_DOUBLINGS {
            self.place_along(0.0);
            if self.step_limit() < 1.0 {
                break;
            }
            self.place_along(1.0);
            let energy = self.energy();
            if energy.is_nan() || energy >= lowest {
                break;
            }
            (lowest, best) = (energy, way);
            way *= 2.0;
            self.w.step.iter_mut().for_each(|s| *s *= 2.0);
        }
        self.place_along(best / way);
        self.done.energy = lowest;
        self.update_force();
        lowest < start
    }

    /// Puts the nodes at the start of the way plus a part of the step.
    fn place_along(&mut self, part: f64) {
        let w = &mut *self.w;
        for &node in self.system.pattern().nodes() {
            w.positions[node] = w.trial[node] + w.step[node] * part;
        }
    }

    /// How small the residual force can be made in double precision at these positions, N: the forces that meet in a node are
    /// only known to a rounding of the largest, and the positions to one of their size, which the stiffness turns into force.
    pub(super) fn rounding_level(&self) -> f64 {
        let w = &*self.w;
        let largest = |v: &[SVector<f64, D>]| v.iter().map(SVector::amax).fold(0.0, f64::max);
        let pull = w.tensions.iter().fold(0.0, |m: f64, t| m.max(t.abs())).max(largest(&w.force));
        let stiffness = w.stiffness.largest_diagonal(self.system.pattern());
        16.0 * f64::EPSILON * (pull + stiffness * largest(&w.positions))
    }
}

/// Size of the body: the longest side of its bounding box, m.
pub(super) fn extent<const D: usize>(positions: &[SVector<f64, D>]) -> f64 {
    let Some(first) = positions.first() else { return 0.0 };
    let (low, high) = positions.iter().fold((*first, *first), |(l, h), p| (l.inf(p), h.sup(p)));
    (high - low).amax()
}
