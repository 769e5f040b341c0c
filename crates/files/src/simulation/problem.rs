//! An inverse problem by name: the observations of a body, and the unknowns; and its result.

use nalgebra::SVector;
use serde_json::{Value, json};

use tongue_core::observe::Observation;
use tongue_infer::inverse::{
    Answer, Constant, FitSettings, LeastSquaresProblem, MovableBone, Prior, Quantity, TargetOnBody,
    TissueUnknown, Unknown,
};
use tongue_input::measured::Target;

use super::error::check_number;
use super::{Assembly, Shape, SimulationError};
use crate::report::{ByMuscle, SolutionCurveRecord};

#[derive(Debug, Clone, Default)]
pub struct Observations<const D: usize> {
    pub fitted: Vec<Observation<D>>,
    /// Other measurements. If the fitted observations leave a direction undetermined, these select one of the answers.
    pub others: Vec<Observation<D>>,
}

impl<const D: usize> From<Vec<Observation<D>>> for Observations<D> {
    fn from(fitted: Vec<Observation<D>>) -> Self {
        Self { fitted, others: Vec::new() }
    }
}

impl<const D: usize> Assembly<D> {
    /// The observations of this body for a target: its fitted muscles, and the other measured ones.
    pub fn observations(&self, target: &Target) -> Result<Observations<D>, SimulationError> {
        let matched = TargetOnBody::new(&self.body.mesh, target)?;
        let system = &self.system;
        let [fitted, others] = matched.observations(system, &system.lengths(system.rest()));
        Ok(Observations { fitted, others })
    }
}

/// The observations of a body and its unknowns, which at first are the tensions of all contracting muscles, from 0 to
/// [`FitSettings::upper_bound`].
///
/// Priors are weighed against observations by their standard deviations, so that with priors the observations need standard deviations too
/// ([`Observation::with_standard_deviation`]).
#[derive(Debug, Clone)]
pub struct InverseProblem<const D: usize> {
    pub settings: FitSettings,
    assembly: Assembly<D>,
    observations: Observations<D>,
    /// An infinite upper bound stands for that of the settings.
    unknowns: Vec<Unknown>,
    bone_names: Vec<String>,
    bones: Vec<MovableBone<D>>,
    tensions: Vec<f64>,
}

impl<const D: usize> InverseProblem<D> {
    /// The problem of finding the tensions of all contracting muscles from these observations.
    pub fn new(assembly: &Assembly<D>, observations: impl Into<Observations<D>>) -> Self {
        let unknowns =
            assembly.system.contracting().iter().map(|&muscle| Unknown::tension(muscle, f64::INFINITY));
        Self {
            settings: FitSettings::default(),
            assembly: assembly.clone(),
            observations: observations.into(),
            unknowns: unknowns.collect(),
            bone_names: Vec::new(),
            bones: Vec::new(),
            tensions: vec![0.0; assembly.system.muscle_count()],
        }
    }

    pub fn with_settings(self, settings: FitSettings) -> Self {
        Self { settings, ..self }
    }

    /// The problem with a known tension, N (2D: per metre of thickness).
    pub fn with_tension(mut self, muscle: &str, tension: f64) -> Result<Self, SimulationError> {
        let known = self.assembly.tensions(&[(muscle, tension)])?;
        for fibre in self.assembly.fibres(muscle)? {
            self.tensions[fibre] = known[fibre];
            self.unknowns.retain(|u| u.quantity != Quantity::Tension { muscle: fibre });
        }
        Ok(self)
    }

    /// The problem with other bounds of a tension, N (2D: per metre of thickness).
    pub fn with_bounds(mut self, muscle: &str, lower: f64, upper: f64) -> Result<Self, SimulationError> {
        let [low, high] = ["lower", "upper"].map(|end| format!("the {end} bound of {muscle}"));
        check_number(&low, lower, lower.is_finite() && lower >= 0.0, "finite and not negative")?;
        let is_above = upper.is_finite() && upper > lower;
        check_number(&high, upper, is_above, "finite and above the lower bound")?;
        let unknown = self.tension_of(muscle)?;
        (unknown.lower, unknown.upper) = (lower, upper);
        Ok(self)
    }

    /// The problem with a normal prior of a tension: its mean and standard deviation, N (2D: per metre of thickness).
    pub fn with_prior(mut self, muscle: &str, mean: f64, sd: f64) -> Result<Self, SimulationError> {
        check_number(&format!("the mean of the tension of {muscle}"), mean, mean.is_finite(), "finite")?;
        let weight = weight(muscle, sd)?;
        self.tension_of(muscle)?.prior = Some(Prior { mean, weight });
        Ok(self)
    }

    /// The problem with the displacement of a bone as an unknown, the same for all its nodes and at most `most` (m) in both directions of
    /// each axis.
    ///
    /// # Errors
    /// For an unknown name, with the nearest one, a bone given twice, a length that is not positive, and [`SimulationError::System`] if no
    /// other bone holds the body.
    pub fn free_bone(mut self, bone: &str, most: f64) -> Result<Self, SimulationError> {
        let nodes = self.assembly.bone(bone)?;
        check_number(&format!("the most that {bone} moves"), most, most.is_finite() && most > 0.0, POSITIVE)?;
        if self.bone_names.iter().any(|name| name == bone) {
            return Err(SimulationError::repeated_name(bone));
        }
        let (mesh, system) = (&self.assembly.body.mesh, &self.assembly.system);
        let freed = MovableBone::new(mesh, &self.assembly.model, system.contracting(), nodes)?;
        let number = self.bones.len();
        self.unknowns.extend((0..D).map(|axis| {
            let unknown = Unknown::bone(number, axis, 1.0);
            Unknown { lower: -most / unknown.unit, upper: most / unknown.unit, ..unknown }
        }));
        self.bones.push(freed);
        self.bone_names.push(bone.to_owned());
        Ok(self)
    }

    /// The problem with a normal prior of mean zero for the displacement of a free bone; `sd` is its standard deviation along each axis, m.
    pub fn with_bone_prior(mut self, bone: &str, sd: f64) -> Result<Self, SimulationError> {
        let weight = weight(bone, sd)?;
        let freed = self
            .bone_names
            .iter()
            .position(|name| name == bone)
            .ok_or_else(|| SimulationError::not_searched(bone, "free the bone first (free_bone)"))?;
        for unknown in &mut self.unknowns {
            if matches!(unknown.quantity, Quantity::Bone { bone, .. } if bone == freed) {
                unknown.prior = Some(Prior { mean: 0.0, weight: weight * unknown.unit });
            }
        }
        Ok(self)
    }

    /// The problem with Young's modulus as an unknown between these values, Pa. The last call decides.
    pub fn free_young_modulus(self, lower: f64, upper: f64) -> Self {
        self.with_constant(Unknown::young_modulus(lower / 100.0, upper / 100.0))
    }

    /// The problem with Poisson's ratio as an unknown between these values. The last call decides.
    pub fn free_poisson_ratio(self, lower: f64, upper: f64) -> Self {
        self.with_constant(Unknown::poisson_ratio(lower * 100.0, upper * 100.0))
    }

    fn with_constant(mut self, constant: Unknown) -> Self {
        self.unknowns.retain(|u| u.quantity != constant.quantity);
        self.unknowns.push(constant);
        self
    }

    fn tension_of(&mut self, muscle: &str) -> Result<&mut Unknown, SimulationError> {
        let fibre = self.assembly.pulling(muscle)?[0];
        self.unknowns
            .iter_mut()
            .find(|u| u.quantity == Quantity::Tension { muscle: fibre })
            .ok_or_else(|| SimulationError::not_searched(muscle, "its tension was given (with_tension)"))
    }

    /// Searches for the best fit of the observations. The result has the same bits for any number of threads.
    ///
    /// # Errors
    /// For a muscle with an unknown tension and several fibres; [`SimulationError::Fit`] for settings and bounds out of range, no
    /// observations or no unknowns. Later failures are a status of the estimate.
    pub fn fit(&self) -> Result<Estimate<D>, SimulationError> {
        let (assembly, system) = (&self.assembly, &self.assembly.system);
        for muscle in assembly.contracting() {
            let fibres = assembly.fibres(muscle)?;
            if fibres.len() > 1
                && self.unknowns.iter().any(|u| u.quantity == Quantity::Tension { muscle: fibres[0] })
            {
                let why = "a fit needs one line for each tension; give its tension (with_tension), or give the fibres different names";
                return Err(SimulationError::fibres(muscle, fibres.len(), why));
            }
        }
        let mut unknowns = self.unknowns.clone();
        for unknown in unknowns.iter_mut().filter(|u| u.is_tension() && u.upper == f64::INFINITY) {
            unknown.upper = self.settings.upper_bound;
        }
        let tissue = TissueUnknown {
            mesh: &assembly.body.mesh,
            model: assembly.model,
            contracting: system.contracting(),
        };
        let mut problem = LeastSquaresProblem::new(system, self.observations.fitted.clone(), unknowns);
        problem.others.clone_from(&self.observations.others);
        problem.bones = &self.bones;
        problem.tensions.clone_from(&self.tensions);
        if self.unknowns.iter().any(|u| matches!(u.quantity, Quantity::Constant(_))) {
            problem.tissue = Some(&tissue);
        }
        let answer = problem.solve(&self.settings)?;
        let (tensions, positions) = (answer.tensions.clone(), answer.positions.clone());
        let shape = Shape::new(assembly, answer.replay.trace.into(), tensions, positions);
        Ok(Estimate { answer, shape, problem: self.clone() })
    }
}

/// The values of the unknowns with the best fit of the observations.
#[derive(Debug, Clone)]
pub struct Estimate<const D: usize> {
    /// The answer with its misfit, the directions that the data leave undetermined, and the end points of all starts.
    pub answer: Answer<D>,
    pub shape: Shape<D>,
    problem: InverseProblem<D>,
}

impl<const D: usize> Estimate<D> {
    /// Values of the observables in that shape, in the order and units of the observations.
    pub fn simulated(&self) -> Vec<f64> {
        let all = self.problem.observations.fitted.iter();
        all.map(|o| o.observable.value(self.shape.positions())).collect()
    }

    pub fn measured(&self) -> Vec<f64> {
        self.problem.observations.fitted.iter().map(|o| o.measured).collect()
    }

    /// The tensions of all contracting muscles, as [`Solver::equilibrium`](super::Solver::equilibrium) takes them.
    pub fn tensions(&self) -> Vec<(&str, f64)> {
        let names = self.shape.assembly.contracting().into_iter();
        names.filter_map(|name| Some((name, self.shape.tension(name).ok()?))).collect()
    }

    pub fn displacement(&self, bone: &str) -> Result<SVector<f64, D>, SimulationError> {
        let what = "free the bone (InverseProblem::free_bone)";
        let number = self.problem.bone_names.iter().position(|b| b == bone);
        let number = number.ok_or_else(|| SimulationError::not_searched(bone, what))?;
        let mut shift = SVector::zeros();
        for (unknown, x) in self.problem.unknowns.iter().zip(&self.answer.x) {
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
        let mut values = self.problem.unknowns.iter().zip(&self.answer.x);
        let found = values.find(|(u, _)| u.quantity == Quantity::Constant(constant));
        found.map(|(unknown, x)| x * unknown.unit)
    }

    /// The curve of all answers that fit as well, if exactly one direction is undetermined.
    pub fn solution_curve(&self) -> Option<SolutionCurveRecord<'_>> {
        let curve = self.answer.solution_curve()?;
        let muscles = &self.shape.assembly.body.mesh.muscles;
        let unknowns: Vec<String> = Vec::from_iter(self.problem.unknowns.iter().map(|u| match u.quantity {
            Quantity::Tension { muscle } => muscles[muscle].name.clone(),
            Quantity::Bone { bone, axis } => {
                format!("{}_{}_mm", self.problem.bone_names[bone], ["x", "y", "z"][axis % 3])
            }
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
            "active": self.shape.assembly.contracting(),
            "misfit": self.answer.misfit,
            "simulated": self.simulated(),
            "measured": self.measured(),
            "displacements_mm": ByMuscle(self.problem.bone_names.iter().filter_map(|name| {
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

const POSITIVE: &str = "positive and finite";

fn weight(name: &str, sd: f64) -> Result<f64, SimulationError> {
    let what = format!("the standard deviation of {name}");
    check_number(&what, sd, sd.is_finite() && sd > 0.0, POSITIVE)?;
    Ok(1.0 / sd)
}
