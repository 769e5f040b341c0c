//! Conversion to Python: arrays, names, records and hashes.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;

use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use tongue_fit::report::{Export, Json, Provenance};

use super::errors::wrong;

/// A pickle: the callable that makes the object, and its arguments.
pub type Pickled<'py, T> = PyResult<(Bound<'py, PyAny>, T)>;

/// Points as an array of shape (points, 2).
pub fn points<'py>(py: Python<'py>, points: &[SVector<f64, 2>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = points.iter().flat_map(|p| [p.x, p.y]).collect();
    PyArray1::from_vec(py, flat).reshape([points.len(), 2])
}

/// Node numbers as an array of one axis.
pub fn numbers<'py>(py: Python<'py>, numbers: &[usize]) -> Bound<'py, PyArray1<i64>> {
    numbers.iter().map(|n| *n as i64).collect::<Vec<_>>().to_pyarray(py)
}

/// Rows of `width` node numbers as an array of shape (rows, width).
pub fn table<'py>(
    py: Python<'py>,
    numbers: impl Iterator<Item = usize>,
    width: usize,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let flat: Vec<i64> = numbers.map(|n| n as i64).collect();
    let rows = flat.len() / width.max(1);
    PyArray1::from_vec(py, flat).reshape([rows, width])
}

/// The name that a value has in JSON.
pub fn word(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        other => other.map(|v| v.to_string()).unwrap_or_default(),
    }
}

/// A record as a dict with the fields and the bits of the program's JSON.
pub fn record<'py>(
    py: Python<'py>,
    record: &impl Serialize,
    by: &Provenance,
) -> PyResult<Bound<'py, PyDict>> {
    loads(py, &Json(record).text(by).map_err(|e: io::Error| wrong(e.to_string()))?)
}

pub fn loads<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyDict>> {
    Ok(py.import("json")?.call_method1("loads", (text,))?.cast_into()?)
}

pub fn hashed(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}
