//! Constants of the tissue as unknowns of a fit.

use nalgebra::SVector;

use tongue_core::effect::Configuration;
use tongue_core::system::{Model, System, SystemError};

use super::problem::{Constant, Quantity, TissueUnknown, Unknown};

impl<'a, const D: usize> TissueUnknown<'a, D> {
    fn with(&self, model: Model) -> Result<System<D>, SystemError> {
        System::new(self.mesh, &model, self.contracting)
    }

    pub(super) fn model(&self, unknowns: &[Unknown], x: &[f64]) -> Model {
        let mut model = self.model;
        for (unknown, value) in unknowns.iter().zip(x) {
            match unknown.quantity {
                Quantity::Constant(Constant::YoungModulus) => model.young_modulus = value * unknown.unit,
                Quantity::Constant(Constant::PoissonRatio) => model.poisson_ratio = value * unknown.unit,
                _ => {}
            }
        }
        model
    }

    pub(super) fn system(&self, unknowns: &[Unknown], x: &[f64]) -> Result<System<D>, SystemError> {
        self.with(self.model(unknowns, x))
    }

    /// Derivative of the forces by a constant at its present value.
    pub(super) fn derivative(
        &self,
        unknowns: &[Unknown],
        x: &[f64],
        constant: Constant,
    ) -> Option<ForceDerivative<D>> {
        let here = self.model(unknowns, x);
        let (e, nu) = (here.young_modulus, here.poisson_ratio);
        let (lambda, mu) = here.lame();
        // Derivatives of λ and μ.
        let slope = match constant {
            Constant::YoungModulus => (lambda / e, mu / e),
            Constant::PoissonRatio => {
                let square = ((1.0 + nu) * (1.0 - 2.0 * nu)).powi(2);
                (e * (1.0 + 2.0 * nu * nu) / square, -mu / (1.0 + nu))
            }
        };
        // All coefficients of the tissue are linear in λ and μ, so three systems give the exact derivative.
        let changed = [(1.5 * e, nu), (e, if nu > 0.37 { 0.3 } else { 0.45 })];
        let [stiffer, other_ratio] = changed.map(|(e, nu)| {
            let model = Model { young_modulus: e, poisson_ratio: nu, ..here };
            let lame = model.lame();
            self.with(model).ok().map(|system| (system, (lame.0 - lambda, lame.1 - mu)))
        });
        let base = self.with(here).ok()?;
        let (stiffer, other_ratio) = (stiffer?, other_ratio?);
        let ((a1, a2), (b1, b2)) = (stiffer.1, other_ratio.1);
        let determinant = a1 * b2 - a2 * b1;
        let weights =
            ((slope.0 * b2 - slope.1 * b1) / determinant, (a1 * slope.1 - a2 * slope.0) / determinant);
        Some(ForceDerivative { base, others: [(stiffer.0, weights.0), (other_ratio.0, weights.1)] })
    }
}

/// The derivative of all forces by a constant, as a combination of systems.
#[derive(Debug)]
pub(super) struct ForceDerivative<const D: usize> {
    base: System<D>,
    others: [(System<D>, f64); 2],
}

impl<const D: usize> ForceDerivative<D> {
    /// Adds the derivative of the force on every node, N for a unit of the constant.
    pub fn add_force(&self, at: Configuration<'_, D>, change: &mut [SVector<f64, D>]) {
        let mut here = vec![SVector::zeros(); change.len()];
        self.base.force(at, &mut here);
        let mut there = here.clone();
        for (system, weight) in &self.others {
            system.force(at, &mut there);
            change.iter_mut().zip(&there).zip(&here).for_each(|((c, t), h)| *c += (t - h) * *weight);
        }
    }
}
