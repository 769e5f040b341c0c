//! Contracting muscle: the three-element model on each of its connections, in place of tissue (Kato 2014, 3.2.1).

use nalgebra::SVector;

use crate::sparse::{BlockMatrix, Pattern};

use super::spring::{Spring, length_and_direction};
use super::{Configuration, Effect, Tangent};

/// The connections of one contracting muscle. At equilibrium each carries `k1 (l - l0) + F`: the series spring Q2 and the
/// contractile damper drop out (thesis eqs. 3.2-3.8 with elongations in place of `r_i - r_j`).
#[derive(Debug, Clone)]
pub struct Contraction {
    muscle: usize,
    springs: Vec<Spring>,
}

impl Contraction {
    /// Muscle number `muscle` of the mesh, made of these connections.
    pub fn new(muscle: usize, springs: Vec<Spring>) -> Self {
        Self { muscle, springs }
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
}
