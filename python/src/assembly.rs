//! Bodies that are ready to be solved.

use std::sync::Arc;

use pyo3::prelude::*;
use tongue_fit::simulation;

use super::answer::Pickled;
use super::body::{Body, Model};
use super::errors::{refused, wrong};
use super::given::Given;
use super::measured::Target;
use super::observe::{Observable, Observation, Seen};
use super::solver::{Solver, Tensions, Trajectory};
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

    /// A solver of this assembly; each thread needs its own.
    fn solver(&self) -> Solver {
        Solver::new(self)
    }

    /// The motion from rest while the tensions grow to their values and then stay.
    ///
    /// Parameters
    /// ----------
    /// tensions : mapping, array or list of float
    ///     Tensions by muscle, or in the order of `contracting`, N per metre of thickness.
    /// t_end_s : float
    ///     End of the motion, s.
    /// ramp_s : float, default 0.0
    ///     Time in which the tensions grow, s.
    /// samples : int, default 101
    ///     Number of equidistant times.
    #[pyo3(signature = (tensions, t_end_s, ramp_s = 0.0, samples = 101))]
    fn trajectory(
        &self,
        py: Python<'_>,
        tensions: Tensions,
        t_end_s: f64,
        ramp_s: f64,
        samples: usize,
    ) -> PyResult<Trajectory> {
        let (assembly, given) = (self.0.clone(), tensions.of(&self.0)?);
        let followed = aside(py, move || {
            let given: Vec<(&str, f64)> = given.iter().map(|(name, n)| (name.as_str(), *n)).collect();
            assembly.trajectory(&given, ramp_s, t_end_s, samples)
        })?;
        followed.map(Trajectory).map_err(refused)
    }

    /// The length of a muscle, m, as an observable.
    fn length(&self, muscle: &str) -> PyResult<Observable> {
        Observable::new(self, Seen::Length(muscle.to_owned()))
    }

    /// The length of a muscle over its length at rest, as an observable.
    fn stretch(&self, muscle: &str) -> PyResult<Observable> {
        Observable::new(self, Seen::Stretch(muscle.to_owned()))
    }

    /// The length of a muscle over another's, as an observable.
    fn ratio(&self, muscle: &str, over: &str) -> PyResult<Observable> {
        Observable::new(self, Seen::Ratio(muscle.to_owned(), over.to_owned()))
    }

    /// The signed distance of a measured point (x, y), m, from the outline of the tissue, as an observable:
    /// positive outside.
    fn contour(&self, point: &Bound<'_, PyAny>) -> PyResult<Observable> {
        let point = Given::pair("point", point)?;
        Observable::new(self, Seen::Contour(point.x, point.y))
    }

    /// The observations of this body in a measured target: one for every fitted muscle.
    fn observations(&self, target: &Target) -> PyResult<Vec<Observation>> {
        let seen = self.0.observations(&target.target).map_err(refused)?.fitted.into_iter().enumerate();
        Ok(seen.map(|(number, seen)| Observation::of_target(seen, self, target, number)).collect())
    }

    /// One of the observations, for a pickle.
    fn _observation(&self, target: &Target, number: usize) -> PyResult<Observation> {
        let found = self.observations(target)?.into_iter().nth(number);
        found.ok_or_else(|| wrong("a pickled observation is of another target"))
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
        super::body::hashed(&(&self.0.body().what, self.0.contracting()))
    }

    fn __repr__(&self) -> String {
        format!("<Assembly: {}, contracting {}>", self.0.body().what, self.0.contracting().join(", "))
    }
}
