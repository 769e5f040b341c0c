//! The start of a mass-spring body in the plane: half of the linear response to the tensions at rest.
//!
//! From this start Newton's method takes a fifth less work than from rest, and meets fewer shapes with an indefinite stiffness. The solve
//! starts from rest if the energy is lower there or a cell is inverted at this start.

use super::SimdNewton;
use crate::sparse::simd::Simd;
use crate::system::System;
use crate::system::elements::{AtRest, Elements};

/// Part of the linear response at which a solve starts.
const START_FRACTION: f64 = 0.5;

/// The linear response to the muscles at rest; `None` if rest is not a stable equilibrium. Computed at the first call.
pub(in crate::statics) fn at_rest<'a, const D: usize>(
    system: &'a System<D>,
    elements: &Elements,
) -> Option<&'a AtRest> {
    let at_rest = system.at_rest.get_or_init(|| {
        let mut work = SimdNewton::<1>::new(elements);
        if !elements.fill(system, 0, &mut work.numbers) || !system.displaced.is_empty() {
            return None;
        }
        work.set_load(elements, 0, &vec![0.0; system.muscle_count()], system.rest(), |n| system.rest()[n]);
        let is_stable = work.factorise_exactly(elements)[0];
        let energy = work.evaluate(elements).energy.0[0];
        let responses = system.contracting().iter().map(|&muscle| {
            let motion = work.motion_by_tension(elements, muscle);
            (muscle, motion.iter().map(|u| [u[0].0[0], u[1].0[0]]).collect())
        });
        is_stable.then(|| AtRest { energy, responses: responses.collect() })
    });
    at_rest.as_ref()
}

impl<const L: usize> SimdNewton<L> {
    pub fn start_from_linear_response(&mut self, lane: usize, at_rest: &AtRest, tensions: &[f64]) {
        self.lanes[lane].energy_at_rest = Some(at_rest.energy);
        for (x, rest) in self.positions.iter().zip(&mut self.trial) {
            (0..2).for_each(|axis| rest[axis].0[lane] = x[axis].0[lane]);
        }
        for (muscle, motion) in at_rest.responses.iter().filter(|(m, _)| tensions[*m] != 0.0) {
            let part = START_FRACTION * tensions[*muscle];
            for (x, u) in self.positions.iter_mut().zip(motion) {
                (0..2).for_each(|axis| x[axis].0[lane] += part * u[axis]);
            }
        }
    }

    /// Moves lanes back to rest whose start has a higher energy or an inverted cell. Returns whether there is any.
    pub(super) fn reset_to_rest(&mut self, energy: Simd<L>, upright: [bool; L]) -> bool {
        let mut any = false;
        for (i, lane) in self.lanes.iter_mut().enumerate() {
            let Some(at_rest) = lane.energy_at_rest.take() else { continue };
            // The condition is negated so that an energy of NaN fails it too.
            if !(upright[i] && energy.0[i] <= at_rest) {
                any = true;
                for (x, rest) in self.positions.iter_mut().zip(&self.trial) {
                    (0..2).for_each(|axis| x[axis].0[i] = rest[axis].0[i]);
                }
            }
        }
        any
    }
}
