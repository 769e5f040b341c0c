//! Errors as exceptions with the text of the program.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(
    tongue_fit,
    Error,
    PyValueError,
    "Input that cannot be used: what is wrong, where, and what to do."
);

/// The exception for an error of the library.
pub fn refused(error: impl std::error::Error) -> PyErr {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let said = error.to_string();
        // A cause that is quoted already is not repeated, as in the program.
        if !text.contains(&said) {
            text = format!("{text}: {said}");
        }
        cause = error.source();
    }
    Error::new_err(text)
}

/// The exception with this text.
pub fn wrong(text: impl Into<String>) -> PyErr {
    Error::new_err(text.into())
}

/// The value with this name.
///
/// # Errors
/// [`Error`] with the possible names, in the format of the program's options.
pub fn named<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> Result<T, PyErr> {
    let found = known.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
    found.ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(n, _)| *n).collect();
        wrong(format!("invalid value '{name}' for '{what}' [possible values: {}]", names.join(", ")))
    })
}
