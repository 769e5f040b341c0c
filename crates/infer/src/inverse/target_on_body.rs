//! A target beside the muscles of a body, and the inverse problem that it states.

use tongue_core::body::Mesh;
use tongue_core::observe::{Length, Observation, Ratio, Stretch};
use tongue_core::system::System;
use tongue_input::measured::{Target, TargetKind};

use super::problem::{LeastSquaresProblem, Unknown};
use super::{FitError, FitSettings};

/// A target and the muscles of a body that it is about.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetOnBody {
    /// The target, without measured muscles that the body lacks.
    pub target: Target,
    /// Names of the body's muscles: those of the target in its order, then the others, each once.
    pub muscles: Vec<String>,
    /// The number of each in the body; for several chains of one name the first.
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

    /// The observations of the muscles at these positions in the target, with changes from the lengths
    /// `baseline` (of all chains of the body, m).
    fn observations_of<const D: usize>(
        &self,
        system: &System<D>,
        baseline: &[f64],
        muscles: impl IntoIterator<Item = usize>,
    ) -> Vec<Observation<D>> {
        let target = &self.target;
        let length = |m: usize| Length::new(system.muscle_ends(self.numbers[m]));
        let seen = muscles.into_iter().map(|m| match target.kind {
            TargetKind::Ratio => {
                Observation::new(Ratio::new(length(m), length(target.reference)), target.values[m])
            }
            TargetKind::Stretch => {
                Observation::new(Stretch::new(length(m), baseline[self.numbers[m]]), target.values[m])
            }
        });
        seen.collect()
    }

    /// An observation for every fitted muscle, and one for every other measured muscle, with changes from the
    /// lengths `baseline` (of all chains of the body, m).
    pub fn observations<const D: usize>(
        &self,
        system: &System<D>,
        baseline: &[f64],
    ) -> [Vec<Observation<D>>; 2] {
        let fitted = self.target.fitted.iter().copied();
        let others = self.target.compared().filter(|m| !self.target.fitted.contains(m));
        [self.observations_of(system, baseline, fitted), self.observations_of(system, baseline, others)]
    }

    /// The inverse problem of the target for a body in which its active muscles can contract; its baseline is rest.
    pub fn inverse<'a, const D: usize>(
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
