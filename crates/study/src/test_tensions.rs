//! Bodies with given tensions (equilibrium, motion, ratios, distances between shapes), and targets of the built-in table.

use nalgebra::SVector;

use tongue_core::body::{Body, DEFAULT_SPACING_M, Mesh, largest_distance};
use tongue_core::dynamics::{Motion, Tensions};
use tongue_core::effect::Incompressibility;
use tongue_core::statics::{self, Solution, SolveSettings, Workspace};
use tongue_core::system::{Additions, Model, System, SystemError};
use tongue_infer::inverse::FitError;
use tongue_input::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel, reference_muscle};

use crate::Error;

/// Tensions published for /a/ (thesis 4.4.1), N per metre of thickness.
pub const PUBLISHED_A: [(&str, f64); 3] = [("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)];

/// kappa_s as printed in table 4.2, J per metre of thickness.
const PRINTED_KAPPA: f64 = 1.46e3;

#[derive(Debug)]
pub struct TestTensions {
    /// The muscles with tension contract.
    pub system: System<2>,
    /// Tensions of all muscles of the mesh, N per metre of thickness.
    pub tensions: Vec<f64>,
    pub muscles: Vec<String>,
}

impl TestTensions {
    pub fn new(mesh: &Mesh<2>, model: &Model, pull: &[(&str, f64)]) -> Result<Self, Error> {
        Self::with_additions(mesh, model, pull, Additions::default())
    }

    /// The reference tongue with kappa_s as printed in table 4.2, which is a thousand times too large.
    pub fn as_printed(mesh: &Mesh<2>) -> Result<Self, Error> {
        let area = Incompressibility::new(PRINTED_KAPPA, &mesh.cells, &mesh.nodes);
        let additions =
            Additions { effects: vec![Box::new(area)], incompressible: false, ..Additions::default() };
        Self::with_additions(mesh, &Model::default(), &PUBLISHED_A, additions)
    }

    fn with_additions(
        mesh: &Mesh<2>,
        model: &Model,
        pull: &[(&str, f64)],
        additions: Additions<2>,
    ) -> Result<Self, Error> {
        let muscles = mesh.muscle_names();
        let mut tensions = vec![0.0; muscles.len()];
        let mut contracting = Vec::with_capacity(pull.len());
        for (name, tension) in pull {
            let number = muscles.iter().position(|m| m == name);
            let number = number.ok_or_else(|| FitError::MissingMuscle { muscle: (*name).to_owned() })?;
            tensions[number] = *tension;
            contracting.push(number);
        }
        Ok(Self { system: System::with_additions(mesh, model, &contracting, additions)?, tensions, muscles })
    }

    /// The motion from rest with the tensions applied at once.
    pub fn motion(&self) -> Result<Motion<'_, 2>, SystemError> {
        Motion::new(&self.system, Tensions::constant(self.tensions.clone()))
    }

    /// The equilibrium when only rounding stops Newton's method, and its residual force, N.
    pub fn reference(&self) -> Result<(Vec<SVector<f64, 2>>, f64), Error> {
        let mut workspace = Workspace::new(&self.system);
        let usual = SolveSettings::default();
        let settings =
            SolveSettings { tolerance: 0.0, max_iterations: 100, load_steps: 0, most_solves: 0, ..usual };
        let solution = statics::solve(&self.system, &mut workspace, &self.tensions, &settings);
        let force = solution.max_residual_force;
        if force.is_nan() || force > usual.tolerance {
            return Err(format!(
                "the residual force of the reference equilibrium is {force:e} N, which is too large to measure errors against"
            )
            .into());
        }
        Ok((workspace.positions().to_vec(), force))
    }

    pub fn solve(&self, workspace: &mut Workspace<2>, tolerance: f64) -> Solution {
        workspace.start_from_rest(&self.system);
        let settings = SolveSettings { tolerance, ..SolveSettings::default() };
        statics::solve(&self.system, workspace, &self.tensions, &settings)
    }

    /// Ratio of every muscle's length to that of GGa.
    pub fn ratios(&self, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let rest = self.system.lengths(self.system.rest());
        let reference = reference_muscle(&self.muscles);
        TargetKind::Ratio.values(&self.system.lengths(positions), &rest, reference)
    }

    /// Largest distance of a node between two shapes, mm, and largest difference of a ratio.
    pub fn differences(&self, a: &[SVector<f64, 2>], b: &[SVector<f64, 2>]) -> (f64, f64) {
        (1e3 * largest_distance(a, b), largest_difference(&self.ratios(a), &self.ratios(b)))
    }
}

pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub fn tongue() -> Result<Mesh<2>, Error> {
    Ok(Body::tongue(DEFAULT_SPACING_M)?.mesh)
}

/// The target of a row of the built-in table. The active muscles are `muscles` or, if this list is empty, those that contract.
pub fn target(subject: &str, vowel: &str, kind: TargetKind, muscles: &[&str]) -> Result<Target, Error> {
    let names = muscles.iter().map(|m| (*m).to_owned()).collect();
    let options =
        TargetOptions { muscles: (!muscles.is_empty()).then_some(names), ..TargetOptions::default() };
    Ok(Target::new(&Dataset::reference()?, subject, &vowel.parse::<Vowel>()?, kind, &options)?)
}

pub fn with_poisson_ratio(poisson_ratio: f64) -> Model {
    Model { poisson_ratio, ..Model::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tongue_input::measured::thesis::Thesis;

    #[test]
    fn the_published_tensions_are_those_of_the_table() {
        assert_eq!(Thesis::reference().tensions_a(), PUBLISHED_A);
    }
}
