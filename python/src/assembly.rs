//! Models, and bodies that are ready to be solved.

use std::sync::Arc;

use pyo3::prelude::*;
use tongue_fit::simulation;
use tongue_fit::system;

use super::answer::{Pickled, hashed};
use super::body::Body;
use super::errors::refused;
use super::given;
use super::work::aside;

/// A body of which some muscles can contract, ready to be solved. Threads may share it.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Assembly(pub simulation::Assembly<2>, pub Arc<(Model, Body)>);

impl PartialEq for Assembly {
    fn eq(&self, other: &Self) -> bool {
        self.1 == other.1 && self.0.contracting() == other.0.contracting()
    }
}

#[pymethods]
impl Assembly {
    /// The body.
    #[getter]
    fn body(&self) -> Body {
        self.1.1.clone()
    }

    /// Names of the muscles that can contract, in the given order, which is the order of all arrays of
    /// tensions.
    #[getter]
    fn contracting(&self) -> Vec<&str> {
        self.0.contracting()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (Body, Vec<String>)> {
        let (model, body) = &*slf.get().1;
        let muscles = slf.get().0.contracting().into_iter().map(str::to_owned).collect();
        Ok(((*model).into_pyobject(slf.py())?.getattr("assemble")?, (body.clone(), muscles)))
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        hashed(&(&self.0.body.what, self.0.contracting()))
    }

    fn __repr__(&self) -> String {
        format!("<Assembly: {}, contracting {}>", self.0.body.what, self.0.contracting().join(", "))
    }
}

/// The model of a body.
///
/// Parameters
/// ----------
/// young_modulus : float, default 6900.0
///     Young's modulus of the tissue, Pa.
/// poisson_ratio : float, default 0.49
///     Poisson's ratio of the tissue, below 0.5.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub struct Model(pub system::Model);

#[pymethods]
impl Model {
    /// The model with these constants.
    #[new]
    #[pyo3(signature = (*, young_modulus = 6900.0, poisson_ratio = 0.49))]
    fn new(young_modulus: f64, poisson_ratio: f64) -> PyResult<Self> {
        let model = system::Model { young_modulus, poisson_ratio, ..system::Model::default() };
        model.check().map_err(refused)?;
        Ok(Self(model))
    }

    /// Makes `body` ready to be solved; the named muscles contract, and all others are passive tissue.
    fn assemble(&self, py: Python<'_>, body: &Body, muscles: &Bound<'_, PyAny>) -> PyResult<Assembly> {
        let muscles = given::names("muscles", muscles)?;
        let (model, from, given) = (self.0, Arc::clone(&body.body), *self);
        let made = aside(py, move || simulation::Assembly::new(&model, &from, muscles))?.map_err(refused)?;
        Ok(Assembly(made, Arc::new((given, body.clone()))))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (f64, f64)> {
        let c = &slf.get().0;
        Ok((slf.py().get_type::<Self>().getattr("_restored")?, (c.young_modulus, c.poisson_ratio)))
    }

    /// The model of a pickle.
    #[staticmethod]
    fn _restored(young_modulus: f64, poisson_ratio: f64) -> PyResult<Self> {
        Self::new(young_modulus, poisson_ratio)
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        let c = &self.0;
        hashed(&(c.young_modulus.to_bits(), c.poisson_ratio.to_bits()))
    }

    fn __repr__(&self) -> String {
        let c = &self.0;
        format!("Model(young_modulus={:?}, poisson_ratio={:?})", c.young_modulus, c.poisson_ratio)
    }
}
