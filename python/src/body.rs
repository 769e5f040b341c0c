//! Bodies and models.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use serde::Deserialize;
use tongue_fit::body::{self, Anatomy, AnyBody, BodyError, ContinuumSettings};
use tongue_fit::choice::name_of;
use tongue_fit::material::Constants;
use tongue_fit::report::{Export, Provenance};
use tongue_fit::simulation::Assemble;
use tongue_fit::system::{self, TissueModel};

use super::answer::{Pickled, numbers, points, table};
use super::assembly::Assembly;
use super::errors::{chosen, refused, wrong};
use super::given;
use super::work::aside;

/// A tongue in the midsagittal plane: nodes, triangles, named muscles and named bones. SI units.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Body {
    /// The body.
    pub body: Arc<body::Body<2>>,
    /// Its origin.
    source: Arc<Source>,
}

/// The origin of a body: small, and stored in pickles.
#[derive(Clone)]
enum Source {
    Tongue(f64),
    Continuum(f64),
    Anatomy { toml: String, spacing_m: f64, origin: String },
    File { bytes: Vec<u8>, path: String, unit: String },
}

impl Source {
    fn make(&self) -> PyResult<body::Body<2>> {
        match self {
            Self::Tongue(spacing_m) => body::Body::tongue(*spacing_m).map_err(refused),
            Self::Continuum(spacing_m) => {
                body::Body::continuum(*spacing_m, &ContinuumSettings::default()).map_err(refused)
            }
            Self::Anatomy { toml, spacing_m, origin } => {
                let anatomy = Anatomy::from_toml(toml, origin).map_err(refused)?;
                body::Body::from_anatomy(&anatomy, *spacing_m).map_err(|e| refused(BodyError::from(e)))
            }
            Self::File { bytes, path, unit } => {
                if is_json(Path::new(path)) {
                    let text = std::str::from_utf8(bytes).map_err(refused)?;
                    return body::json::read(text, path).map_err(refused);
                }
                let any = AnyBody::from_msh(bytes, path, chosen("unit", unit)?).map_err(refused)?;
                any.flat().map_err(refused)
            }
        }
    }
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

impl PartialEq for Body {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.body, &other.body) || self.body == other.body
    }
}

impl Body {
    /// The reference tongue.
    pub fn reference() -> PyResult<Self> {
        Source::Tongue(body::DEFAULT_SPACING_M).try_into()
    }

    fn made(py: Python<'_>, source: Source) -> PyResult<Self> {
        aside(py, move || source.try_into())?
    }
}

impl TryFrom<Source> for Body {
    type Error = PyErr;

    fn try_from(source: Source) -> PyResult<Self> {
        Ok(Self { body: Arc::new(source.make()?), source: Arc::new(source) })
    }
}

#[pymethods]
impl Body {
    /// The reference tongue at a mesh spacing, m (default: 5.5 mm, the thesis's).
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.0055))]
    fn tongue(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        Self::made(py, Source::Tongue(spacing_m))
    }

    /// The reference tongue as a continuum of quadratic elements at a mesh spacing, m (default: 4 mm).
    #[staticmethod]
    #[pyo3(signature = (spacing_m = 0.004))]
    fn continuum(py: Python<'_>, spacing_m: f64) -> PyResult<Self> {
        Self::made(py, Source::Continuum(spacing_m))
    }

    /// A tongue of an anatomy (the text of a TOML file) at a mesh spacing, m.
    #[staticmethod]
    #[pyo3(signature = (toml, spacing_m = 0.0055, origin = "anatomy"))]
    fn from_anatomy(py: Python<'_>, toml: String, spacing_m: f64, origin: &str) -> PyResult<Self> {
        Self::made(py, Source::Anatomy { toml, spacing_m, origin: origin.to_owned() })
    }

    /// A body from a file: Gmsh's (`unit` of its coordinates: m or mm), or the JSON of
    /// `tongue-fit mesh --json` (.json).
    #[staticmethod]
    #[pyo3(signature = (path, unit = "m"))]
    fn read(py: Python<'_>, path: PathBuf, unit: &str) -> PyResult<Self> {
        let (unit, word) = (chosen("unit", unit)?, unit.to_owned());
        aside(py, move || {
            let body = AnyBody::read(&path, unit).and_then(|body| Ok(body.flat()?)).map_err(refused)?;
            let bytes = tongue_fit::files::read(&path).map_err(refused)?;
            let source = Source::File { bytes, path: path.display().to_string(), unit: word };
            Ok(Self { body: Arc::new(body), source: Arc::new(source) })
        })?
    }

    /// The body of a pickle.
    #[staticmethod]
    fn _restored(py: Python<'_>, kind: &str, state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let source = match kind {
            "tongue" => Source::Tongue(state.extract::<(f64,)>()?.0),
            "continuum" => Source::Continuum(state.extract::<(f64,)>()?.0),
            "anatomy" => {
                let (toml, spacing_m, origin) = state.extract()?;
                Source::Anatomy { toml, spacing_m, origin }
            }
            "file" => {
                let (bytes, path, unit) = state.extract()?;
                Source::File { bytes, path, unit }
            }
            other => return Err(wrong(format!("a pickled body of the kind {other} is unknown here"))),
        };
        Self::made(py, source)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (&'static str, Bound<'py, PyTuple>)> {
        let py = slf.py();
        let state = match &*slf.get().source {
            Source::Tongue(spacing_m) => ("tongue", (*spacing_m,).into_pyobject(py)?),
            Source::Continuum(spacing_m) => ("continuum", (*spacing_m,).into_pyobject(py)?),
            Source::Anatomy { toml, spacing_m, origin } => {
                ("anatomy", (toml, *spacing_m, origin).into_pyobject(py)?)
            }
            Source::File { bytes, path, unit } => {
                ("file", (PyBytes::new(py, bytes), path, unit).into_pyobject(py)?)
            }
        };
        Ok((py.get_type::<Self>().getattr("_restored")?, state))
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
            let model = Model(system::Model::default()).of(&body);
            let assembly = model.assemble(&body, [""; 0]).map_err(refused)?;
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

/// The model of a body: constants of the tissue and the kind of its elements.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub struct Model(pub system::Model);

/// Elements of the tissue.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Tissue {
    Springs,
    Fe,
}

/// The word for the elements of a model.
fn tissue_of(model: &system::Model) -> &'static str {
    name_of(&if model.tissue == TissueModel::MassSpring { Tissue::Springs } else { Tissue::Fe })
}

#[pymethods]
impl Model {
    /// Young's modulus (Pa) and Poisson's ratio of the tissue; the source of the springs' coefficients
    /// (`preset`: consistent or as-printed) and how connections get them (`spread`: per-connection or
    /// assembled); muscle parts outside the tissue (`outside`: straight or chain); elements of the tissue
    /// (`tissue`: springs or fe; a continuum ignores it).
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
        Ok(Self(system::Model {
            constants,
            preset: chosen("preset", preset)?,
            spread: chosen("spread", spread)?,
            outside: chosen("outside", outside)?,
            tissue: match chosen("tissue", tissue)? {
                Tissue::Springs => TissueModel::MassSpring,
                Tissue::Fe => TissueModel::FiniteElement,
            },
        }))
    }

    /// Makes `body` ready to be solved; the named muscles contract, and all others are passive tissue.
    fn assemble(&self, py: Python<'_>, body: &Body, muscles: &Bound<'_, PyAny>) -> PyResult<Assembly> {
        let muscles = given::names("muscles", muscles)?;
        let (model, from, given) = (self.of(&body.body), Arc::clone(&body.body), *self);
        let made = aside(py, move || model.assemble(&from, muscles))?.map_err(refused)?;
        Ok(Assembly(made, Arc::new((given, body.clone()))))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (f64, f64, [&'static str; 4])> {
        let model = &slf.get().0;
        let words =
            [name_of(&model.preset), name_of(&model.spread), name_of(&model.outside), tissue_of(model)];
        let state = (model.constants.young_modulus, model.constants.poisson_ratio, words);
        Ok((slf.py().get_type::<Self>().getattr("_restored")?, state))
    }

    /// The model of a pickle.
    #[staticmethod]
    fn _restored(young_modulus: f64, poisson_ratio: f64, words: [String; 4]) -> PyResult<Self> {
        let [preset, spread, outside, tissue] = &words;
        Self::new(young_modulus, poisson_ratio, preset, spread, outside, tissue)
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        let c = &self.0.constants;
        hashed(&(c.young_modulus.to_bits(), c.poisson_ratio.to_bits()))
    }

    fn __repr__(&self) -> String {
        let (model, c) = (&self.0, &self.0.constants);
        format!(
            "Model(young_modulus={:?}, poisson_ratio={:?}, preset='{}', spread='{}', outside='{}', tissue='{}')",
            c.young_modulus,
            c.poisson_ratio,
            name_of(&model.preset),
            name_of(&model.spread),
            name_of(&model.outside),
            tissue_of(model)
        )
    }
}

/// The hash of a value.
pub fn hashed(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

impl Model {
    /// The model for a body: a continuum has its own tissue.
    pub fn of(&self, body: &body::Body<2>) -> system::Model {
        match body.mesh.continuum {
            Some(_) => system::Model { tissue: TissueModel::Continuum, ..self.0 },
            None => self.0,
        }
    }
}
