//! The statement of an inverse problem: a body, what was measured of it, and what is unknown.

use nalgebra::SVector;

use super::movable_bone::MovableBone;
use super::{FitError, refused};
use tongue_core::body::Mesh;
use tongue_core::observe::Observation;
use tongue_core::system::{Model, System};

/// A body, its observations and its unknowns: everything that a search does not change.
#[derive(Debug, Clone)]
pub struct LeastSquaresProblem<'a, const D: usize> {
    /// The body; every muscle with an unknown tension can contract in it.
    pub system: &'a System<D>,
    /// Observations to fit; at least one.
    pub observations: Vec<Observation<D>>,
    /// Other observations, which are not fitted: among answers that meet the fitted ones equally well, they select the best.
    pub others: Vec<Observation<D>>,
    pub unknowns: Vec<Unknown>,
    pub bones: &'a [MovableBone<D>],
    /// Makes the system with other constants, if constants of the tissue are unknowns.
    pub tissue: Option<&'a TissueUnknown<'a, D>>,
    /// Tensions of all muscles of the body, N; unknown tensions are replaced.
    pub tensions: Vec<f64>,
    /// Pairs of muscles of which the second has the tension of the first, such as the right side that of the left.
    pub tied: Vec<[usize; 2]>,
    /// Unknowns and positions of all nodes (m) at which the first start begins, such as the answer of the frame before.
    pub begin: Option<(&'a [f64], &'a [SVector<f64, D>])>,
}

impl<'a, const D: usize> LeastSquaresProblem<'a, D> {
    /// The problem in which only tensions are unknown, and all other tensions are zero.
    pub fn new(system: &'a System<D>, observations: Vec<Observation<D>>, unknowns: Vec<Unknown>) -> Self {
        let tensions = vec![0.0; system.muscle_count()];
        Self {
            system,
            observations,
            others: Vec::new(),
            unknowns,
            bones: &[],
            tissue: None,
            tensions,
            tied: Vec::new(),
            begin: None,
        }
    }

    /// Whether there are fewer observations and priors than unknowns.
    pub(crate) fn is_undetermined(&self) -> bool {
        self.observations.len() + self.unknowns.iter().filter(|u| u.prior.is_some()).count()
            < self.unknowns.len()
    }

    /// Tensions of all muscles for the unknowns `x`, N.
    pub(super) fn tensions_of(&self, x: &[f64]) -> Vec<f64> {
        let mut all = self.tensions.clone();
        for (unknown, value) in self.unknowns.iter().zip(x) {
            if let Quantity::Tension { muscle } = unknown.quantity {
                all[muscle] = value * unknown.unit;
            }
        }
        self.tied.iter().for_each(|&[of, muscle]| all[muscle] = all[of]);
        all
    }

    /// Checks that unknowns, bones and observations are consistent.
    pub fn check(&self) -> Result<(), FitError> {
        if self.observations.is_empty() || self.unknowns.is_empty() {
            return refused("a fit needs at least one observation and one unknown");
        }
        for u in &self.unknowns {
            if !(u.lower.is_finite() && u.upper.is_finite() && u.lower < u.upper) {
                return refused(format!(
                    "the bounds {} and {} of an unknown must be finite and in order",
                    u.lower * u.unit,
                    u.upper * u.unit
                ));
            }
            let why = match u.quantity {
                Quantity::Tension { muscle } if !self.system.contracting().contains(&muscle) => {
                    format!("muscle {muscle} is to be fitted, but does not contract in this system")
                }
                Quantity::Bone { bone, axis } if bone >= self.bones.len() || axis >= D => {
                    format!("bone {bone}, axis {axis} is to be fitted, but was not freed")
                }
                Quantity::Constant(_) if self.tissue.is_none() => {
                    "a constant of the tissue is to be fitted, but no tissue was given for it".to_owned()
                }
                _ => continue,
            };
            return refused(why);
        }
        for end in [|u: &Unknown| u.lower, |u: &Unknown| u.upper] {
            let bounds: Vec<f64> = self.unknowns.iter().map(end).collect();
            let checked = self.tissue.map(|tissue| tissue.model(&self.unknowns, &bounds).check());
            if let Some(Err(error)) = checked {
                return refused(format!("a bound of an unknown: {error}"));
            }
        }
        match self.tied.iter().flatten().find(|m| !self.system.contracting().contains(*m)) {
            Some(muscle) => refused(format!("muscle {muscle} is tied to another, but does not contract")),
            None => Ok(()),
        }
    }
}

/// Meaning of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The tension of a muscle, by its number in the body, N (2D: per metre of thickness).
    Tension { muscle: usize },
    /// The displacement of a bone along an axis, m; all of its nodes move together.
    Bone { bone: usize, axis: usize },
    /// A constant of the tissue, in SI units.
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
    /// Residual for each unit of distance from the mean: the inverse standard deviation, times the standard deviation of a residual where
    /// residuals are not in standard deviations.
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

/// Part of the range in which searches start: tensions of speech are a small part of a muscle's strength.
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

    /// The unknown with a prior; `mean` in units of the unknown, `weight` in one over these units.
    pub fn with_prior(self, mean: f64, weight: f64) -> Self {
        Self { prior: Some(Prior { mean, weight }), ..self }
    }

    pub fn is_tension(&self) -> bool {
        matches!(self.quantity, Quantity::Tension { .. })
    }
}

/// What a system is made of besides the constants of its tissue.
#[derive(Debug, Clone)]
pub struct TissueUnknown<'a, const D: usize> {
    pub mesh: &'a Mesh<D>,
    /// Its constants are those that are not unknown.
    pub model: Model,
    pub contracting: &'a [usize],
}
