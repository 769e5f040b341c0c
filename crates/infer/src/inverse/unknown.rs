//! Unknowns of a fit.

/// Meaning of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The tension of a muscle, by its number in the body, N (2D: per metre of thickness).
    Tension {
        muscle: usize,
    },
    /// The displacement of a bone along an axis, m; all of its nodes move together.
    Bone {
        bone: usize,
        axis: usize,
    },
    Constant(Constant),
}

/// A constant of the tissue that can be an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constant {
    YoungModulus,
    PoissonRatio,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    pub mean: f64,
    /// Factor from the distance to the mean to a residual, in one over the unit: the inverse standard deviation, times the standard
    /// deviation of a residual if residuals are not in standard deviations.
    pub weight: f64,
}

/// An unknown, counted in a unit whose effect is similar for all unknowns: newtons, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    pub quantity: Quantity,
    /// Size of the unit in SI: the quantity is the number times this.
    pub unit: f64,
    pub lower: f64,
    pub upper: f64,
    /// Part of the range that contains the starts: from the lower bound if that is zero, else around the middle.
    pub started_in: f64,
    pub prior: Option<Prior>,
}

/// Tensions of speech are a small part of what a muscle could pull.
const STARTED_IN: f64 = 0.3;

impl Unknown {
    fn new(quantity: Quantity, unit: f64, lower: f64, upper: f64) -> Self {
        Self { quantity, unit, lower, upper, started_in: STARTED_IN, prior: None }
    }

    /// The tension of muscle number `muscle`, from 0 to `upper` newtons (2D: per metre of thickness).
    pub fn tension(muscle: usize, upper: f64) -> Self {
        Self::new(Quantity::Tension { muscle }, 1.0, 0.0, upper)
    }

    /// The activation of muscle number `muscle` of a body in space, in hundredths, from 0 to 100 hundredths. Searches begin in all of this
    /// range: where a tissue stiffens as its muscles act, those that begin with weak muscles can end in a minimum of weak muscles.
    pub fn activation(muscle: usize) -> Self {
        Self { unit: 0.01, started_in: 1.0, ..Self::tension(muscle, 100.0) }
    }

    /// The displacement of a free bone along an axis, in millimetres, of at most `most` in both directions.
    pub fn bone(bone: usize, axis: usize, most: f64) -> Self {
        Self::new(Quantity::Bone { bone, axis }, 1e-3, -most, most)
    }

    /// Young's modulus in units of 100 Pa, from `lower` to `upper` units.
    pub fn young_modulus(lower: f64, upper: f64) -> Self {
        Self::new(Quantity::Constant(Constant::YoungModulus), 100.0, lower, upper)
    }

    /// Poisson's ratio in hundredths, from `lower` to `upper` hundredths.
    pub fn poisson_ratio(lower: f64, upper: f64) -> Self {
        Self::new(Quantity::Constant(Constant::PoissonRatio), 0.01, lower, upper)
    }

    /// The unknown with a prior; mean in units, weight one over units.
    pub fn with_prior(self, mean: f64, weight: f64) -> Self {
        Self { prior: Some(Prior { mean, weight }), ..self }
    }

    pub fn is_tension(&self) -> bool {
        matches!(self.quantity, Quantity::Tension { .. })
    }
}
