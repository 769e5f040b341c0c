//! A target beside the muscles of a body, and the inverse problem that it states.

use tongue_core::body::Mesh;
use tongue_core::observe::{Length, Observation, Ratio, Sense, Stretch};
use tongue_core::system::System;
use tongue_input::measured::{Target, TargetKind};

use super::premises::{MOST_SDS, STRETCH_SD, Setup};
use super::statement::Inverse;
use super::unknown::{Quantity, Unknown};
use super::{FitError, FitSettings};

/// A target and the muscles of a body that it is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// The target, without measured muscles that the body lacks.
    pub target: Target,
    /// Names of the body's muscles: those of the target in its order, then the others, each once.
    pub muscles: Vec<String>,
    /// The number of each in the body; for several chains of one name the first.
    pub numbers: Vec<usize>,
}

impl Matched {
    /// Finds the muscles of a target in a body.
    pub fn new<const D: usize>(mesh: &Mesh<D>, target: &Target) -> Result<Self, FitError> {
        let number = |name: &str| mesh.muscles.iter().position(|m| m.name.eq_ignore_ascii_case(name));
        let has = |name: &str| number(name).is_some();
        let target = target.of_body(has).map_err(|muscle| FitError::MissingMuscle { muscle })?;
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
        let seen = muscles.into_iter().map(|m| {
            let (low, high) = target.rounding_range(m);
            let observation = match target.kind {
                TargetKind::Ratio => {
                    Observation::new(Ratio::new(length(m), length(target.reference)), target.values[m])
                }
                TargetKind::Stretch => {
                    Observation::new(Stretch::new(length(m), baseline[self.numbers[m]]), target.values[m])
                }
            };
            observation.between(low, high)
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

    /// The inverse problem of the target for a body in which its active muscles can contract.
    pub fn inverse<'a, const D: usize>(&self, setup: &'a Setup<D>, settings: &FitSettings) -> Inverse<'a, D> {
        let (system, target) = (&setup.system, &self.target);
        let [observations, others] = self.observations(system, &setup.lengths);
        let unknowns = self.contracting().into_iter().map(|m| Unknown::tension(m, settings.upper_bound));
        let mut inverse = Inverse { others, ..Inverse::new(system, observations, unknowns.collect()) };
        // A measured muscle that does not contract has no tension; an unmeasured muscle keeps the tension of
        // the baseline.
        inverse.tensions.clone_from(&setup.tensions);
        let measured = |name: &str| target.muscles.iter().any(|m| m.eq_ignore_ascii_case(name));
        for (chain, name) in setup.muscles.iter().enumerate() {
            if measured(name) {
                inverse.tensions[chain] = 0.0;
            }
        }
        if !setup.bones.is_empty() {
            self.free_bones(setup, &mut inverse);
        }
        inverse
    }

    /// Adds displacements of the free bones, the signs of the changes of muscles that do not contract, and
    /// priors.
    fn free_bones<'a, const D: usize>(&self, setup: &'a Setup<D>, inverse: &mut Inverse<'a, D>) {
        let (premises, target) = (&setup.premises, &self.target);
        for unknown in &mut inverse.unknowns {
            if let Quantity::Tension { muscle } = unknown.quantity {
                *unknown = unknown.with_prior(setup.tensions[muscle], STRETCH_SD / premises.tension_sd);
            }
        }
        for (number, bone) in premises.bones.iter().enumerate() {
            inverse.unknowns.extend(bone.axes.iter().map(|&axis| {
                let unknown = Unknown::bone(number, axis, 1.0);
                let [most, sd] =
                    [MOST_SDS * premises.bone_sd_m, premises.bone_sd_m].map(|m| m / unknown.unit);
                Unknown { lower: -most, upper: most, ..unknown.with_prior(0.0, STRETCH_SD / sd) }
            }));
        }
        inverse.bones = &setup.bones;
        let lengthened = |m: &usize| !target.active.contains(m) && !target.activation[*m].contracting;
        inverse.signs = (0..target.muscles.len())
            .filter(lengthened)
            .map(|m| {
                let number = self.numbers[m];
                let length = Length::new(setup.system.muscle_ends(number));
                let stretch = Stretch::new(length, setup.lengths[number]);
                Observation { sense: Sense::AtLeast, ..Observation::new(stretch, 1.0) }
            })
            .collect();
    }

    /// Selects the values of this target's muscles from those of all muscles of the body.
    pub fn pick(&self, of_body: &[f64]) -> Vec<f64> {
        self.numbers.iter().map(|&n| of_body[n]).collect()
    }
}
