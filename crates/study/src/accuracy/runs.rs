//! A run of a method, and how it ended.

use serde::{Serialize, Serializer};

use tongue_core::dynamics::StepCounts;
use tongue_core::statics::SolveStatus;

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Ended {
    #[default]
    Done,
    /// The method stopped before its tolerance; its last state is measured.
    Short(String),
    Failed(String),
    /// Not started or not finished, because the run would take too long or cannot work.
    Refused(String),
}

impl Ended {
    pub fn words(&self) -> String {
        match self {
            Self::Done => "done".into(),
            Self::Short(why) => format!("stopped short: {why}"),
            Self::Failed(why) => format!("failed: {why}"),
            Self::Refused(why) => format!("refused: {why}"),
        }
    }
}

impl From<SolveStatus> for Ended {
    fn from(status: SolveStatus) -> Self {
        Self::Short(match status {
            SolveStatus::Converged => return Self::Done,
            SolveStatus::IterationLimit => "iteration limit".into(),
            SolveStatus::Stalled => "rounding stops the descent before the force tolerance is reached".into(),
            SolveStatus::Inverted => "a cell is inverted".into(),
            SolveStatus::Unstable => "an unstable equilibrium".into(),
            SolveStatus::NotFinite => "a number is not finite".into(),
        })
    }
}

impl Serialize for Ended {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.words())
    }
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
    pub ended: Ended,
}

impl Run {
    /// Sets the errors (of a position, mm, and of a ratio), the median time (s) with the number of repeats, and the cost.
    pub fn with_measurements(
        self,
        errors: (f64, f64),
        (seconds, repeats): (f64, usize),
        counts: StepCounts,
    ) -> Self {
        Self {
            error_mm: Some(errors.0),
            ratio_error: Some(errors.1),
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
    good.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(.., run)| run)
}
