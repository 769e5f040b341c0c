//! Errors of names and numbers.

use tongue_core::body::NoSuchMuscle;
use tongue_core::dynamics::MotionError;
use tongue_core::suggest;
use tongue_core::system::SystemError;
use tongue_infer::inverse::FitError;

/// Why something cannot begin. Later failures are a status of the result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    #[error(transparent)]
    NoSuchMuscle(#[from] NoSuchMuscle),
    #[error("there is no bone \"{name}\" in this body; {}", bones(name, known))]
    NoSuchBone { name: String, known: Vec<String> },
    #[error(
        "{muscle} does not contract in this model; name it when the model is assembled (contracting: {})",
        contracting.join(", ")
    )]
    Passive { muscle: String, contracting: Vec<String> },
    #[error("{name} is given twice; give each name once")]
    Repeated { name: String },
    #[error("{muscle} has {fibres} fibres; {why}")]
    Fibres { muscle: String, fibres: usize, why: &'static str },
    #[error("{name} is not searched for; {what}")]
    NotUnknown { name: String, what: &'static str },
    #[error("{name} is {value}; it must be {must}")]
    Value { name: String, value: f64, must: &'static str },
    #[error("the shape to start from has {given} nodes, the body {nodes}; take a shape of the same body")]
    OtherBody { given: usize, nodes: usize },
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error(transparent)]
    Motion(#[from] MotionError),
}

fn bones(name: &str, known: &[String]) -> String {
    match known {
        [] => "it has no named bones".to_owned(),
        known => suggest::hint(name, known.iter().map(String::as_str)),
    }
}

/// `value` if it is `good`.
pub(super) fn checked(
    name: &str,
    value: f64,
    good: bool,
    must: &'static str,
) -> Result<f64, SimulationError> {
    if good { Ok(value) } else { Err(SimulationError::Value { name: name.to_owned(), value, must }) }
}

pub fn check_tension(muscle: &str, tension: f64) -> Result<(), SimulationError> {
    let good = tension.is_finite() && tension >= 0.0;
    let must = "finite and not negative: muscles pull, they do not push";
    checked(&format!("the tension of {muscle}"), tension, good, must).map(|_| ())
}
