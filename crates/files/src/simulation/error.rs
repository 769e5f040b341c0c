//! Errors of names and numbers.

use tongue_core::body::BodyError;
use tongue_core::dynamics::MotionError;
use tongue_core::system::SystemError;
use tongue_infer::inverse::FitError;

/// Why something cannot begin. Later failures are a status of the result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error(transparent)]
    Motion(#[from] MotionError),
}

impl SimulationError {
    pub(super) fn repeated(name: &str) -> Self {
        Self::Refused(format!("{name} is given twice; give each name once"))
    }

    pub(super) fn not_searched(name: &str, what: &str) -> Self {
        Self::Refused(format!("{name} is not searched for; {what}"))
    }

    pub(super) fn fibres(muscle: &str, fibres: usize, why: &str) -> Self {
        Self::Refused(format!("{muscle} has {fibres} fibres; {why}"))
    }
}

/// `value` if it is `good`.
pub(super) fn checked(name: &str, value: f64, good: bool, must: &str) -> Result<f64, SimulationError> {
    let refused = || SimulationError::Refused(format!("{name} is {value}; it must be {must}"));
    good.then_some(value).ok_or_else(refused)
}

pub fn check_tension(muscle: &str, tension: f64) -> Result<(), SimulationError> {
    let good = tension.is_finite() && tension >= 0.0;
    let must = "finite and not negative: muscles pull, they do not push";
    checked(&format!("the tension of {muscle}"), tension, good, must).map(|_| ())
}
