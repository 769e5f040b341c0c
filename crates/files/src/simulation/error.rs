//! Errors of names and numbers, and tensions as text (`GGa=12`).

use std::fmt::Display;

use tongue_core::body::{Body, BodyError};
use tongue_core::limits::{self, BeyondLimit};
use tongue_core::system::SystemError;
use tongue_infer::acoustics::VocalTractError;
use tongue_infer::adapt::RestError;
use tongue_infer::inverse::FitError;
use tongue_infer::posterior::PosteriorError;
use tongue_input::measured::ReadError;

/// Why a run cannot begin. Later failures are a status of the result.
#[derive(Debug, thiserror::Error)]
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
    Limit(#[from] BeyondLimit),
    #[error(transparent)]
    Target(#[from] ReadError),
    /// The body cannot be placed, or its shape cannot be varied.
    #[error(transparent)]
    Rest(#[from] RestError),
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
    #[error("[tract]: {0}")]
    VocalTract(#[from] VocalTractError),
}

impl SimulationError {
    pub(crate) fn contradiction(first: impl Display, second: impl Display, why: impl Display) -> Self {
        Self::Refused(format!("{first} contradicts {second}: {why}"))
    }

    pub(crate) fn value(key: &str, value: f64, must: &str) -> Self {
        Self::Refused(format!("{key} is {value}; it must be {must}"))
    }

    pub(crate) fn in_surgery(self) -> Self {
        Self::Refused(format!("[surgery]: {self}"))
    }

    pub(super) fn repeated_name(name: &str) -> Self {
        Self::Refused(format!("{name} is given twice; give each name once"))
    }

    pub(super) fn not_searched(name: &str, what: &str) -> Self {
        Self::Refused(format!("{name} is not searched for; {what}"))
    }

    pub(super) fn fibres(muscle: &str, fibres: usize, why: &str) -> Self {
        Self::Refused(format!("{muscle} has {fibres} fibres; {why}"))
    }
}

/// Checks a number; where it is not `good`, the error says what it must be.
pub(super) fn check_number(name: &str, value: f64, good: bool, must: &str) -> Result<(), SimulationError> {
    if good { Ok(()) } else { Err(SimulationError::value(name, value, must)) }
}

pub fn check_tension(muscle: &str, tension: f64) -> Result<(), SimulationError> {
    let good = tension.is_finite() && tension >= 0.0;
    let must = "finite and not negative: muscles pull, they do not push";
    check_number(&format!("the tension of {muscle}"), tension, good, must)
}

/// Reads texts such as `GGa=12` as indices of the body's muscles and their tensions, N (2D: per metre of thickness).
pub fn read_tensions<const D: usize>(
    words: &[String],
    body: &Body<D>,
) -> Result<Vec<(usize, f64)>, SimulationError> {
    let mut out: Vec<(usize, f64)> = Vec::new();
    for word in words {
        let bad = |why: String| SimulationError::Refused(format!("{word}: {why}"));
        let (name, value) =
            word.split_once('=').ok_or_else(|| bad("write MUSCLE=NEWTONS, like GGa=12".to_owned()))?;
        let muscle = body.muscle(name.trim()).map_err(|e| bad(e.to_string()))?;
        let name = &body.mesh.muscles[muscle].name;
        let tension: f64 = value
            .trim()
            .parse()
            .map_err(|_| bad(format!("\"{value}\" is not a number; write newtons, like {name}=12")))?;
        check_tension(name, tension).map_err(|e| bad(e.to_string()))?;
        limits::TENSION.check(tension).map_err(|beyond| bad(beyond.to_string()))?;
        if out.iter().any(|(m, _)| *m == muscle) {
            return Err(bad(SimulationError::repeated_name(name).to_string()));
        }
        out.push((muscle, tension));
    }
    Ok(out)
}
