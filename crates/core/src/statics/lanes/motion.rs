//! How equilibria move when their loads change a little: one back-substitution for each change, in all lanes
//! at once.

use nalgebra::SVector;

use crate::sparse::simd::Pair;
use crate::statics::mass_spring::Neighbour;
use crate::system::System;

use super::{Equilibrium, Group, LANES, Lanes};

/// A unit of a small change of a load or of the body.
#[derive(Debug, Clone, Copy)]
pub enum Change<'a, const D: usize> {
    /// More tension in the muscle of this number, 1 N (2D: per metre of thickness).
    Tension(usize),
    /// A bone with these nodes displaced along an axis, by 1 m.
    Bone(&'a [usize], usize),
    /// Another shape at rest.
    Rest(&'a Reshaped<D>),
}

/// A direction in which the shape of a body at rest may change.
#[derive(Debug)]
pub struct Reshaped<const D: usize> {
    /// Motion of all nodes at rest for a unit of the change, m.
    motion: Vec<SVector<f64, D>>,
    neighbour: Neighbour,
}

impl<const D: usize> Lanes<'_, D> {
    /// The direction in which all nodes at rest move by `motion` for a unit; `changed` is the body after so small a `part` of the unit that
    /// its forces differ linearly. `None` for bodies that lanes cannot take.
    #[inline(never)]
    pub fn reshaped(
        &self,
        changed: &System<D>,
        motion: Vec<SVector<f64, D>>,
        part: f64,
    ) -> Option<Reshaped<D>> {
        let elements = self.elements?;
        let of_bones =
            elements.node[elements.unknowns..].iter().map(|&node| [motion[node][0], motion[node][1]]);
        let neighbour = Neighbour::new(elements, changed, of_bones.collect(), part)?;
        Some(Reshaped { motion, neighbour })
    }
}

impl<const D: usize> Group<'_, D> {
    /// The motion of all nodes in each of the last equilibria for a unit of a change, m. `None` where the
    /// equilibrium is not a stable one, where the barrier acts, and for bodies that lanes cannot take; a
    /// [`Response`](crate::statics::Response) has it there.
    #[inline(never)]
    pub fn motions(&mut self, change: Change<'_, D>) -> Vec<Option<Vec<SVector<f64, D>>>> {
        let stable = self.factorise();
        let Some((elements, work)) = self.work.as_mut().filter(|_| stable.contains(&true)) else {
            return vec![None; self.answers.len()];
        };
        let wide: Vec<Pair<LANES>> = match change {
            Change::Tension(muscle) => work.motion_by_tension(elements, muscle),
            Change::Bone(nodes, axis) => work.motion_by_bone(elements, nodes, axis),
            Change::Rest(rest) if rest.neighbour.is_of(elements) => {
                work.motion_by_rest(elements, &rest.neighbour)
            }
            Change::Rest(_) => return vec![None; self.answers.len()],
        };
        let of_lane = |(lane, shape): (usize, &Equilibrium<D>)| {
            let mut motion = vec![SVector::zeros(); shape.positions.len()];
            for (u, &node) in wide.iter().zip(&elements.node) {
                (0..2).for_each(|axis| motion[node][axis] = u[axis].0[lane]);
            }
            match change {
                Change::Tension(_) => {}
                Change::Bone(nodes, axis) => nodes.iter().for_each(|&node| motion[node][axis] = 1.0),
                Change::Rest(rest) => {
                    let bones = &elements.node[elements.unknowns..];
                    bones.iter().for_each(|&node| motion[node] = rest.motion[node]);
                }
            }
            stable[lane].then_some(motion)
        };
        self.answers.iter().enumerate().map(of_lane).collect()
    }
}
