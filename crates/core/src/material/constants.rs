//! The physical constants of tissue (Kato 2014, table 4.1) and their ranges.

use serde::Serialize;

use crate::limits::{self, BeyondLimit};

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Constants {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Young's modulus E, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio ν.
    pub poisson_ratio: f64,
    /// Viscosity η, N s/m².
    pub viscosity: f64,
}

impl Constants {
    /// Table 4.1 of the thesis (after Fujita 2008).
    pub const TONGUE: Self =
        Self { density: 1.0e3, young_modulus: 6.9e3, poisson_ratio: 0.49, viscosity: 3.0e3 };
}

impl Constants {
    pub fn check(&self) -> Result<(), BeyondLimit> {
        limits::YOUNG_MODULUS.check(self.young_modulus)?;
        limits::POISSON_RATIO.check(self.poisson_ratio)?;
        limits::DENSITY.check(self.density)?;
        limits::VISCOSITY.check(self.viscosity)
    }

    /// Lamé's constants (λ, μ), Pa.
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young_modulus, self.poisson_ratio);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }
}
