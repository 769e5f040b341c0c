//! The statement of an inverse problem: a body, what was measured of it, and what is unknown.

use nalgebra::SVector;

use tongue_core::observe::Observation;
use tongue_core::system::System;

use super::FitError;
use super::constants::TissueUnknown;
use super::movable_bone::MovableBone;
use super::unknown::{Quantity, Unknown};

/// A body, its observations and its unknowns: everything that a search does not change.
#[derive(Debug, Clone)]
pub struct LeastSquaresProblem<'a, const D: usize> {
    /// The body; every muscle with an unknown tension can contract in it.
    pub system: &'a System<D>,
    /// Observations to fit; at least one.
    pub observations: Vec<Observation<D>>,
    /// Other observations, which are not fitted: among answers that meet the fitted ones equally well, they
    /// select the best.
    pub others: Vec<Observation<D>>,
    pub unknowns: Vec<Unknown>,
    pub bones: &'a [MovableBone<D>],
    /// Makes the system with other constants, if constants of the tissue are unknowns.
    pub tissue: Option<&'a TissueUnknown<'a, D>>,
    /// Tensions of all muscles of the body, N; unknown tensions are replaced.
    pub tensions: Vec<f64>,
    /// Muscles that have the tension of another, such as those of the right side that of the left: the
    /// other, and the muscle.
    pub tied: Vec<[usize; 2]>,
    /// An answer at which the first start begins, such as that of the frame before: its unknowns and
    /// positions of all nodes, m.
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

    /// Whether the observations leave directions undetermined and no prior determines them.
    pub(crate) fn is_undetermined(&self) -> bool {
        self.observations.len() + self.unknowns.iter().filter(|u| u.prior.is_some()).count()
            < self.unknowns.len()
    }

    /// Puts candidate values into the tensions of all muscles, N.
    pub(super) fn put_tensions(&self, x: &[f64], all: &mut [f64]) {
        for (unknown, value) in self.unknowns.iter().zip(x) {
            if let Quantity::Tension { muscle } = unknown.quantity {
                all[muscle] = value * unknown.unit;
            }
        }
        self.tied.iter().for_each(|&[of, muscle]| all[muscle] = all[of]);
    }

    /// Checks that unknowns, bones and observations are consistent.
    pub fn check(&self) -> Result<(), FitError> {
        let wrong = |what: String| Err(FitError::Unknown { what });
        if self.observations.is_empty() || self.unknowns.is_empty() {
            return wrong("a fit needs at least one observation and one unknown".to_owned());
        }
        for u in &self.unknowns {
            if !(u.lower.is_finite() && u.upper.is_finite() && u.lower < u.upper) {
                return wrong(format!(
                    "the bounds {} and {} of an unknown must be finite and in order",
                    u.lower * u.unit,
                    u.upper * u.unit
                ));
            }
            match u.quantity {
                Quantity::Tension { muscle } if !self.system.contracting().contains(&muscle) => {
                    return wrong(format!(
                        "muscle {muscle} is to be fitted, but does not contract in this system"
                    ));
                }
                Quantity::Bone { bone, axis } if bone >= self.bones.len() || axis >= D => {
                    return wrong(format!("bone {bone}, axis {axis} is to be fitted, but was not freed"));
                }
                Quantity::Constant(_) if self.tissue.is_none() => {
                    return wrong(
                        "a constant of the tissue is to be fitted, but no tissue was given for it".to_owned(),
                    );
                }
                _ => {}
            }
        }
        for end in [|u: &Unknown| u.lower, |u: &Unknown| u.upper] {
            let bounds: Vec<f64> = self.unknowns.iter().map(end).collect();
            let checked = self.tissue.map(|tissue| tissue.constants(&self.unknowns, &bounds).check());
            if let Some(Err(error)) = checked {
                return wrong(format!("a bound of an unknown: {error}"));
            }
        }
        match self.tied.iter().flatten().find(|m| !self.system.contracting().contains(*m)) {
            Some(muscle) => wrong(format!("muscle {muscle} is tied to another, but does not contract")),
            None => Ok(()),
        }
    }
}
