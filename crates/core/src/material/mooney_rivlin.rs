//! A nearly incompressible law in two parts: resistance to distortion at every point, and to a change of
//! volume of each element.

/// Mooney-Rivlin in its five-constant form with the two constants that tongues have been measured with:
/// `W = C10 (Ī1 - 3) + C20 (Ī1 - 3)² + K/2 (J - 1)²`, with `Ī1 = J^(-2/3) tr FᵀF`
/// (Gérard, Ohayon, Luboz, Perrier and Payan 2005; Buchaillard, Perrier and Payan 2009, eq. 1).
///
/// At small strain the shear modulus is `2 C10` and the bulk modulus `K`. Valid for `J > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    /// `C10`, Pa.
    pub c10: f64,
    /// `C20`, Pa.
    pub c20: f64,
    /// Bulk modulus `K`, Pa.
    pub bulk: f64,
}

impl MooneyRivlin {
    /// The tongue of Buchaillard, Perrier and Payan (2009) as ArtiSynth has it: `K = 482 C10`.
    pub const TONGUE: Self = Self { c10: 1037.0, c20: 486.0, bulk: 482.0 * 1037.0 };

    /// Poisson's ratio at small strain.
    pub fn poisson_ratio(&self) -> f64 {
        let shear = 2.0 * self.c10;
        (3.0 * self.bulk - 2.0 * shear) / (2.0 * (3.0 * self.bulk + shear))
    }

    /// Whether the constants make a solid: positive shear and bulk moduli, and no softening.
    pub(crate) fn is_sound(&self) -> bool {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        positive(self.c10) && positive(self.bulk) && self.c20.is_finite() && self.c20 >= 0.0
    }
}

impl Default for MooneyRivlin {
    fn default() -> Self {
        Self::TONGUE
    }
}
