//! Errors of the library as exceptions with the same text.

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

pub fn refused(error: impl std::error::Error) -> PyErr {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let message = error.to_string();
        // As in the program, a cause that the text already contains is not repeated.
        if !text.contains(&message) {
            text = format!("{text}: {message}");
        }
        cause = error.source();
    }
    // Of all options only this one can be in such a text; it is `unit` of `Body.read`.
    Error::new_err(text.replace("--mesh-unit mm", "unit=\"mm\""))
}

pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

pub fn wrong(text: impl Into<String>) -> PyErr {
    Error::new_err(text.into())
}

/// The variant called `name`; `what` is the argument.
///
/// # Errors
/// [`Error`] with the possible names, in the format of the program's options.
pub fn chosen<T: DeserializeOwned>(what: &str, name: &str) -> Result<T, PyErr> {
    choice::named(name).ok_or_else(|| {
        let known = choice::names::<T>().join(", ");
        wrong(format!("invalid value '{name}' for '{what}' [possible values: {known}]"))
    })
}
