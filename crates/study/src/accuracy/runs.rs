//! A run of a method, and how it ended.

use serde::Serialize;

use tongue_core::dynamics::StepCounts;
use tongue_core::statics::SolveStatus;
use tongue_core::statistics::least_by;

/// How a run ended that reached its tolerance.
pub const DONE: &str = "done";

/// How a solve ended, in words. If it stopped before its tolerance, its last state is measured.
pub fn ending(status: SolveStatus) -> String {
    let why = match status {
        SolveStatus::Converged => return DONE.to_owned(),
        SolveStatus::IterationLimit => "iteration limit",
        SolveStatus::Stalled => "rounding stops the descent before the force tolerance is reached",
        SolveStatus::Inverted => "a cell is inverted",
        SolveStatus::Unstable => "an unstable equilibrium",
        SolveStatus::NotFinite => "a number is not finite",
    };
    format!("stopped short: {why}")
}

/// A run of a method: a point in the diagram of time against accuracy.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Run {
    pub method: &'static str,
    pub setting: String,
    /// Largest distance of a node from its position in the reference, mm.
    pub error_mm: Option<f64>,
    /// Largest difference of a muscle's ratio to GGa.
    pub ratio_error: Option<f64>,
    /// Median wall-clock time, s.
    pub seconds: Option<f64>,
    pub repeats: usize,
    pub steps: u64,
    /// Evaluations of the force; in Newton's method, of the energy.
    pub force_evaluations: u64,
    pub factorisations: u64,
    /// `done`, or whether and why it stopped short, failed or was refused.
    pub ended: String,
}

impl Run {
    /// Sets the errors (of a position, mm, and of a ratio), the median time (s) with the number of repeats, and the cost.
    pub fn with_measurements(
        self,
        (error_mm, ratio_error): (f64, f64),
        (seconds, repeats): (f64, usize),
        counts: StepCounts,
    ) -> Self {
        Self {
            error_mm: Some(error_mm),
            ratio_error: Some(ratio_error),
            seconds: Some(seconds),
            repeats,
            steps: counts.steps,
            force_evaluations: counts.force_evaluations,
            factorisations: counts.factorisations,
            ..self
        }
    }
}

pub fn fastest<'a>(
    runs: impl IntoIterator<Item = &'a Run>,
    error: fn(&Run) -> Option<f64>,
    most: f64,
) -> Option<&'a Run> {
    let timed = runs.into_iter().filter_map(|run| Some((run.seconds?, error(run)?, run)));
    let good = timed.filter(|(_, error, _)| *error <= most);
    least_by(good, |(seconds, ..)| *seconds).map(|(.., run)| run)
}
