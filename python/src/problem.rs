//! Inverse problems with the user's own observations.

use std::sync::Arc;

use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::inverse::FitSettings;
use tongue_fit::report::Provenance;
use tongue_fit::simulation;

use super::answer::{record, word};
use super::assembly::Assembly;
use super::errors::{chosen, refused, wrong};
use super::observe::Observation;
use super::solver::Shape;
use super::work::{aside_on, pool};

/// Observations of a body, and its unknowns: at first the tensions of the contracting muscles. Every `with_` and `free_` method returns
/// another problem.
///
/// Parameters
/// ----------
/// assembly : Assembly
///     The body and its contracting muscles.
/// observations : sequence of Observation
///     The observations.
/// method : {"gauss-newton", "nelder-mead"}, default "gauss-newton"
///     The search.
/// starts : int, default 4
///     Number of starting points of the search.
/// upper_bound : float, default 100.0
///     Largest tension, N per metre of thickness.
#[pyclass(frozen, module = "tongue_fit")]
#[derive(Clone)]
pub struct InverseProblem {
    problem: simulation::InverseProblem<2>,
    of: Assembly,
}

impl InverseProblem {
    fn changed(
        &self,
        problem: Result<simulation::InverseProblem<2>, simulation::SimulationError>,
    ) -> PyResult<Self> {
        Ok(Self { problem: problem.map_err(refused)?, of: self.of.clone() })
    }
}

#[pymethods]
impl InverseProblem {
    /// The problem in which only the tensions are unknown.
    #[new]
    #[pyo3(signature = (assembly, observations, *, method = "gauss-newton", starts = 4,
        upper_bound = 100.0))]
    fn new(
        assembly: &Assembly,
        observations: Vec<Observation>,
        method: &str,
        starts: usize,
        upper_bound: f64,
    ) -> PyResult<Self> {
        let (given, nodes) = (observations.iter().map(Observation::nodes), assembly.0.body.mesh.nodes.len());
        if let Some(given) = given.into_iter().find(|n| *n != nodes) {
            return Err(wrong(format!("an observation is of a body of {given} nodes, the body has {nodes}")));
        }
        let seen: Vec<_> = observations.into_iter().map(|o| o.seen).collect();
        let method = chosen("method", method)?;
        let settings = FitSettings { method, starts, upper_bound, ..FitSettings::default() };
        settings.check().map_err(refused)?;
        let problem = simulation::InverseProblem::new(&assembly.0, seen).with_settings(settings);
        Ok(Self { problem, of: assembly.clone() })
    }

    /// The problem with a known `tension` of a `muscle`, N per metre of thickness.
    fn with_tension(&self, muscle: &str, tension: f64) -> PyResult<Self> {
        self.changed(self.problem.clone().with_tension(muscle, tension))
    }

    /// The problem with bounds of the tension of a muscle.
    ///
    /// Parameters
    /// ----------
    /// muscle : str
    ///     Name of the muscle.
    /// lower : float
    ///     Lower bound, N per metre of thickness.
    /// upper : float
    ///     Upper bound, N per metre of thickness.
    fn with_bounds(&self, muscle: &str, lower: f64, upper: f64) -> PyResult<Self> {
        self.changed(self.problem.clone().with_bounds(muscle, lower, upper))
    }

    /// The problem with a normal prior of the tension of a muscle.
    ///
    /// Parameters
    /// ----------
    /// muscle : str
    ///     Name of the muscle.
    /// mean : float
    ///     Mean, N per metre of thickness.
    /// sd : float
    ///     Standard deviation, N per metre of thickness.
    fn with_prior(&self, muscle: &str, mean: f64, sd: f64) -> PyResult<Self> {
        self.changed(self.problem.clone().with_prior(muscle, mean, sd))
    }

    /// The problem with the displacement of a bone as an unknown, of at most `most` (m) in both directions of
    /// each axis.
    fn free_bone(&self, bone: &str, most: f64) -> PyResult<Self> {
        self.changed(self.problem.clone().free_bone(bone, most))
    }

    /// The problem with a normal prior of the displacement of a free `bone`: its standard deviation `sd` along each axis, m.
    fn with_bone_prior(&self, bone: &str, sd: f64) -> PyResult<Self> {
        self.changed(self.problem.clone().with_bone_prior(bone, sd))
    }

    /// The problem with Young's modulus as an unknown between `lower` and `upper`, Pa.
    fn free_young_modulus(&self, lower: f64, upper: f64) -> Self {
        Self { problem: self.problem.clone().free_young_modulus(lower, upper), of: self.of.clone() }
    }

    /// The problem with Poisson's ratio as an unknown between `lower` and `upper`.
    fn free_poisson_ratio(&self, lower: f64, upper: f64) -> Self {
        Self { problem: self.problem.clone().free_poisson_ratio(lower, upper), of: self.of.clone() }
    }

    /// Searches for the best fit of the observations. The result has the same bits for any number of threads.
    ///
    /// Parameters
    /// ----------
    /// threads : int, optional
    ///     Number of threads (default: one for each core).
    #[pyo3(signature = (*, threads = None))]
    fn fit(&self, py: Python<'_>, threads: Option<usize>) -> PyResult<Estimate> {
        let problem = self.problem.clone();
        let found = aside_on(py, &pool(py, threads)?, move || problem.fit())?.map_err(refused)?;
        let shape = Shape { shape: Arc::new(found.shape.clone()), assembly: self.of.clone() };
        Ok(Estimate { estimate: found, shape })
    }
}

/// The values of the unknowns with the best fit of the observations.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Estimate {
    estimate: simulation::Estimate<2>,
    shape: Shape,
}

#[pymethods]
impl Estimate {
    /// How the fit ended.
    #[getter]
    fn status(&self) -> String {
        word(&self.estimate.answer.status)
    }

    /// Whether the observations are met by the shape to which the tensions lead from rest, under the
    /// published law.
    #[getter]
    fn is_trustworthy(&self) -> bool {
        self.estimate.answer.is_trustworthy()
    }

    /// The tensions of all contracting muscles, N per metre of thickness.
    #[getter]
    fn tensions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let tensions = PyDict::new(py);
        self.estimate.tensions().into_iter().try_for_each(|(name, n)| tensions.set_item(name, n))?;
        Ok(tensions)
    }

    /// The tension of a muscle, N per metre of thickness.
    fn tension(&self, muscle: &str) -> PyResult<f64> {
        self.estimate.shape.tension(muscle).map_err(refused)
    }

    /// Displacement of a free bone from its place at rest, m, shape (2,).
    fn displacement<'py>(&self, py: Python<'py>, bone: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.estimate.displacement(bone).map_err(refused)?.as_slice().to_pyarray(py))
    }

    /// Number of directions in which the unknowns can change without a worse fit; None if it is not known.
    #[getter]
    fn undetermined(&self) -> Option<usize> {
        self.estimate.answer.undetermined()
    }

    /// The value of each observable in the fitted shape, in the order and units of the observations.
    #[getter]
    fn simulated<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.estimate.simulated().to_pyarray(py)
    }

    /// The fitted shape.
    #[getter]
    fn shape(&self) -> Shape {
        self.shape.clone()
    }

    /// The whole answer as a dict.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        record(py, &self.estimate.record(), &Provenance::new("python"))
    }

    /// A picture of the fitted shape, for notebooks.
    fn _repr_svg_(&self) -> PyResult<String> {
        self.shape.picture(&self.__repr__())
    }

    fn __repr__(&self) -> String {
        let tensions = self.estimate.tensions().into_iter().map(|(name, n)| format!("{name} {n:.2}"));
        format!("<Estimate: {}, {}>", self.status(), tensions.collect::<Vec<_>>().join(", "))
    }
}
