//! The body that every axis measures: the tongue at the tensions published for /a/.

use nalgebra::SVector;

use crate::body::{Anatomy, Mesh, build};
use crate::measured::{TargetKind, reference_muscle};
use crate::statics::{self, Settings, Solution, Status, Workspace};
use crate::study::pulling;
use crate::system::{Model, System};

use super::StudyError;

/// Newton iterations for a reference: it goes on until rounding stops it.
const TO_THE_END: Settings =
    Settings { tolerance: 0.0, max_iterations: 100, load_steps: 0, certify: false, most_solves: 0 };

/// A system at given tensions.
#[derive(Debug)]
pub struct Scene {
    /// The body.
    pub system: System<2>,
    /// Tensions of all muscles of the mesh, N.
    pub tensions: Vec<f64>,
    /// Number of the muscle that ratios are over.
    reference: usize,
}

impl Scene {
    /// `mesh` with some of its muscles pulling, N.
    ///
    /// # Errors
    /// [`StudyError`] where the model cannot be made.
    pub fn new(mesh: &Mesh<2>, model: &Model, pull: &[(&str, f64)]) -> Result<Self, StudyError> {
        let (contracting, tensions) = pulling(mesh, pull)?;
        let system = System::new(mesh, model, &contracting)?;
        Ok(Self { system, tensions, reference: reference_muscle(&mesh.muscle_names()) })
    }

    /// Where Newton's method ends when only rounding stops it, and the force left there, N.
    ///
    /// # Errors
    /// [`StudyError::Reference`] where that is no equilibrium.
    pub fn reference(&self) -> Result<(Vec<SVector<f64, 2>>, f64), StudyError> {
        let mut workspace = Workspace::new(&self.system);
        let solution = statics::solve(&self.system, &mut workspace, &self.tensions, &TO_THE_END);
        if solution.max_residual_force.is_nan() || solution.max_residual_force > Settings::default().tolerance
        {
            return Err(StudyError::Reference(solution.max_residual_force));
        }
        Ok((workspace.positions().to_vec(), solution.max_residual_force))
    }

    /// One equilibrium from rest.
    pub fn solve(&self, workspace: &mut Workspace<2>, tolerance: f64) -> Solution {
        workspace.start_from_rest(&self.system);
        let settings = Settings { tolerance, ..Settings::default() };
        statics::solve(&self.system, workspace, &self.tensions, &settings)
    }

    /// Ratio of every muscle's length to that of GGa.
    pub fn ratios(&self, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let rest = self.system.lengths(self.system.rest());
        TargetKind::Ratio.values(&self.system.lengths(positions), &rest, self.reference)
    }

    /// Largest distance of an unknown node between two shapes, mm.
    pub fn distance_mm(&self, a: &[SVector<f64, 2>], b: &[SVector<f64, 2>]) -> f64 {
        let nodes = self.system.pattern().nodes();
        1e3 * nodes.iter().map(|&n| (a[n] - b[n]).norm()).fold(0.0, f64::max)
    }

    /// Largest difference of a muscle's ratio between two shapes.
    pub fn ratio_difference(&self, a: &[SVector<f64, 2>], b: &[SVector<f64, 2>]) -> f64 {
        largest_difference(&self.ratios(a), &self.ratios(b))
    }
}

/// Largest absolute difference of two sets of ratios.
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The reference mesh at a spacing, m.
///
/// # Errors
/// [`StudyError`] where the anatomy cannot be meshed so.
pub fn mesh(spacing: f64) -> Result<Mesh<2>, StudyError> {
    Ok(build(&Anatomy::reference()?, spacing)?)
}

/// Why a solve did not end at its tolerance, if it did not.
pub fn shortfall(status: Status) -> Option<&'static str> {
    match status {
        Status::Converged => None,
        Status::IterationLimit => Some("iteration limit"),
        Status::Stalled => Some("rounding stops the descent before the force tolerance"),
        Status::Inverted => Some("a cell is turned over"),
        Status::Unstable => Some("an unstable equilibrium"),
        Status::NotFinite => Some("a number is not finite"),
    }
}
