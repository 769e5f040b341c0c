//! Response of an equilibrium to small changes, and derivatives of functions of it by all parameters, with the present factor of the
//! stiffness.

use super::SimdNewton;
use crate::sparse::simd::{LANES, Simd, SimdPair, difference, vectorised};
use crate::statics::lanes::Reshaped;
use crate::system::elements::Elements;
use crate::system::elements::local::evaluate;

impl<const L: usize> SimdNewton<L> {
    /// Replaces forces on the unknowns, N, by the motion that they cause, m.
    fn respond(&self, elements: &Elements, forces: &mut [SimdPair<L>]) {
        vectorised(
            #[inline(always)]
            || elements.factor.solve(&self.factor, forces),
        );
    }

    /// Motion of the unknowns per unit of tension in a muscle, m/N.
    pub fn motion_by_tension(&self, elements: &Elements, muscle: usize) -> Vec<SimdPair<L>> {
        let mut u = vec![[Simd::ZERO; 2]; elements.unknowns];
        for &(edge, _) in elements.pulls.iter().filter(|(_, m)| *m as usize == muscle) {
            let [a, b] = elements.edges[edge as usize].nodes.map(|n| n as usize);
            let d = difference(self.positions[a], self.positions[b]);
            let inverse = (d[0] * d[0] + d[1] * d[1]).sqrt().inverse();
            for axis in 0..2 {
                let pull = d[axis] * inverse;
                if let Some(u) = u.get_mut(a) {
                    u[axis] += pull;
                }
                if let Some(u) = u.get_mut(b) {
                    u[axis] -= pull;
                }
            }
        }
        self.respond(elements, &mut u);
        u
    }

    /// Motion of the unknowns for a displacement of these nodes of bones along an axis, m/m.
    pub fn motion_by_bone(&self, elements: &Elements, nodes: &[usize], axis: usize) -> Vec<SimdPair<L>> {
        let mut u = vec![[Simd::ZERO; 2]; elements.unknowns];
        for (edge, k) in elements.edges.iter().zip(&self.blocks) {
            let [a, b] = edge.nodes.map(|n| n as usize);
            if a >= elements.unknowns
                && nodes.contains(&elements.node[a])
                && let Some(u) = u.get_mut(b)
            {
                u[0] -= k[2 * axis];
                u[1] -= k[2 * axis + 1];
            }
        }
        self.respond(elements, &mut u);
        u
    }

    /// Derivatives of a function of the shape, as in [`super::lanes::Adjoint`]: `gradient`, its derivatives by the positions of all nodes,
    /// is replaced by those by forces on unknowns and by positions of bones. Returns the derivatives by tensions, one for each of the
    /// elements' pulls.
    pub fn adjoint(&self, elements: &Elements, gradient: &mut [SimdPair<L>]) -> Vec<Simd<L>> {
        let (free, held) = gradient.split_at_mut(elements.unknowns);
        self.respond(elements, free);
        for (edge, k) in elements.edges.iter().zip(&self.blocks) {
            let [a, b] = edge.nodes.map(|n| n as usize);
            if let Some(bone) = a.checked_sub(elements.unknowns)
                && b < elements.unknowns
            {
                let u = free[b];
                held[bone][0] -= k[0] * u[0] + k[1] * u[1];
                held[bone][1] -= k[2] * u[0] + k[3] * u[1];
            }
        }
        let motion = |n: u32| free.get(n as usize).copied().unwrap_or([Simd::ZERO; 2]);
        let by_tension = elements.pulls.iter().map(|&(edge, _)| {
            let [a, b] = elements.edges[edge as usize].nodes;
            let d = difference(self.positions[a as usize], self.positions[b as usize]);
            let nearer = difference(motion(b), motion(a));
            (d[0] * nearer[0] + d[1] * nearer[1]) * (d[0] * d[0] + d[1] * d[1]).sqrt().inverse()
        });
        by_tension.collect()
    }
}

impl SimdNewton<LANES> {
    /// Motion of the unknowns per unit of a change of the shape at rest. The last evaluation must be that at the equilibrium.
    pub fn motion_by_rest<const D: usize>(
        &mut self,
        elements: &Elements,
        change: &Reshaped<D>,
    ) -> Vec<SimdPair<LANES>> {
        let part = Simd::splat(change.part);
        self.trial.copy_from_slice(&self.positions);
        for (x, &node) in self.trial.iter_mut().zip(&elements.node).skip(elements.unknowns) {
            (0..2).for_each(|axis| x[axis] += Simd::splat(change.motion[node][axis]) * part);
        }
        let mut u = vec![[Simd::ZERO; 2]; elements.node.len()];
        let (tension, x, h) = (&self.tension, &self.trial, &mut self.h);
        let numbers = &change.numbers;
        vectorised(
            #[inline(always)]
            || evaluate(elements, numbers, tension, x, h, &mut u),
        );
        u.truncate(elements.unknowns);
        let inverse = part.inverse();
        for (u, force) in u.iter_mut().zip(&self.force) {
            (0..2).for_each(|axis| u[axis] = (u[axis] - force[axis]) * inverse);
        }
        self.respond(elements, &mut u);
        u
    }
}
