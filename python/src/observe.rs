//! Observables of a body, and observations.

use std::sync::Arc;

use nalgebra::SVector;
use numpy::PyArray2;
use pyo3::prelude::*;
use tongue_fit::observe;

use super::answer::{self, Pickled};
use super::assembly::Assembly;
use super::errors::{refused, wrong};
use super::given::{Given, points};
use super::measured::Target;

#[pymethods]
impl Assembly {
    /// The length of a muscle, m, as an observable.
    fn length(&self, muscle: &str) -> PyResult<Observable> {
        Observable::new(self, ObservableKind::Length(muscle.to_owned()))
    }

    /// The length of a muscle over its length at rest, as an observable.
    fn stretch(&self, muscle: &str) -> PyResult<Observable> {
        Observable::new(self, ObservableKind::Stretch(muscle.to_owned()))
    }

    /// The length of a muscle over another's, as an observable.
    fn ratio(&self, muscle: &str, over: &str) -> PyResult<Observable> {
        Observable::new(self, ObservableKind::Ratio(muscle.to_owned(), over.to_owned()))
    }

    /// The signed distance of a measured point (x, y), m, from the outline of the tissue, as an observable:
    /// positive outside.
    fn contour(&self, point: &Bound<'_, PyAny>) -> PyResult<Observable> {
        let point = Given::pair("point", point)?;
        Observable::new(self, ObservableKind::Contour(point.x, point.y))
    }

    /// The observations of this body in a measured target: one for every fitted muscle.
    fn observations(&self, target: &Target) -> PyResult<Vec<Observation>> {
        let seen = self.0.observations(&target.target).map_err(refused)?.fitted.into_iter().enumerate();
        Ok(seen.map(|(number, seen)| Observation::of_target(seen, self, target, number)).collect())
    }

    /// The observation number `number` of a target, for a pickle.
    fn _observation(&self, target: &Target, number: usize) -> PyResult<Observation> {
        let found = self.observations(target)?.into_iter().nth(number);
        found.ok_or_else(|| wrong("a pickled observation is of another target"))
    }
}

#[derive(Clone, PartialEq)]
pub enum ObservableKind {
    Length(String),
    Stretch(String),
    Ratio(String, String),
    /// x and y, m.
    Contour(f64, f64),
}

/// A number computed from the positions of the nodes of one body.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Observable {
    observable: Arc<dyn observe::Observable<2>>,
    seen: ObservableKind,
    of: Assembly,
}

impl PartialEq for Observable {
    fn eq(&self, other: &Self) -> bool {
        self.seen == other.seen && self.of == other.of
    }
}

impl Observable {
    /// # Errors
    /// A muscle that the body does not have; a point that is not finite.
    pub fn new(of: &Assembly, seen: ObservableKind) -> PyResult<Self> {
        let body = &of.0;
        let observable: Arc<dyn observe::Observable<2>> = match &seen {
            ObservableKind::Length(muscle) => Arc::new(body.length(muscle).map_err(refused)?),
            ObservableKind::Stretch(muscle) => Arc::new(body.stretch(muscle).map_err(refused)?),
            ObservableKind::Ratio(muscle, over) => Arc::new(body.ratio(muscle, over).map_err(refused)?),
            ObservableKind::Contour(x, y) => {
                Arc::new(body.contour(SVector::from([*x, *y])).map_err(refused)?)
            }
        };
        Ok(Self { observable, seen, of: of.clone() })
    }

    fn nodes(&self) -> usize {
        self.of.0.body.mesh.nodes.len()
    }
}

#[pymethods]
impl Observable {
    /// The number at these positions of all nodes, m, shape (nodes, 2).
    fn value(&self, positions: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(self.observable.value(&points("positions", positions, self.nodes())?))
    }

    /// Its derivatives by the positions of all nodes, unit of the value per m, shape (nodes, 2).
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut slopes = vec![SVector::zeros(); self.nodes()];
        let at = points("positions", positions, self.nodes())?;
        self.observable.gradient(&at, &mut |node, slope| slopes[node] += slope);
        answer::points(py, &slopes)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let (method, given) = match &this.seen {
            ObservableKind::Length(muscle) => ("length", (muscle,).into_pyobject(py)?.into_any()),
            ObservableKind::Stretch(muscle) => ("stretch", (muscle,).into_pyobject(py)?.into_any()),
            ObservableKind::Ratio(muscle, over) => ("ratio", (muscle, over).into_pyobject(py)?.into_any()),
            ObservableKind::Contour(x, y) => ("contour", ((*x, *y),).into_pyobject(py)?.into_any()),
        };
        Ok((this.of.clone().into_pyobject(py)?.getattr(method)?, given))
    }

    fn __repr__(&self) -> String {
        match &self.seen {
            ObservableKind::Length(muscle) => format!("<Observable: length of {muscle}, m>"),
            ObservableKind::Stretch(muscle) => format!("<Observable: length of {muscle} over that at rest>"),
            ObservableKind::Ratio(muscle, over) => {
                format!("<Observable: length of {muscle} over that of {over}>")
            }
            ObservableKind::Contour(x, y) => {
                format!("<Observable: distance of ({x}, {y}) from the outline, m>")
            }
        }
    }
}

/// The arguments that make an observation.
#[derive(Clone, PartialEq)]
enum Source {
    /// A user's value and its standard deviation.
    Own(Observable, Option<f64>),
    /// The number of the observation of a target.
    Target(Assembly, Target, usize),
}

/// A measurement: an `observable` has the value `measured`, in its unit. Its residual is divided by `standard_deviation` (same unit,
/// default: not divided).
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Observation {
    pub seen: observe::Observation<2>,
    source: Source,
}

impl PartialEq for Observation {
    fn eq(&self, other: &Self) -> bool {
        self.seen.measured == other.seen.measured && self.source == other.source
    }
}

impl Observation {
    pub fn of_target(seen: observe::Observation<2>, of: &Assembly, target: &Target, number: usize) -> Self {
        Self { seen, source: Source::Target(of.clone(), target.clone(), number) }
    }

    /// Number of nodes of the body.
    pub fn nodes(&self) -> usize {
        match &self.source {
            Source::Own(observable, _) => observable.nodes(),
            Source::Target(of, ..) => of.0.body.mesh.nodes.len(),
        }
    }
}

#[pymethods]
impl Observation {
    /// The observation of this value.
    #[new]
    #[pyo3(signature = (observable, measured, standard_deviation = None))]
    fn new(observable: &Observable, measured: f64, standard_deviation: Option<f64>) -> PyResult<Self> {
        if !measured.is_finite() {
            return Err(wrong(format!("the measured value is {measured}; it must be finite")));
        }
        let seen =
            observe::Observation { observable: Arc::clone(&observable.observable), measured, weight: 1.0 };
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
        Ok(Self { seen, source: Source::Own(observable.clone(), standard_deviation) })
    }

    /// The measured value, unit of the observable.
    #[getter]
    fn measured(&self) -> f64 {
        self.seen.measured
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        Ok(match &this.source {
            Source::Own(observable, sd) => {
                let given = (observable.clone(), this.seen.measured, *sd).into_pyobject(py)?;
                (py.get_type::<Self>().into_any(), given.into_any())
            }
            Source::Target(of, target, number) => {
                let made = of.clone().into_pyobject(py)?.getattr("_observation")?;
                (made, (target.clone(), *number).into_pyobject(py)?.into_any())
            }
        })
    }

    fn __repr__(&self) -> String {
        match &self.source {
            Source::Own(observable, sd) => {
                let seen = observable.__repr__();
                let what = seen.trim_start_matches("<Observable: ").trim_end_matches('>');
                let sure = sd.map_or_else(String::new, |sd| format!(" (standard deviation {sd})"));
                format!("<Observation: {what}: {}{sure}>", self.seen.measured)
            }
            Source::Target(_, target, number) => {
                format!("<Observation: {} of {}: {}>", number + 1, target.description(), self.seen.measured)
            }
        }
    }
}
