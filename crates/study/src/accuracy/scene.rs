//! Measurements on a body under load: its equilibrium, its ratios, and the distance between shapes.

use nalgebra::SVector;

use crate::{Error, Pulled};
use tongue_core::statics::{self, Solution, SolveSettings, SolveStatus, Workspace};
use tongue_input::measured::{TargetKind, reference_muscle};

/// Settings of the reference: Newton's method until rounding stops it.
const TO_THE_END: SolveSettings = SolveSettings {
    tolerance: 0.0,
    max_iterations: 100,
    load_steps: 0,
    certify: false,
    most_solves: 0,
    beyond: true,
};

impl Pulled {
    /// The equilibrium of Newton's method when only rounding stops it, and its residual force, N.
    pub fn reference(&self) -> Result<(Vec<SVector<f64, 2>>, f64), Error> {
        let mut workspace = Workspace::new(&self.system);
        let solution = statics::solve(&self.system, &mut workspace, &self.tensions, &TO_THE_END);
        if solution.max_residual_force.is_nan()
            || solution.max_residual_force > SolveSettings::default().tolerance
        {
            let force = solution.max_residual_force;
            return Err(format!(
                "the reference equilibrium leaves {force:e} N, too much to measure errors against"
            )
            .into());
        }
        Ok((workspace.positions().to_vec(), solution.max_residual_force))
    }

    /// One equilibrium from rest.
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

    /// Largest distance of an unknown node between two shapes, mm, and largest difference of a ratio.
    pub fn apart(&self, a: &[SVector<f64, 2>], b: &[SVector<f64, 2>]) -> (f64, f64) {
        let nodes = self.system.pattern().nodes();
        let distance = nodes.iter().map(|&n| (a[n] - b[n]).norm()).fold(0.0, f64::max);
        (1e3 * distance, largest_difference(&self.ratios(a), &self.ratios(b)))
    }
}

/// Largest absolute difference of two sets of ratios.
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Why a solve stopped before its tolerance, if it did.
pub fn shortfall(status: SolveStatus) -> Option<&'static str> {
    match status {
        SolveStatus::Converged => None,
        SolveStatus::IterationLimit => Some("iteration limit"),
        SolveStatus::Stalled => Some("rounding stops the descent before the force tolerance is reached"),
        SolveStatus::Inverted => Some("a cell is inverted"),
        SolveStatus::Unstable => Some("an unstable equilibrium"),
        SolveStatus::NotFinite => Some("a number is not finite"),
    }
}
