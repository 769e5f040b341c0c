//! Errors as exceptions with the text of the program.

use std::ffi::CString;

use pyo3::create_exception;
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use tongue_fit::choice;

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
    // The one option of the program that such a text names is `unit` of `Body.read`.
    Error::new_err(text.replace("--mesh-unit mm", "unit=\"mm\""))
}

/// Warns the caller.
pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// The exception with this text.
pub fn wrong(text: impl Into<String>) -> PyErr {
    Error::new_err(text.into())
}

/// The choice of this name, for the argument `what`.
///
/// # Errors
/// [`Error`] with the possible names, in the format of the program's options.
pub fn chosen<T: DeserializeOwned>(what: &str, name: &str) -> Result<T, PyErr> {
    choice::named(name).ok_or_else(|| {
        let known = choice::names::<T>().join(", ");
        wrong(format!("invalid value '{name}' for '{what}' [possible values: {known}]"))
    })
}
