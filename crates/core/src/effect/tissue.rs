//! Passive tissue: Kelvin-Voigt connections (Kato 2014, 3.2.2).

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern};

use super::spring::{Spring, length_and_direction};
use super::{Configuration, Effect, Part, Tangent};

/// The connections that are plain tissue: tension `k (l - l0) + b dl/dt` each, of which the damper counts
/// only in time.
///
/// The thesis writes `r_i - r_j` where the elongation from rest is meant (eq. 3.9); without `l0` the rest
/// shape would not be an equilibrium.
#[derive(Debug, Clone)]
pub struct Tissue {
    springs: Vec<Spring>,
    /// b/k, s; the same for every connection, and so for straight paths in place of several in series.
    retardation: f64,
}

impl Tissue {
    /// Tissue made of these connections, each with a damper `b = retardation * k` beside its spring
    /// (retardation time in s).
    pub fn new(springs: Vec<Spring>, retardation: f64) -> Self {
        Self { springs, retardation }
    }
}

impl<const D: usize> Effect<D> for Tissue {
    fn name(&self) -> &'static str {
        "tissue"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.springs.iter().for_each(|s| couple(&s.nodes));
    }

    fn parts(&self, visit: &mut dyn FnMut(Part<'_>)) -> bool {
        self.springs.iter().for_each(|spring| visit(Part::Line { spring, muscle: None }));
        true
    }

    fn bind(&mut self, pattern: &Pattern) {
        self.springs.iter_mut().for_each(|s| s.bind(pattern));
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.springs.iter().map(|s| s.energy(at.positions, 0.0)).sum()
    }

    fn add_force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        for s in &self.springs {
            s.add_force(at.positions, 0.0, force);
        }
    }

    fn add_stiffness(&self, at: Configuration<'_, D>, tangent: Tangent, stiffness: &mut BlockMatrix<D>) {
        for s in &self.springs {
            s.add_stiffness(at.positions, 0.0, tangent, stiffness);
        }
    }

    fn guarded(&self, at: Configuration<'_, D>) -> usize {
        self.springs.iter().filter(|s| s.is_guarded(at.positions)).count()
    }

    fn add_viscous_force(
        &self,
        at: Configuration<'_, D>,
        velocities: &[SVector<f64, D>],
        force: &mut [SVector<f64, D>],
    ) {
        for s in &self.springs {
            s.add_viscous_force(at.positions, velocities, self.retardation * s.stiffness, force);
        }
    }

    fn add_damping(&self, at: Configuration<'_, D>, weight: f64, damping: &mut BlockMatrix<D>) {
        for s in &self.springs {
            let (length, n) = length_and_direction(at.positions, s.nodes);
            let slope = weight * self.retardation * s.stiffness;
            s.add_line(length, n, slope, 0.0, Tangent::Convex, damping);
        }
    }
}
