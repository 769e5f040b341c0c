//! The physical constants of tissue (Kato 2014, table 4.1) and their ranges.

use serde::Serialize;

use crate::system::SystemError;

/// Physical constants of tongue tissue.
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

/// Largest constant that is accepted, SI. With larger ones lengths and forces would overflow.
const LARGEST: f64 = 1e12;

impl Constants {
    /// Checks that all constants are in their physical range.
    pub fn check(&self) -> Result<(), SystemError> {
        let positive = |v: f64| v > 0.0 && v <= LARGEST;
        if !positive(self.young_modulus) {
            return Err(SystemError::YoungModulus(self.young_modulus));
        }
        if !(self.poisson_ratio > -1.0 && self.poisson_ratio < 0.5) {
            return Err(SystemError::PoissonRatio(self.poisson_ratio));
        }
        if !positive(self.density) {
            return Err(SystemError::Density(self.density));
        }
        if !(0.0..=LARGEST).contains(&self.viscosity) {
            return Err(SystemError::Viscosity(self.viscosity));
        }
        Ok(())
    }

    /// Lamé's constants (λ, μ), Pa.
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young_modulus, self.poisson_ratio);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }
}
