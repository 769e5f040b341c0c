//! What can be seen of a body, and what was seen.

use std::sync::Arc;

use nalgebra::SVector;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use tongue_fit::{observe, simulation};

use super::answer::{points, to_points};
use super::errors::wrong;

/// A number that can be read off the positions of the nodes of one body.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Observable {
    observable: Arc<dyn observe::Observable<2>>,
    /// Nodes of the body.
    nodes: usize,
}

impl Observable {
    /// One of a body's.
    pub fn new(observable: impl observe::Observable<2> + 'static, of: &simulation::Assembly<2>) -> Self {
        Self { observable: Arc::new(observable), nodes: of.body().mesh.nodes.len() }
    }
}

#[pymethods]
impl Observable {
    /// The number at these positions of all nodes, m, shape (nodes, 2).
    fn value(&self, positions: PyReadonlyArray2<'_, f64>) -> PyResult<f64> {
        Ok(self.observable.value(&to_points("positions", &positions, self.nodes)?))
    }

    /// Its derivatives by the positions of all nodes, unit of the value per m, shape (nodes, 2).
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut slopes = vec![SVector::zeros(); self.nodes];
        let at = to_points("positions", &positions, self.nodes)?;
        self.observable.gradient(&at, &mut |node, slope| slopes[node] += slope);
        points(py, &slopes)
    }
}

/// An observable, its measured value (its unit), and how sure that is.
#[pyclass(frozen, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Observation {
    /// What was seen.
    pub seen: observe::Observation<2>,
    /// Nodes of the body that it is of.
    pub nodes: usize,
}

#[pymethods]
impl Observation {
    /// That the observable has this value; with a standard deviation (unit of the value) its residual is divided by that.
    #[new]
    #[pyo3(signature = (observable, measured, standard_deviation = None))]
    fn new(observable: &Observable, measured: f64, standard_deviation: Option<f64>) -> PyResult<Self> {
        if !measured.is_finite() {
            return Err(wrong(format!("the measured value is {measured}; it must be finite")));
        }
        let seen = observe::Observation {
            observable: Arc::clone(&observable.observable),
            measured,
            sense: observe::Sense::Equal,
            certainty: observe::Certainty::Unknown,
            weight: 1.0,
            time_s: None,
        };
        let seen = match standard_deviation {
            None => seen,
            Some(sd) if sd.is_finite() && sd > 0.0 => seen.with_standard_deviation(sd),
            Some(sd) => {
                let what = format!(
                    "the standard deviation of an observation is {sd}; it must be positive and finite"
                );
                return Err(wrong(what));
            }
        };
        Ok(Self { seen, nodes: observable.nodes })
    }

    /// The measured value, unit of the observable.
    #[getter]
    fn measured(&self) -> f64 {
        self.seen.measured
    }
}
