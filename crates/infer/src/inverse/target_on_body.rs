//! A target with its muscles found in a body, and its inverse problem.

use tongue_core::body::Mesh;
use tongue_core::observe::{Length, Observation, Ratio, Stretch};
use tongue_core::system::System;
use tongue_input::measured::{Target, TargetKind};

use super::problem::{LeastSquaresProblem, Unknown};
use super::{FitError, FitSettings};

/// A target and where its muscles are in a body.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetOnBody {
    /// The target, without measured muscles that the body lacks.
    pub target: Target,
    /// Names of the body's muscles: those of the target in its order, then the others, each once.
    pub muscles: Vec<String>,
    /// Number of each in the body; of several chains with one name the first.
    pub numbers: Vec<usize>,
}

impl TargetOnBody {
    /// Finds the muscles of a target in a body.
    pub fn new<const D: usize>(mesh: &Mesh<D>, target: &Target) -> Result<Self, FitError> {
        let number = |name: &str| mesh.muscles.iter().position(|m| m.name.eq_ignore_ascii_case(name));
        let target = target
            .of_body(|name: &str| number(name).is_some())
            .map_err(|muscle| FitError::MissingMuscle { muscle })?;
        let mut muscles = target.muscles.clone();
        for chain in &mesh.muscles {
            if !muscles.iter().any(|m| m.eq_ignore_ascii_case(&chain.name)) {
                muscles.push(chain.name.clone());
            }
        }
        let numbers = muscles.iter().filter_map(|m| number(m)).collect();
        Ok(Self { target, muscles, numbers })
    }

    /// Numbers of the contracting muscles in the body.
    pub fn contracting(&self) -> Vec<usize> {
        self.target.active.iter().map(|&m| self.numbers[m]).collect()
    }

    /// Observations of fitted and of other measured muscles; stretches are counted from `baseline` (lengths of the body's chains, m).
    pub fn observations<const D: usize>(
        &self,
        system: &System<D>,
        baseline: &[f64],
    ) -> [Vec<Observation<D>>; 2] {
        let target = &self.target;
        let length = |m: usize| Length::new(system.muscle_ends(self.numbers[m]));
        let observation = |m: usize| match target.kind {
            TargetKind::Ratio => {
                Observation::new(Ratio::new(length(m), length(target.reference)), target.values[m])
            }
            TargetKind::Stretch => {
                Observation::new(Stretch::new(length(m), baseline[self.numbers[m]]), target.values[m])
            }
        };
        let others = target.comparable(target.kind).filter(|m| !target.fitted.contains(m));
        [target.fitted.iter().copied().map(observation).collect(), others.map(observation).collect()]
    }

    /// The inverse problem of the target, whose baseline is rest; its active muscles must be able to contract in `system`.
    pub fn problem<'a, const D: usize>(
        &self,
        system: &'a System<D>,
        settings: &FitSettings,
    ) -> LeastSquaresProblem<'a, D> {
        let [observations, others] = self.observations(system, &system.lengths(system.rest()));
        let unknowns = self.contracting().into_iter().map(|m| Unknown::tension(m, settings.upper_bound));
        LeastSquaresProblem { others, ..LeastSquaresProblem::new(system, observations, unknowns.collect()) }
    }

    /// Selects the values of this target's muscles from those of all muscles of the body.
    pub fn pick(&self, of_body: &[f64]) -> Vec<f64> {
        self.numbers.iter().map(|&n| of_body[n]).collect()
    }
}
