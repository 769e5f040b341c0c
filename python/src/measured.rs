//! Tables of measured lengths, and the targets of fits.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tongue_fit::measured::{self, TargetKind, TargetOptions, Vowel};

use super::answer::{Pickled, hashed};
use super::errors::{refused, warn, wrong};
use super::given;
use super::work::alone;

/// Measured muscle lengths by subject and vowel.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Dataset {
    pub data: Arc<measured::Dataset>,
    /// The bytes of the table and the half width given for it, mm, which are stored in a pickle.
    source: Arc<(Vec<u8>, Option<f64>)>,
}

impl PartialEq for Dataset {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.data, &other.data) || self.data == other.data
    }
}

impl Dataset {
    fn read(table: Vec<u8>, origin: &str, half_width_mm: Option<f64>) -> PyResult<Self> {
        let data = measured::Dataset::from_reader(table.as_slice(), origin).map_err(refused)?;
        let data = match half_width_mm {
            Some(mm) => data.with_half_width_mm(mm).map_err(refused)?,
            None => data,
        };
        Ok(Self { data: Arc::new(data), source: Arc::new((table, half_width_mm)) })
    }

    /// Warns of rows and cells that are left out.
    fn warned(self, py: Python<'_>) -> PyResult<Self> {
        let left_out = self.data.left_out();
        if !left_out.is_empty() {
            warn(py, &format!("{}: {}", self.data.origin, left_out.join("; ")))?;
        }
        Ok(self)
    }
}

#[pymethods]
impl Dataset {
    /// The lengths of Takano and Honda (2007): eight muscles of the subjects S1 to S4.
    #[staticmethod]
    fn reference() -> PyResult<Self> {
        let data = Arc::new(measured::Dataset::reference().map_err(refused)?);
        // Empty bytes stand for the built-in table.
        Ok(Self { data, source: Arc::new((Vec::new(), None)) })
    }

    /// The table in the file `path` (CSV).
    #[staticmethod]
    fn from_path(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        if path.as_os_str() == "-" {
            return Err(wrong("a table cannot be read from stdin here; give its text (Dataset.from_text)"));
        }
        alone(py, move || {
            let data = measured::Dataset::from_path(&path).map_err(refused)?;
            let table = tongue_fit::files::read(&path).map_err(refused)?;
            Ok(Self { data: Arc::new(data), source: Arc::new((table, None)) })
        })?
        .and_then(|read: Self| read.warned(py))
    }

    /// The table in a text (CSV); `origin` is its name in messages.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "text"))]
    fn from_text(py: Python<'_>, text: String, origin: &str) -> PyResult<Self> {
        let origin = origin.to_owned();
        alone(py, move || Self::read(text.into_bytes(), &origin, None))?.and_then(|read| read.warned(py))
    }

    /// The same lengths with the half width `mm` of rounding for all of them.
    fn with_half_width_mm(&self, mm: f64) -> PyResult<Self> {
        let data = self.data.as_ref().clone().with_half_width_mm(mm).map_err(refused)?;
        Ok(Self { data: Arc::new(data), source: Arc::new((self.source.0.clone(), Some(mm))) })
    }

    /// The table of a pickle.
    #[staticmethod]
    fn _restored(
        py: Python<'_>,
        table: Vec<u8>,
        origin: String,
        half_width_mm: Option<f64>,
    ) -> PyResult<Self> {
        if table.is_empty() {
            let data = Self::reference()?;
            return half_width_mm.map_or(Ok(data.clone()), |mm| data.with_half_width_mm(mm));
        }
        alone(py, move || Self::read(table, &origin, half_width_mm))?
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Pickled<'py, (Bound<'py, PyBytes>, String, Option<f64>)> {
        let (py, this) = (slf.py(), slf.get());
        let state = (PyBytes::new(py, &this.source.0), this.data.origin.clone(), this.source.1);
        Ok((py.get_type::<Self>().getattr("_restored")?, state))
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        hashed(&(&self.data.origin, self.data.rows.len()))
    }

    /// The table, for notebooks.
    fn _repr_html_(&self) -> String {
        let cell = |tag: &str, text: &str| format!("<{tag}>{}</{tag}>", escaped(text));
        let heads = self.data.muscles.iter().map(|m| cell("th", &format!("{m}, mm")));
        let mut table =
            format!("<table><tr><th>subject</th><th>vowel</th>{}</tr>", heads.collect::<String>());
        let rows = &self.data.rows;
        for row in rows.iter().take(MOST_SHOWN) {
            let lengths = row.lengths.length_mm.iter();
            let lengths = lengths.map(|l| cell("td", &l.map_or_else(String::new, |mm| mm.to_string())));
            let (subject, vowel) = (cell("td", &row.lengths.subject), cell("td", row.lengths.vowel.label()));
            table += &format!("<tr>{subject}{vowel}{}</tr>", lengths.collect::<String>());
        }
        table += "</table>";
        if rows.len() > MOST_SHOWN {
            table += &format!("<p>and {} more rows</p>", rows.len() - MOST_SHOWN);
        }
        table
    }

    /// The origin of the data.
    #[getter]
    fn origin(&self) -> &str {
        &self.data.origin
    }

    /// The muscles, in the order of their columns.
    #[getter]
    fn muscles(&self) -> Vec<String> {
        self.data.muscles.to_vec()
    }

    /// The subjects, in the order of their first rows.
    #[getter]
    fn subjects(&self) -> Vec<&str> {
        self.data.subjects()
    }

    /// Subject and vowel of every row, in the order of the table.
    #[getter]
    fn rows(&self) -> Vec<(String, String)> {
        let row =
            |r: &measured::lengths::Row| (r.lengths.subject.clone(), r.lengths.vowel.label().to_owned());
        self.data.rows.iter().map(row).collect()
    }

    /// The lengths, mm, shape (rows, muscles); NaN for missing values.
    #[getter]
    fn lengths_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let lengths =
            self.data.rows.iter().flat_map(|r| r.lengths.length_mm.iter().map(|l| l.unwrap_or(f64::NAN)));
        PyArray1::from_iter(py, lengths).reshape([self.data.rows.len(), self.data.muscles.len()])
    }

    /// The faults of the rows and cells that cannot be used.
    #[getter]
    fn broken(&self) -> Vec<String> {
        self.data.left_out()
    }

    /// The vowels of a subject, in the order of the table.
    fn vowels(&self, subject: &str) -> PyResult<Vec<String>> {
        let vowels = self.data.vowels(subject).map_err(refused)?;
        Ok(vowels.iter().map(|v| v.label().to_owned()).collect())
    }

    /// The target of a fit of the ratios to GGa of a row.
    ///
    /// Parameters
    /// ----------
    /// subject : str
    ///     Subject of the row.
    /// vowel : str
    ///     Vowel of the row.
    /// muscles : sequence of str, optional
    ///     Muscles that contract (default: those shorter than in the baseline).
    /// baseline : str, optional
    ///     The vowel that is compared with (default: ɯ).
    #[pyo3(signature = (subject, vowel, *, muscles = None, baseline = None))]
    fn ratios(
        &self,
        subject: &str,
        vowel: &str,
        muscles: Option<&Bound<'_, PyAny>>,
        baseline: Option<&str>,
    ) -> PyResult<Target> {
        target(self, subject, vowel, TargetKind::Ratio, muscles, baseline)
    }

    /// The target of a fit of lengths over those in the baseline.
    ///
    /// Parameters
    /// ----------
    /// subject : str
    ///     Subject of the row.
    /// vowel : str
    ///     Vowel of the row.
    /// muscles : sequence of str, optional
    ///     Muscles that contract (default: those shorter than in the baseline).
    /// baseline : str, optional
    ///     The vowel that is compared with (default: ɯ).
    #[pyo3(signature = (subject, vowel, *, muscles = None, baseline = None))]
    fn stretches(
        &self,
        subject: &str,
        vowel: &str,
        muscles: Option<&Bound<'_, PyAny>>,
        baseline: Option<&str>,
    ) -> PyResult<Target> {
        target(self, subject, vowel, TargetKind::Stretch, muscles, baseline)
    }

    /// The target of `kind`, for a pickle.
    fn _target(
        &self,
        kind: &str,
        subject: &str,
        vowel: &str,
        muscles: Option<&Bound<'_, PyAny>>,
        baseline: Option<&str>,
    ) -> PyResult<Target> {
        target(self, subject, vowel, kind.parse().map_err(refused)?, muscles, baseline)
    }

    fn __len__(&self) -> usize {
        self.data.rows.len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Dataset: {}, {} rows, {}>",
            self.data.origin,
            self.data.rows.len(),
            self.data.muscles.join(", ")
        )
    }
}

pub fn target(
    data: &Dataset,
    subject: &str,
    vowel: &str,
    kind: TargetKind,
    muscles: Option<&Bound<'_, PyAny>>,
    baseline: Option<&str>,
) -> PyResult<Target> {
    let asked: Vowel = vowel.parse().map_err(refused)?;
    let muscles = muscles.map(|m| given::names("muscles", m)).transpose()?;
    let given = (muscles.clone(), baseline.map(str::to_owned));
    let baseline = baseline.map(str::parse).transpose().map_err(refused)?;
    let options = TargetOptions { muscles, baseline };
    let target = measured::Target::new(&data.data, subject, &asked, kind, &options).map_err(refused)?;
    Ok(Target { target: Arc::new(target), data: data.clone(), given: Arc::new(given) })
}

/// Maximum number of rows in a notebook.
const MOST_SHOWN: usize = 60;

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The target of a fit, made from one measured row and its baseline.
#[pyclass(frozen, eq, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Target {
    pub target: Arc<measured::Target>,
    data: Dataset,
    /// The muscles and the baseline that were given.
    given: Arc<(Option<Vec<String>>, Option<String>)>,
}

impl PartialEq for Target {
    fn eq(&self, other: &Self) -> bool {
        self.target == other.target
    }
}

impl Target {
    pub fn description(&self) -> String {
        let t = &self.target;
        format!("{} /{}/ {}, active {}", t.subject, t.vowel, t.kind, t.active_names().join(", "))
    }
}

#[pymethods]
impl Target {
    /// The subject.
    #[getter]
    fn subject(&self) -> &str {
        &self.target.subject
    }

    /// The vowel.
    #[getter]
    fn vowel(&self) -> &str {
        self.target.vowel.label()
    }

    /// The vowel it is compared with.
    #[getter]
    fn baseline(&self) -> &str {
        self.target.baseline.label()
    }

    /// `ratio` or `stretch`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.target.kind.name()
    }

    /// The muscles measured in both rows: the order of `values`.
    #[getter]
    fn muscles(&self) -> Vec<String> {
        self.target.muscles.clone()
    }

    /// The muscles that contract.
    #[getter]
    fn active(&self) -> Vec<&str> {
        self.target.active_names()
    }

    /// The measured quantity of all muscles, dimensionless, shape (muscles,).
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.target.values.to_pyarray(py)
    }

    #[allow(clippy::type_complexity, reason = "what pickle calls, and with what")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> Pickled<'py, (&'static str, String, String, Option<Vec<String>>, Option<String>)> {
        let this = slf.get();
        let (t, (muscles, baseline)) = (&this.target, &*this.given);
        let vowel = t.vowel.label().to_owned();
        let state = (t.kind.name(), t.subject.clone(), vowel, muscles.clone(), baseline.clone());
        Ok((this.data.clone().into_pyobject(slf.py())?.getattr("_target")?, state))
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __hash__(&self) -> u64 {
        hashed(&(&self.target.subject, self.target.vowel.label()))
    }

    fn __repr__(&self) -> String {
        format!("<Target: {}>", self.description())
    }
}
