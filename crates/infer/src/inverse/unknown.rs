//! What a fit searches for.

/// What a number that is searched for means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The tension of a muscle, by its number in the body, N (2D: per metre of thickness).
    Tension {
        /// Number of the muscle.
        muscle: usize,
    },
    /// How far a bone is displaced along an axis, m; all of its nodes move together.
    Bone {
        /// Number of the bone among those that the problem frees.
        bone: usize,
        /// Coordinate, from 0.
        axis: usize,
    },
    /// A constant of the tissue.
    Constant(Constant),
}

/// A constant of the tissue that a fit can search for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constant {
    /// Young's modulus, Pa.
    YoungModulus,
    /// Poisson's ratio.
    PoissonRatio,
}

/// What is known of a number before anything is measured: it is near `mean`, give or take `sd`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean, in units of the unknown.
    pub mean: f64,
    /// By what the distance from the mean is multiplied to be a residual, one over the unit: one over the standard deviation where
    /// residuals are in standard deviations; that times the standard deviation of a residual where they are not.
    pub weight: f64,
}

/// A number that is searched for, counted in a unit of which a change by one matters about as much for every unknown: newtons,
/// millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    /// What it means.
    pub quantity: Quantity,
    /// The unit in SI: the quantity is this times the number.
    pub unit: f64,
    /// Lower bound, in units.
    pub lower: f64,
    /// Upper bound, in units.
    pub upper: f64,
    /// What is known of it beforehand, in units.
    pub prior: Option<Prior>,
}

impl Unknown {
    /// The tension of muscle number `muscle`, from 0 to `upper` newtons (2D: per metre of thickness).
    pub fn tension(muscle: usize, upper: f64) -> Self {
        Self { quantity: Quantity::Tension { muscle }, unit: 1.0, lower: 0.0, upper, prior: None }
    }

    /// The displacement of a freed bone along an axis, in millimetres, at most `most` either way.
    pub fn bone(bone: usize, axis: usize, most: f64) -> Self {
        Self { quantity: Quantity::Bone { bone, axis }, unit: 1e-3, lower: -most, upper: most, prior: None }
    }

    /// Young's modulus in units of 100 Pa, from `lower` to `upper` of them.
    pub fn young_modulus(lower: f64, upper: f64) -> Self {
        Self { quantity: Quantity::Constant(Constant::YoungModulus), unit: 100.0, lower, upper, prior: None }
    }

    /// Poisson's ratio in hundredths, from `lower` to `upper` of them.
    pub fn poisson_ratio(lower: f64, upper: f64) -> Self {
        Self { quantity: Quantity::Constant(Constant::PoissonRatio), unit: 0.01, lower, upper, prior: None }
    }

    /// The same, known beforehand; mean in units, weight one over units.
    pub fn with_prior(self, mean: f64, weight: f64) -> Self {
        Self { prior: Some(Prior { mean, weight }), ..self }
    }

    /// Whether it is a tension.
    pub fn is_tension(&self) -> bool {
        matches!(self.quantity, Quantity::Tension { .. })
    }
}
