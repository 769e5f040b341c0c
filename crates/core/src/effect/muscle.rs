//! Contracting muscle: the three-element model on each of its connections, in place of tissue (Kato 2014,
//! 3.2.1).

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern};

use super::spring::{Spring, length_and_direction};
use super::{Configuration, Effect, Internal, Part, Tangent};

/// The connections of one contracting muscle. At equilibrium each carries `k1 (l - l0) + F`: the series
/// spring Q2 and the contractile damper drop out (thesis eqs. 3.2-3.8 with elongations in place of
/// `r_i - r_j`).
#[derive(Debug, Clone)]
pub struct Contraction {
    muscle: usize,
    /// Q1, beside the contractile branch.
    springs: Vec<Spring>,
    /// Q2, in series with the contractile element; one for each of `springs`.
    series: Vec<Spring>,
    /// b_cc/k2, s; the same for every connection, and so for straight paths in place of several in series.
    contraction_time: f64,
}

impl Contraction {
    /// Muscle number `muscle` of the mesh: on each connection a spring Q1, and beside it Q2 in series with
    /// the contractile element, whose damper is `b_cc = contraction_time * k2` (in s).
    pub fn new(muscle: usize, springs: Vec<Spring>, series: Vec<Spring>, contraction_time: f64) -> Self {
        Self { muscle, springs, series, contraction_time }
    }

    fn tension<const D: usize>(&self, at: Configuration<'_, D>) -> f64 {
        at.tensions[self.muscle]
    }
}

impl<const D: usize> Effect<D> for Contraction {
    fn name(&self) -> &'static str {
        "muscle"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.springs.iter().for_each(|s| couple(&s.nodes));
    }

    fn parts(&self, visit: &mut dyn FnMut(Part<'_>)) -> bool {
        let muscle = Some(self.muscle);
        self.springs.iter().for_each(|spring| visit(Part::Line { spring, muscle }));
        true
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.springs.iter_mut().chain(&mut self.series).for_each(|s| s.bind(pattern));
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

    fn add_force_per_tension(
        &self,
        at: Configuration<'_, D>,
        muscle: usize,
        derivative: &mut [SVector<f64, D>],
    ) {
        if muscle == self.muscle {
            for s in &self.springs {
                let (_, n) = length_and_direction(at.positions, s.nodes);
                derivative[s.nodes[0]] += n;
                derivative[s.nodes[1]] -= n;
            }
        }
    }

    fn guarded(&self, at: Configuration<'_, D>) -> usize {
        self.springs.iter().filter(|s| s.is_guarded(at.positions)).count()
    }

    fn internal(&self) -> Option<&dyn Internal<D>> {
        Some(self)
    }
}

/// One state a connection: the length change `c` of its contractile element, m (0 at first). With
/// `e = l - l0` the branch pulls with `q = k2 (e - c)`, and `q = F + b_cc dc/dt` (eqs. 3.4, 3.6-3.8; the sign
/// of the damper is the one with which a lengthening element resists).
impl<const D: usize> Internal<D> for Contraction {
    fn count(&self) -> usize {
        self.series.len()
    }

    fn energy(&self, positions: &[SVector<f64, D>], states: &[f64]) -> f64 {
        let stretches =
            self.series.iter().zip(states).map(|(s, c)| (s.stiffness, elongation(s, positions) - c));
        stretches.map(|(k2, stretch)| 0.5 * k2 * stretch * stretch).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, states: &[f64], force: &mut [SVector<f64, D>]) {
        for (s, c) in self.series.iter().zip(states) {
            // Without the barrier: that is the parallel spring's.
            let (length, n) = length_and_direction(at.positions, s.nodes);
            s.add_pull(n, s.stiffness * (length - s.rest_length - c), force);
        }
    }

    fn rates(&self, at: Configuration<'_, D>, states: &[f64], rates: &mut [f64]) {
        let tension = self.tension(at);
        for ((s, c), rate) in self.series.iter().zip(states).zip(rates) {
            *rate = (elongation(s, at.positions) - c - tension / s.stiffness) / self.contraction_time;
        }
    }

    fn settle(&self, at: Configuration<'_, D>, step: f64, states: &mut [f64]) {
        let tension = self.tension(at);
        let a = step / self.contraction_time;
        for (s, c) in self.series.iter().zip(states) {
            *c = (*c + a * (elongation(s, at.positions) - tension / s.stiffness)) / (1.0 + a);
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
        for (s, c) in self.series.iter().zip(states) {
            let (length, n) = length_and_direction(at.positions, s.nodes);
            let slope = s.stiffness / (1.0 + step / self.contraction_time);
            s.add_line(length, n, slope, s.stiffness * (length - s.rest_length - c), tangent, stiffness);
        }
    }
}

fn elongation<const D: usize>(spring: &Spring, positions: &[SVector<f64, D>]) -> f64 {
    length_and_direction(positions, spring.nodes).0 - spring.rest_length
}
