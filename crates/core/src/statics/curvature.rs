//! Descent from ridges of the energy and unstable equilibria, where the stiffness has a negative eigenvalue.

use nalgebra::SVector;

use crate::geometry;
use crate::sparse::cholesky::NotPositiveDefinite;

use super::state::State;

/// First step along a direction of negative curvature, relative to the size of the body, and the largest
/// number of doublings.
const FIRST_WAY: f64 = 1e-7;
const MOST_DOUBLINGS: usize = 24;

impl<const D: usize> State<'_, D> {
    /// Stores the direction of negative curvature that a failed factorisation gives.
    pub(super) fn find_curvature(&mut self, failure: &NotPositiveDefinite) {
        let w = &mut *self.w;
        let pattern = self.system.pattern();
        let failure = w.factor.find_failure(pattern, &w.stiffness, *failure);
        w.factor.negative_curvature(pattern, &failure, &mut w.curvature);
    }

    /// Moves downhill along the direction of negative curvature that `failure` gives.
    pub(super) fn leave(&mut self, failure: &NotPositiveDefinite) -> bool {
        self.find_curvature(failure);
        self.done.energy = self.energy();
        self.follow_curvature()
    }

    /// Moves along the stored direction of negative curvature, to the side on which the force points, as far
    /// as doubling the step lowers the energy. Returns false if not even the shortest step does.
    pub(super) fn follow_curvature(&mut self) -> bool {
        let pattern = self.system.pattern();
        let w = &mut *self.w;
        let (mut uphill, mut longest) = (0.0, 0.0f64);
        w.step.fill(SVector::zeros());
        for (d, &node) in w.curvature.iter().zip(pattern.nodes()) {
            uphill -= d.dot(&w.force[node]);
            longest = longest.max(d.norm());
        }
        let size = geometry::extent(self.system.rest());
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
        // The limit is that of the whole way, so it is computed at the start of the way.
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
}
