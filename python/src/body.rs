//! Bodies.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::body;
use tongue_fit::report::{Export, Provenance};
use tongue_fit::run::{BodySource, Kind, PlaneBody};
use tongue_fit::simulation::Assembly;
use tongue_fit::system;

use super::answer::{Pickled, hashed, numbers, points, table};
use super::errors::{chosen, refused, warn, wrong};
use super::work::aside;

/// A tongue in the midsagittal plane: nodes, triangles, named muscles and named bones. SI units.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Body {
    pub body: Arc<body::Body<2>>,
    /// What the body was made from, which is small and stored in pickles.
    source: Arc<PlaneBody>,
}

impl PartialEq for Body {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.body, &other.body) || self.body == other.body
    }
}

impl Body {
    pub fn reference() -> PyResult<Self> {
        Ok(Self::of(PlaneBody::default())?.0)
    }

    /// A body, with notes on the file from which it was read.
    fn of(source: PlaneBody) -> PyResult<(Self, Vec<String>)> {
        let mut notes = Vec::new();
        let body = source.make(&mut |note| notes.push(note)).map_err(refused)?;
        Ok((Self { body: Arc::new(body), source: Arc::new(source) }, notes))
    }

    fn made(py: Python<'_>, source: PlaneBody) -> PyResult<Self> {
        Ok(aside(py, move || Self::of(source))??.0)
    }
}

#[pymethods]
impl Body {
    /// The reference tongue with the mesh spacing `spacing_m`, m (the thesis's is 5.5 mm).
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.0055))]
    fn tongue(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        Self::made(py, PlaneBody { spacing_m: Some(spacing_m), ..PlaneBody::default() })
    }

    /// The reference tongue as a continuum of quadratic elements with the mesh spacing `spacing_m`, m.
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.004))]
    fn continuum(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        let (kind, spacing_m) = (Kind::Continuum, Some(spacing_m));
        Self::made(py, PlaneBody { kind, spacing_m, ..PlaneBody::default() })
    }

    /// A tongue of an anatomy.
    ///
    /// Parameters
    /// ----------
    /// toml : str
    ///     The text of the file.
    /// spacing_m : float, default 0.0055
    ///     Mesh spacing, m.
    /// origin : str, default "anatomy"
    ///     Its name in messages.
    #[staticmethod]
    #[pyo3(signature = (toml, spacing_m = 0.0055, origin = "anatomy"))]
    fn from_anatomy(py: Python<'_>, toml: String, spacing_m: f64, origin: &str) -> PyResult<Self> {
        let source = BodySource::Anatomy { toml, origin: origin.to_owned() };
        Self::made(py, PlaneBody { source, spacing_m: Some(spacing_m), ..PlaneBody::default() })
    }

    /// A body from a file: Gmsh's, or the JSON of `tongue-fit mesh --json` (.json). What the program notes on the file is a `UserWarning`.
    ///
    /// Parameters
    /// ----------
    /// path : str or PathLike
    ///     The file.
    /// unit : {"m", "mm"}, default "m"
    ///     Unit of the coordinates of a file of Gmsh.
    #[staticmethod]
    #[pyo3(signature = (path, unit = "m"))]
    fn read(py: Python<'_>, path: PathBuf, unit: &str) -> PyResult<Self> {
        let unit = chosen("unit", unit)?;
        let origin = path.display().to_string();
        let (body, notes) = aside(py, move || {
            let source = BodySource::read(&path, unit).map_err(refused)?;
            Self::of(PlaneBody { source, ..PlaneBody::default() })
        })??;
        for note in notes {
            warn(py, &format!("{origin}: {note}"))?;
        }
        Ok(body)
    }

    /// The body of a pickle.
    #[staticmethod]
    fn _restored(py: Python<'_>, source: &str) -> PyResult<Self> {
        let source = serde_json::from_str(source);
        Self::made(py, source.map_err(|e| wrong(format!("a pickled body is unknown here: {e}")))?)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (String,)> {
        let source = serde_json::to_string(&*slf.get().source).map_err(refused)?;
        Ok((slf.py().get_type::<Self>().getattr("_restored")?, (source,)))
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        hashed(&(&self.body.what, self.body.mesh.nodes.len()))
    }

    /// The body at rest, for notebooks.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        let body = Arc::clone(&self.body);
        aside(py, move || {
            let model = system::Model::default();
            let assembly = Assembly::new(&model, &body, [""; 0]).map_err(refused)?;
            let shape = assembly.solver().equilibrium(&[]).map_err(refused)?;
            let picture = shape.picture(&body.what).map_err(refused)?;
            picture.text(&Provenance::new("python")).map_err(refused)
        })?
    }

    /// A description in words.
    #[getter]
    fn what(&self) -> &str {
        &self.body.what
    }

    /// Positions of the nodes at rest, m, shape (nodes, 2): x backwards, y upwards.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, &self.body.mesh.nodes)
    }

    /// Node numbers of every triangle, shape (triangles, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        table(py, self.body.mesh.cells.iter().flat_map(|c| c.iter().copied().take(3)), 3)
    }

    /// Numbers of the two nodes of every connection, shape (connections, 2).
    #[getter]
    fn connections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        table(py, self.body.mesh.connections.iter().flatten().copied(), 2)
    }

    /// Numbers of the nodes held by bone, ascending.
    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        numbers(py, &self.body.mesh.fixed)
    }

    /// The chain of nodes of every muscle, from end to end; of several fibres the first.
    #[getter]
    fn muscles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let muscles = PyDict::new(py);
        for chain in self.body.mesh.muscles.iter().rev() {
            muscles.set_item(&chain.name, numbers(py, &chain.nodes))?;
        }
        // The first dict was filled in reverse order; this one has the order of the body.
        let ordered = PyDict::new(py);
        for chain in &self.body.mesh.muscles {
            ordered.set_item(&chain.name, muscles.get_item(&chain.name)?)?;
        }
        Ok(ordered)
    }

    /// The nodes of every named bone.
    #[getter]
    fn bones<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bones = PyDict::new(py);
        for bone in &self.body.bones {
            bones.set_item(&bone.name, numbers(py, &bone.nodes))?;
        }
        Ok(bones)
    }

    /// The palate as a line of points, m, shape (points, 2); None if the body has none.
    #[getter]
    fn palate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.body.palate.as_ref().map(|p| points(py, p)).transpose()
    }

    fn __repr__(&self) -> String {
        let mesh = &self.body.mesh;
        format!("<Body: {}, {} nodes, {} triangles>", self.body.what, mesh.nodes.len(), mesh.cells.len())
    }
}
