//! Errors of names and numbers.

use tongue_core::body::NoSuchMuscle;
use tongue_core::dynamics::MotionError;
use tongue_core::suggest;
use tongue_core::system::SystemError;
use tongue_infer::inverse::FitError;

/// Why something cannot begin. Later failures are a status of the result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The body has no muscle of this name.
    #[error(transparent)]
    NoSuchMuscle(#[from] NoSuchMuscle),
    /// The body has no bone of this name.
    #[error("there is no bone \"{name}\" in this body; {}", bones(name, known))]
    NoSuchBone { name: String, known: Vec<String> },
    /// The muscle was not named when the model was assembled.
    #[error(
        "{muscle} does not contract in this model; name it when the model is assembled (contracting: {})",
        contracting.join(", ")
    )]
    Passive { muscle: String, contracting: Vec<String> },
    /// A muscle or bone is named twice.
    #[error("{name} is given twice; give each name once")]
    Repeated { name: String },
    /// A muscle has several fibres, but one line is needed.
    #[error("{muscle} has {fibres} fibres; {why}")]
    Fibres { muscle: String, fibres: usize, why: &'static str },
    /// A muscle or bone is not an unknown of the fit.
    #[error("{name} is not searched for; {what}")]
    NotUnknown { name: String, what: &'static str },
    /// A number is out of range.
    #[error("{name} is {value}; it must be {must}")]
    Value {
        name: String,
        /// Its value, SI.
        value: f64,
        must: &'static str,
    },
    /// The shape is of another body.
    #[error("the shape to start from has {given} nodes, the body {nodes}; take a shape of the same body")]
    OtherBody { given: usize, nodes: usize },
    /// The system cannot be made.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The fit cannot begin.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The body cannot be set in motion, or its motion not be followed.
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

/// Checks the tension of a muscle, N (2D: per metre of thickness).
pub fn check_tension(muscle: &str, tension: f64) -> Result<(), SimulationError> {
    let good = tension.is_finite() && tension >= 0.0;
    let must = "finite and not negative: muscles pull, they do not push";
    checked(&format!("the tension of {muscle}"), tension, good, must).map(|_| ())
}
