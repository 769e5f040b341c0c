//! Tables of measured lengths, and what a fit of one of their rows has to hit.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use tongue_fit::measured::{self, TargetKind, TargetOptions, Vowel};

use super::errors::{refused, wrong};

/// Measured muscle lengths by subject and vowel.
#[pyclass(frozen, module = "tongue_fit", from_py_object)]
#[derive(Clone)]
pub struct Dataset(pub measured::Dataset);

#[pymethods]
impl Dataset {
    /// The lengths of Takano and Honda (2007): eight muscles of the subjects S1 to S4.
    #[staticmethod]
    fn reference() -> PyResult<Self> {
        measured::Dataset::reference().map(Self).map_err(refused)
    }

    /// The table in a file (CSV).
    #[staticmethod]
    fn from_path(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        if path.as_os_str() == "-" {
            return Err(wrong("a table on stdin is the program's affair; give its text (Dataset.from_text)"));
        }
        py.detach(|| measured::Dataset::from_path(path)).map(Self).map_err(refused)
    }

    /// The table in a text (CSV), which messages call `origin`.
    #[staticmethod]
    #[pyo3(signature = (text, origin = "text"))]
    fn from_text(py: Python<'_>, text: &str, origin: &str) -> PyResult<Self> {
        py.detach(|| measured::Dataset::from_reader(text.as_bytes(), origin)).map(Self).map_err(refused)
    }

    /// The same lengths with `mm` for the half width of the rounding of them all.
    fn with_half_width_mm(&self, mm: f64) -> PyResult<Self> {
        self.0.clone().with_half_width_mm(mm).map(Self).map_err(refused)
    }

    /// Where the data came from.
    #[getter]
    fn origin(&self) -> &str {
        self.0.origin()
    }

    /// The muscles, in the order of their columns.
    #[getter]
    fn muscles(&self) -> Vec<String> {
        self.0.muscles().to_vec()
    }

    /// The subjects, in the order of their first rows.
    #[getter]
    fn subjects(&self) -> Vec<&str> {
        self.0.subjects()
    }

    /// Subject and vowel of every row, in the order of the table.
    #[getter]
    fn rows(&self) -> Vec<(String, String)> {
        let row =
            |r: &measured::lengths::Row| (r.lengths.subject.clone(), r.lengths.vowel.label().to_owned());
        self.0.rows().iter().map(row).collect()
    }

    /// The lengths, mm, shape (rows, muscles); not a number where nothing was measured.
    #[getter]
    fn lengths_mm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let lengths =
            self.0.rows().iter().flat_map(|r| r.lengths.length_mm.iter().map(|l| l.unwrap_or(f64::NAN)));
        PyArray1::from_iter(py, lengths).reshape([self.0.rows().len(), self.0.muscles().len()])
    }

    /// What is wrong with the rows that cannot be used.
    #[getter]
    fn broken(&self) -> Vec<String> {
        self.0.broken().iter().map(|row| row.fault.to_string()).collect()
    }

    /// The vowels of a subject, in the order of the table.
    fn vowels(&self, subject: &str) -> PyResult<Vec<String>> {
        let vowels = self.0.vowels(subject).map_err(refused)?;
        Ok(vowels.iter().map(|v| v.label().to_owned()).collect())
    }

    /// What a fit of ratios to GGa has to hit; `muscles` contract in place of those that are shorter than in the baseline.
    #[pyo3(signature = (subject, vowel, *, muscles = None, baseline = None))]
    fn ratios(
        &self,
        subject: &str,
        vowel: &str,
        muscles: Option<Vec<String>>,
        baseline: Option<&str>,
    ) -> PyResult<Target> {
        target(&self.0, subject, vowel, TargetKind::Ratio, muscles, baseline)
    }

    /// What a fit of lengths over those in the baseline has to hit.
    #[pyo3(signature = (subject, vowel, *, muscles = None, baseline = None))]
    fn stretches(
        &self,
        subject: &str,
        vowel: &str,
        muscles: Option<Vec<String>>,
        baseline: Option<&str>,
    ) -> PyResult<Target> {
        target(&self.0, subject, vowel, TargetKind::Stretch, muscles, baseline)
    }

    fn __len__(&self) -> usize {
        self.0.rows().len()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Dataset: {}, {} rows, {}>",
            self.0.origin(),
            self.0.rows().len(),
            self.0.muscles().join(", ")
        )
    }
}

/// What a fit of one row has to hit.
///
/// # Errors
/// As the library's.
pub fn target(
    data: &measured::Dataset,
    subject: &str,
    vowel: &str,
    kind: TargetKind,
    muscles: Option<Vec<String>>,
    baseline: Option<&str>,
) -> PyResult<Target> {
    let vowel: Vowel = vowel.parse().map_err(refused)?;
    let baseline = baseline.map(str::parse).transpose().map_err(refused)?;
    let options = TargetOptions { muscles, baseline };
    measured::Target::new(data, subject, &vowel, kind, &options).map(Target).map_err(refused)
}

/// What a fit has to hit, made from one measured row and its baseline.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Target(pub measured::Target);

#[pymethods]
impl Target {
    /// The subject.
    #[getter]
    fn subject(&self) -> &str {
        &self.0.subject
    }

    /// The vowel.
    #[getter]
    fn vowel(&self) -> &str {
        self.0.vowel.label()
    }

    /// The vowel it is compared with.
    #[getter]
    fn baseline(&self) -> &str {
        self.0.baseline.label()
    }

    /// `ratio` or `stretch`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind.name()
    }

    /// The muscles measured in both rows: the order of `values`.
    #[getter]
    fn muscles(&self) -> Vec<String> {
        self.0.muscles.clone()
    }

    /// The muscles that contract.
    #[getter]
    fn active(&self) -> Vec<&str> {
        self.0.active_names()
    }

    /// The measured quantity of all muscles, dimensionless, shape (muscles,).
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.values.to_pyarray(py)
    }

    fn __repr__(&self) -> String {
        let t = &self.0;
        format!("<Target: {} /{}/ {}, active {}>", t.subject, t.vowel, t.kind, t.active_names().join(", "))
    }
}
