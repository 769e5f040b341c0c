//! The result of an inverse problem, by name.

use nalgebra::SVector;
use serde_json::{Value, json};

use crate::report::{ByMuscle, SolutionCurveRecord};
use tongue_core::observe::Observation;
use tongue_infer::inverse::{Answer, Constant, Quantity, Unknown};

use super::{Assembly, Shape, SimulationError};

/// The values of the unknowns with the best fit of the observations.
#[derive(Debug, Clone)]
pub struct Estimate<const D: usize> {
    /// The answer with its misfit, the directions that the data leave undetermined, and the end points of all starts.
    pub answer: Answer<D>,
    pub shape: Shape<D>,
    /// Values of the observables in that shape, in the order and units of the observations.
    pub simulated: Vec<f64>,
    pub measured: Vec<f64>,
    unknowns: Vec<Unknown>,
    bones: Vec<String>,
}

impl<const D: usize> Estimate<D> {
    pub(super) fn new(
        assembly: &Assembly<D>,
        answer: Answer<D>,
        unknowns: Vec<Unknown>,
        bones: Vec<String>,
        observations: &[Observation<D>],
    ) -> Self {
        let (tensions, positions) = (answer.tensions.clone(), answer.positions.clone());
        Self {
            simulated: observations.iter().map(|o| o.observable.value(&positions)).collect(),
            measured: observations.iter().map(|o| o.measured).collect(),
            shape: Shape::new(assembly, answer.replay.solution.into(), tensions, positions),
            answer,
            unknowns,
            bones,
        }
    }

    /// The tensions of all contracting muscles, as [`Solver::equilibrium`](super::Solver::equilibrium) takes them.
    pub fn tensions(&self) -> Vec<(&str, f64)> {
        let names = self.shape.assembly().contracting().into_iter();
        names.filter_map(|name| Some((name, self.shape.tension(name).ok()?))).collect()
    }

    pub fn displacement(&self, bone: &str) -> Result<SVector<f64, D>, SimulationError> {
        let what = "free the bone (InverseProblem::free_bone)";
        let number = self.bones.iter().position(|b| b == bone);
        let number = number.ok_or_else(|| SimulationError::not_searched(bone, what))?;
        let mut shift = SVector::zeros();
        for (unknown, x) in self.unknowns.iter().zip(&self.answer.x) {
            if let Quantity::Bone { bone, axis } = unknown.quantity
                && bone == number
            {
                shift[axis] = x * unknown.unit;
            }
        }
        Ok(shift)
    }

    /// The value of a constant that was searched for.
    pub fn constant(&self, constant: Constant) -> Option<f64> {
        let mut values = self.unknowns.iter().zip(&self.answer.x);
        let found = values.find(|(u, _)| u.quantity == Quantity::Constant(constant));
        found.map(|(unknown, x)| x * unknown.unit)
    }

    /// The curve of all answers that fit as well, if exactly one direction is undetermined.
    pub fn solution_curve(&self) -> Option<SolutionCurveRecord<'_>> {
        let curve = self.answer.solution_curve()?;
        let muscles = &self.shape.assembly().body().mesh.muscles;
        let unknowns: Vec<String> = Vec::from_iter(self.unknowns.iter().map(|u| match u.quantity {
            Quantity::Tension { muscle } => muscles[muscle].name.clone(),
            Quantity::Bone { bone, axis } => format!("{}_{}_mm", self.bones[bone], ["x", "y", "z"][axis % 3]),
            Quantity::Constant(Constant::YoungModulus) => "young_modulus_100_pa".to_owned(),
            Quantity::Constant(Constant::PoissonRatio) => "poisson_ratio_percent".to_owned(),
        }));
        let muscles = muscles.iter().enumerate().map(|(number, muscle)| (muscle.name.clone(), number));
        Some(SolutionCurveRecord { curve, unknowns, muscles: muscles.collect() })
    }

    /// Values are in the order and units of the observations; singular values are those of d(residual)/d(unknown in its unit), descending.
    pub fn record(&self) -> Value {
        json!({
            "status": self.answer.status,
            "active": self.shape.assembly().contracting(),
            "misfit": self.answer.misfit,
            "simulated": self.simulated,
            "measured": self.measured,
            "displacements_mm": ByMuscle(self.bones.iter().filter_map(|name| {
            let shift = self.displacement(name).ok()?;
            Some((name.clone(), shift.iter().map(|x| x * 1e3).collect::<Vec<_>>()))
        }).collect()),
            "young_modulus_pa": self.constant(Constant::YoungModulus),
            "poisson_ratio": self.constant(Constant::PoissonRatio),
            "evaluations": self.answer.counts.evaluations,
            "singular_values": self.answer.identifiability.as_ref().map(|i| &i.singular_values),
            "undetermined": self.answer.undetermined(),
            "valley": self.solution_curve(),
            "shape": self.shape.record(),
        })
    }
}
