//! Bodies, what makes a model of them, and bodies that are ready to be solved.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::body::{self, Anatomy, AnyBody, BodyError, ContinuumSettings, Unit};
use tongue_fit::material::{Constants, Preset, Spread};
use tongue_fit::simulation;
use tongue_fit::simulation::Assemble;
use tongue_fit::system::{self, OutsidePath, TissueModel};

use super::answer::{numbers, points, table};
use super::errors::{named, refused};
use super::measured::Target;
use super::observe::{Observable, Observation};
use super::solver::{Solver, Tensions, Trajectory};
use super::work::aside;

/// A tongue in the midsagittal plane: nodes, triangles, named muscles and named bones. SI units.
#[pyclass(frozen, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Body(pub body::Body<2>);

#[pymethods]
impl Body {
    /// The reference tongue at a mesh spacing, m (default: 5.5 mm, the thesis's).
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.0055))]
    fn tongue(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        aside(py, move || body::Body::tongue(spacing_m))?.map(Self).map_err(refused)
    }

    /// The reference tongue as a continuum of quadratic elements at a mesh spacing, m (default: 4 mm).
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.004))]
    fn continuum(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        let made = aside(py, move || body::Body::continuum(spacing_m, &ContinuumSettings::default()))?;
        made.map(Self).map_err(refused)
    }

    /// A tongue of an anatomy (the text of a TOML file) at a mesh spacing, m.
    #[staticmethod]
    #[pyo3(signature = (toml, spacing_m = 0.0055, origin = "anatomy"))]
    fn from_anatomy(py: Python<'_>, toml: &str, spacing_m: f64, origin: &str) -> PyResult<Self> {
        let anatomy = Anatomy::from_toml(toml, origin).map_err(refused)?;
        let made = aside(py, move || body::Body::from_anatomy(&anatomy, spacing_m))?;
        made.map(Self).map_err(|e| refused(BodyError::from(e)))
    }

    /// A body in a file: Gmsh's (`unit` of its coordinates: m or mm), or what `tongue-fit mesh --json` printed (.json).
    #[staticmethod]
    #[pyo3(signature = (path, unit = "m"))]
    fn read(py: Python<'_>, path: PathBuf, unit: &str) -> PyResult<Self> {
        let unit = named("unit", unit, &[("m", Unit::M), ("mm", Unit::Mm)])?;
        aside(py, move || AnyBody::read(&path, unit).and_then(|body| Ok(body.flat()?)))?
            .map(Self)
            .map_err(refused)
    }

    /// What it is, in words.
    #[getter]
    fn what(&self) -> &str {
        &self.0.what
    }

    /// Positions of the nodes at rest, m, shape (nodes, 2): x backwards, y upwards.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, &self.0.mesh.nodes)
    }

    /// Numbers of the nodes of every triangle, shape (triangles, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        table(py, self.0.mesh.cells.iter().flat_map(|c| c.iter().copied().take(3)), 3)
    }

    /// Numbers of the nodes that every connection joins, shape (connections, 2).
    #[getter]
    fn connections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        table(py, self.0.mesh.connections.iter().flatten().copied(), 2)
    }

    /// Numbers of the nodes that bone holds, ascending.
    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        numbers(py, &self.0.mesh.fixed)
    }

    /// The chain of nodes of every muscle, from end to end; of several fibres the first.
    #[getter]
    fn muscles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let muscles = PyDict::new(py);
        for chain in self.0.mesh.muscles.iter().rev() {
            muscles.set_item(&chain.name, numbers(py, &chain.nodes))?;
        }
        // The first of a name was set last; the order is that of the body.
        let ordered = PyDict::new(py);
        for chain in &self.0.mesh.muscles {
            ordered.set_item(&chain.name, muscles.get_item(&chain.name)?)?;
        }
        Ok(ordered)
    }

    /// The nodes of every named bone.
    #[getter]
    fn bones<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bones = PyDict::new(py);
        for bone in &self.0.bones {
            bones.set_item(&bone.name, numbers(py, &bone.nodes))?;
        }
        Ok(bones)
    }

    /// The palate as a line of points, m, shape (points, 2); None where the body has none.
    #[getter]
    fn palate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.0.palate.as_ref().map(|p| points(py, p)).transpose()
    }

    fn __repr__(&self) -> String {
        let mesh = &self.0.mesh;
        format!("<Body: {}, {} nodes, {} triangles>", self.0.what, mesh.nodes.len(), mesh.cells.len())
    }
}

/// What makes a body ready to be solved: constants of the tissue, and what carries the load in it.
#[pyclass(frozen, module = "tongue_fit", from_py_object)]
#[derive(Clone, Copy)]
pub struct Model(pub system::Model);

#[pymethods]
impl Model {
    /// Young's modulus (Pa) and Poisson's ratio of the tissue; where the coefficients of springs come from (`preset`: consistent or
    /// as-printed), how they are laid on the connections (`spread`: per-connection or assembled), muscle parts outside the tissue
    /// (`outside`: straight or chain), what the tissue is (`tissue`: springs or fe; a continuum needs none).
    #[new]
    #[pyo3(signature = (*, young_modulus = 6900.0, poisson_ratio = 0.49,
        preset = "consistent", spread = "per-connection", outside = "straight", tissue = "springs"))]
    fn new(
        young_modulus: f64,
        poisson_ratio: f64,
        preset: &str,
        spread: &str,
        outside: &str,
        tissue: &str,
    ) -> PyResult<Self> {
        let constants = Constants { young_modulus, poisson_ratio, ..Constants::TONGUE };
        constants.check().map_err(refused)?;
        let presets = [("consistent", Preset::Consistent), ("as-printed", Preset::AsPrinted)];
        let spreads = [("per-connection", Spread::PerConnection), ("assembled", Spread::Assembled)];
        let paths = [("straight", OutsidePath::Straight), ("chain", OutsidePath::Chain)];
        let tissues = [("springs", TissueModel::MassSpring), ("fe", TissueModel::FiniteElement)];
        Ok(Self(system::Model {
            constants,
            preset: named("preset", preset, &presets)?,
            spread: named("spread", spread, &spreads)?,
            outside: named("outside", outside, &paths)?,
            tissue: named("tissue", tissue, &tissues)?,
        }))
    }

    /// Makes `body` ready to be solved, with the muscles of these names contracting. Every other muscle is plain tissue.
    fn assemble(&self, py: Python<'_>, body: &Body, muscles: Vec<String>) -> PyResult<Assembly> {
        let (model, body) = (self.of(body), body.0.clone());
        aside(py, move || model.assemble(&body, muscles))?.map(Assembly).map_err(refused)
    }
}

impl Model {
    /// That of a body: a continuum says itself what its tissue is.
    pub fn of(&self, body: &Body) -> system::Model {
        match body.0.mesh.continuum {
            Some(_) => system::Model { tissue: TissueModel::Continuum, ..self.0 },
            None => self.0,
        }
    }
}

/// A body of which some muscles can contract, ready to be solved. Shared by threads.
#[pyclass(frozen, module = "tongue_fit")]
#[derive(Clone)]
pub struct Assembly(pub simulation::Assembly<2>);

#[pymethods]
impl Assembly {
    /// The body.
    #[getter]
    fn body(&self) -> Body {
        Body(self.0.body().clone())
    }

    /// Names of the muscles that can contract, in the order in which they were given: the order of all arrays of tensions.
    #[getter]
    fn contracting(&self) -> Vec<&str> {
        self.0.contracting()
    }

    /// What solves it: one a thread.
    fn solver(&self) -> Solver {
        Solver::new(&self.0)
    }

    /// The motion from rest while the tensions (N per metre of thickness) grow to their values in `ramp_s` (s) and then stay, until
    /// `t_end_s`, looked at `samples` times evenly.
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

    /// The length of a muscle, m, as something to observe.
    fn length(&self, muscle: &str) -> PyResult<Observable> {
        self.0.length(muscle).map(|o| Observable::new(o, &self.0)).map_err(refused)
    }

    /// The length of a muscle over its length at rest, as something to observe.
    fn stretch(&self, muscle: &str) -> PyResult<Observable> {
        self.0.stretch(muscle).map(|o| Observable::new(o, &self.0)).map_err(refused)
    }

    /// The length of a muscle over another's, as something to observe.
    fn ratio(&self, muscle: &str, over: &str) -> PyResult<Observable> {
        self.0.ratio(muscle, over).map(|o| Observable::new(o, &self.0)).map_err(refused)
    }

    /// The signed distance of a measured point (x, y), m, from the outline of the tissue: positive outside.
    fn contour(&self, point: [f64; 2]) -> PyResult<Observable> {
        self.0.contour(point.into()).map(|o| Observable::new(o, &self.0)).map_err(refused)
    }

    /// What a measured target says of this body: an observation for every fitted muscle.
    fn observations(&self, target: &Target) -> PyResult<Vec<Observation>> {
        let nodes = self.0.body().mesh.nodes.len();
        let seen = self.0.observations(&target.0).map_err(refused)?;
        Ok(seen.fitted.into_iter().map(|seen| Observation { seen, nodes }).collect())
    }

    fn __repr__(&self) -> String {
        format!("<Assembly: {}, contracting {}>", self.0.body().what, self.0.contracting().join(", "))
    }
}
