//! Connections of a mesh: passive tissue (Kato 2014, 3.2.2) and contracting muscle (3.2.1).

use nalgebra::SVector;

use super::spring::{Spring, length_and_direction};
use super::{Configuration, Effect, Internal, PrimitiveElement, Tangent};
use crate::sparse::{BlockMatrix, Pattern};

/// Connections of tissue, or those of one contracting muscle.
///
/// Tissue has the tension `k (l - l0) + b dl/dt` (Kelvin-Voigt), whose damper acts only in motion. Eq. 3.9 of the thesis has `r_i - r_j`
/// in place of the elongation; without `l0` the shape at rest would not be an equilibrium. A muscle has `k1 (l - l0) + F` at equilibrium,
/// where the series spring Q2 and the contractile damper drop out (eqs. 3.2-3.8, with elongations in place of `r_i - r_j`).
#[derive(Debug, Clone)]
pub struct Connections {
    /// In a muscle the springs Q1.
    springs: Vec<Spring>,
    /// The muscle that contracts along them; `None` in tissue.
    muscle: Option<usize>,
    /// In a muscle the stiffness k2 of Q2, in series with the contractile element, beside each spring, N/m.
    series: Vec<f64>,
    /// Time constant of what acts beside each spring, b/k of dampers and b_cc/k2 of contractile elements, s. It is the same for all, so
    /// that a straight path that replaces connections in series moves as they do.
    time: f64,
}

impl Connections {
    /// Tissue, whose connections have a damper `b = retardation * k` (s) in parallel with the spring.
    pub fn tissue(springs: Vec<Spring>, retardation: f64) -> Self {
        Self { springs, muscle: None, series: Vec::new(), time: retardation }
    }

    /// Muscle number `muscle` of the mesh: each connection has a spring Q1, and in parallel Q2 (of the stiffnesses `series`, N/m) in series
    /// with the contractile element, whose damper is `b_cc = contraction_time * k2` (s).
    pub fn muscle(muscle: usize, springs: Vec<Spring>, series: Vec<f64>, contraction_time: f64) -> Self {
        Self { springs, muscle: Some(muscle), series, time: contraction_time }
    }

    fn tension<const D: usize>(&self, at: Configuration<'_, D>) -> f64 {
        self.muscle.map_or(0.0, |muscle| at.tensions[muscle])
    }

    /// The springs of tissue, which have dampers.
    fn damped(&self) -> &[Spring] {
        if self.muscle.is_none() { &self.springs } else { &[] }
    }

    /// The springs of a muscle, each with its k2 and the state of its contractile element.
    fn contractile<'a>(&'a self, states: &'a [f64]) -> impl Iterator<Item = (&'a Spring, f64, f64)> {
        self.springs.iter().zip(&self.series).zip(states).map(|((s, k2), c)| (s, *k2, *c))
    }
}

impl<const D: usize> Effect<D> for Connections {
    fn name(&self) -> &'static str {
        if self.muscle.is_some() { "muscle" } else { "tissue" }
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.springs.iter().for_each(|s| couple(&s.nodes));
    }

    fn parts(&self, visit: &mut dyn FnMut(PrimitiveElement<'_>)) -> bool {
        self.springs.iter().for_each(|s| visit(PrimitiveElement::Line { spring: s, muscle: self.muscle }));
        true
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.springs.iter_mut().for_each(|s| s.bind(pattern));
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        let tension = self.tension(at);
        self.springs.iter().map(|s| s.energy(at.positions, tension)).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        let tension = self.tension(at);
        for s in &self.springs {
            s.add_force(at.positions, tension, force);
        }
    }

    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        let tension = self.tension(at);
        for s in &self.springs {
            s.add_stiffness(at.positions, tension, tangent, stiffness);
        }
    }

    fn add_force_per_tension(&self, at: Configuration<'_, D>, muscle: usize, rate: &mut [SVector<f64, D>]) {
        if self.muscle == Some(muscle) {
            for s in &self.springs {
                let (_, n) = length_and_direction(at.positions, s.nodes);
                s.add_pull(n, 1.0, rate);
            }
        }
    }

    fn barrier_active(&self, at: Configuration<'_, D>) -> usize {
        self.springs.iter().filter(|s| s.barrier_is_active(at.positions)).count()
    }

    fn add_viscous_force(
        &self,
        at: Configuration<'_, D>,
        velocities: &[SVector<f64, D>],
        force: &mut [SVector<f64, D>],
    ) {
        for s in self.damped() {
            let [a, b] = s.nodes;
            let (_, n) = length_and_direction(at.positions, s.nodes);
            let pull = self.time * s.stiffness * n.dot(&(velocities[b] - velocities[a]));
            s.add_pull(n, pull, force);
        }
    }

    fn add_damping(&self, at: Configuration<'_, D>, weight: f64, damping: &mut BlockMatrix<D>) {
        for s in self.damped() {
            let (length, n) = length_and_direction(at.positions, s.nodes);
            let slope = weight * self.time * s.stiffness;
            s.add_line(length, n, slope, 0.0, Tangent::Convex, damping);
        }
    }

    fn internal(&self) -> Option<&dyn Internal<D>> {
        self.muscle.map(|_| self as &dyn Internal<D>)
    }
}

/// The states are the length changes `c` of the contractile elements, m, one for each connection and 0 at first. With `e = l - l0` the
/// branch pulls with `q = k2 (e - c)`, and `q = F + b_cc dc/dt` (eqs. 3.4, 3.6-3.8, with the sign of the damper by which a lengthening
/// element resists).
impl<const D: usize> Internal<D> for Connections {
    fn count(&self) -> usize {
        self.series.len()
    }

    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64 {
        let stretches = self.contractile(states).map(|(s, k2, c)| (k2, elongation(s, positions) - c));
        stretches.map(|(k2, stretch)| 0.5 * k2 * stretch * stretch).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]) {
        for (s, k2, c) in self.contractile(states) {
            // The barrier belongs to the parallel spring.
            let (length, n) = length_and_direction(at.positions, s.nodes);
            s.add_pull(n, k2 * (length - s.rest_length - c), force);
        }
    }

    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]) {
        let tension = self.tension(at);
        for ((s, k2, c), rate) in self.contractile(states).zip(rates) {
            *rate = (elongation(s, at.positions) - c - tension / k2) / self.time;
        }
    }

    fn update_internal_state(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]) {
        let tension = self.tension(at);
        let a = step / self.time;
        for ((s, k2), c) in self.springs.iter().zip(&self.series).zip(states) {
            *c = (*c + a * (elongation(s, at.positions) - tension / k2)) / (1.0 + a);
        }
    }

    fn add_stiffness(
        &self,
        at: Configuration<'_, D>,
        step: f64,
        states: &[f64],
        tangent: Tangent,
        stiffness: &mut BlockMatrix<D>,
    ) {
        for (s, k2, c) in self.contractile(states) {
            let (length, n) = length_and_direction(at.positions, s.nodes);
            let slope = k2 / (1.0 + step / self.time);
            s.add_line(length, n, slope, k2 * (length - s.rest_length - c), tangent, stiffness);
        }
    }
}

fn elongation<const D: usize>(spring: &Spring, positions: &[SVector<f64, D>]) -> f64 {
    length_and_direction(positions, spring.nodes).0 - spring.rest_length
}
