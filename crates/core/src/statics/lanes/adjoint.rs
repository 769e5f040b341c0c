//! Derivatives of functions of the shape by tensions, bones and constants: one back-substitution for each function, whatever the number of
//! parameters.

use nalgebra::SVector;

use super::scalar_fallback::adjoint_of;
use super::{Adjoint, LANES, LaneGroup, Lanes};
use crate::parallel;
use crate::sparse::simd::{Simd, SimdPair};
use crate::statics::{Response, Workspace};
use crate::system::System;
use crate::system::elements::{ElementNumbers, Elements};

impl<const D: usize> LaneGroup<'_, D> {
    /// The derivatives of a function of the shape in each of the last equilibria, from `gradients`, its derivatives by the positions of
    /// all nodes: one for each equilibrium. `None` for an equilibrium that is not stable, and if the barrier acts in a body other than the
    /// group's.
    ///
    /// # Panics
    /// If there are fewer gradients than equilibria, or a gradient has not as many entries as there are nodes.
    #[inline(never)]
    pub fn adjoint(&mut self, gradients: &[Vec<SVector<f64, D>>]) -> Vec<Option<Adjoint<D>>> {
        let stable = self.factorise();
        let (system, tensions) = (self.system, &self.tensions);
        let Some((elements, work)) = &self.work else {
            return parallel::map_mut(&mut self.fallbacks[..tensions.len()], |lane, fallback| {
                tensions[lane].as_ref().and_then(|_| fallback.adjoint(system, &gradients[lane]))
            });
        };
        let mut wide = vec![[Simd::<LANES>::ZERO; 2]; elements.node.len()];
        let mut pulls = Vec::new();
        if stable.contains(&true) {
            for (lane, gradient) in gradients.iter().enumerate().take(LANES) {
                elements.put_into_lane(lane, gradient, &mut wide);
            }
            pulls = work.adjoint(elements, &mut wide);
        }
        let equilibria = self.equilibria.iter().zip(tensions).enumerate();
        let adjoints = equilibria.map(|(lane, (shape, tensions))| {
            if !stable[lane] {
                let mut w = Workspace::new(system);
                w.set(&shape.positions, tensions.as_ref()?)?;
                return Some(adjoint_of(system, Response::new(system, &mut w)?, &gradients[lane], 1e-3));
            }
            let mut by_node = vec![SVector::zeros(); system.rest().len()];
            elements.take_from_lane(lane, &wide, &mut by_node);
            let mut by_tension = vec![0.0; system.muscle_count()];
            elements.pulls.iter().zip(&pulls).for_each(|((_, m), p)| by_tension[*m as usize] += p.0[lane]);
            Some(Adjoint { by_node, by_tension })
        });
        adjoints.collect()
    }

    /// The derivatives of the lengths of all muscles in each of the last equilibria: one [`Adjoint`] for each muscle of the mesh, in
    /// metres.
    pub fn length_rates(&mut self) -> Vec<Option<Vec<Adjoint<D>>>> {
        let muscles = self.system.muscle_count();
        let mut rates = vec![Some(Vec::with_capacity(muscles)); self.equilibria.len()];
        for muscle in 0..muscles {
            let gradients = Vec::from_iter(self.equilibria.iter().map(|shape| {
                let [a, b] = self.system.muscle_ends(muscle);
                let way = shape.positions[b] - shape.positions[a];
                let direction = way * (1.0 / way.norm());
                let mut gradient = vec![SVector::zeros(); shape.positions.len()];
                gradient[a] -= direction;
                gradient[b] += direction;
                gradient
            }));
            for (all, adjoint) in rates.iter_mut().zip(self.adjoint(&gradients)) {
                *all = all.take().zip(adjoint).map(|(mut all, one)| {
                    all.push(one);
                    all
                });
            }
        }
        rates
    }

    /// The motion of all nodes in each of the last equilibria per unit of a change, m. `None` for an equilibrium that is not stable, where
    /// the barrier acts, and for bodies that lanes cannot solve; there a [`Response`] has the motion.
    #[inline(never)]
    pub fn motions(&mut self, change: UnitChange<'_, D>) -> Vec<Option<Vec<SVector<f64, D>>>> {
        let stable = self.factorise();
        let Some((elements, work)) = self.work.as_mut().filter(|_| stable.contains(&true)) else {
            return vec![None; self.equilibria.len()];
        };
        let wide: Vec<SimdPair<LANES>> = match change {
            UnitChange::Tension(muscle) => work.motion_by_tension(elements, muscle),
            UnitChange::Bone(nodes, axis) => work.motion_by_bone(elements, nodes, axis),
            UnitChange::Rest(rest) if rest.is_of(elements) => work.motion_by_rest(elements, rest),
            UnitChange::Rest(_) => return vec![None; self.equilibria.len()],
        };
        Vec::from_iter(self.equilibria.iter().enumerate().map(|(lane, shape)| {
            let mut motion = vec![SVector::zeros(); shape.positions.len()];
            elements.take_from_lane(lane, &wide, &mut motion);
            match change {
                UnitChange::Tension(_) => {}
                UnitChange::Bone(nodes, axis) => nodes.iter().for_each(|&node| motion[node][axis] = 1.0),
                UnitChange::Rest(rest) => {
                    let bones = &elements.node[elements.unknowns..];
                    bones.iter().for_each(|&node| motion[node] = rest.motion[node]);
                }
            }
            stable[lane].then_some(motion)
        }))
    }

    /// Factorises at the equilibrium of every lane. Returns the lanes in which that succeeded.
    pub(super) fn factorise(&mut self) -> [bool; LANES] {
        if let Some(done) = self.factorised {
            return done;
        }
        let mut stable = [false; LANES];
        if let Some((elements, work)) = &mut self.work {
            for (lane, shape) in self.equilibria.iter().enumerate().filter(|(_, shape)| shape.alone) {
                elements.put_into_lane(lane, &shape.positions, &mut work.positions);
            }
            stable = work.factorise_exactly(elements);
            for (lane, shape) in self.equilibria.iter().enumerate() {
                // Lanes have no barrier and no stiffness of other bodies.
                stable[lane] &= shape.solution.guarded == 0 && work.is_set(lane);
            }
        }
        self.factorised = Some(stable);
        stable
    }
}

#[derive(Debug, Clone, Copy)]
pub enum UnitChange<'a, const D: usize> {
    /// The tension in the muscle of this number, by 1 N (2D: per metre of thickness).
    Tension(usize),
    /// The displacement of a bone with these nodes along an axis, by 1 m.
    Bone(&'a [usize], usize),
    Rest(&'a Reshaped<D>),
}

/// A direction in which the shape of a body at rest changes.
#[derive(Debug)]
pub struct Reshaped<const D: usize> {
    /// Motion of all nodes at rest per unit of the change, m.
    pub(in crate::statics) motion: Vec<SVector<f64, D>>,
    /// The numbers of the body after `part` of a unit, in all lanes.
    pub(in crate::statics) numbers: ElementNumbers<LANES>,
    pub(in crate::statics) part: f64,
}

impl<const D: usize> Reshaped<D> {
    /// Whether its elements and nodes are as many as these.
    fn is_of(&self, elements: &Elements) -> bool {
        self.numbers.stiffness.len() == elements.edges.len()
            && self.numbers.kappa.len() == elements.cells.len() + 1
            && self.motion.len() == elements.number.len()
    }
}

impl<const D: usize> Lanes<'_, D> {
    /// The direction in which all nodes at rest move by `motion`, m, per unit; `changed` is the body after a small `part` of a unit, in
    /// which its forces change linearly. `None` if lanes cannot solve the body.
    #[inline(never)]
    pub fn reshaped(
        &self,
        changed: &System<D>,
        motion: Vec<SVector<f64, D>>,
        part: f64,
    ) -> Option<Reshaped<D>> {
        let elements = self.system.elements()?;
        let mut numbers = elements.numbers();
        let is_same = elements.fill(changed, 0, &mut numbers);
        numbers.copy_first_lane();
        is_same.then_some(Reshaped { motion, numbers, part })
    }
}
