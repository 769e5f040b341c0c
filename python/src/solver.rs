//! Equilibria and motions.

use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::report::{Export, Provenance};
use tongue_fit::simulation;

use super::answer::{points, record, to_points, word};
use super::body::Assembly;
use super::errors::{refused, wrong};

/// Tensions as they are given: by name, or an array in the order of the contracting muscles.
pub enum Tensions {
    Named(Vec<(String, f64)>),
    Listed(Vec<f64>),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Tensions {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(named) = given.cast::<PyDict>() {
            return named
                .iter()
                .map(|(name, n)| Ok((name.extract()?, n.extract()?)))
                .collect::<PyResult<_>>()
                .map(Self::Named);
        }
        if let Ok(array) = given.extract::<PyReadonlyArray1<'_, f64>>() {
            return Ok(Self::Listed(array.as_array().to_vec()));
        }
        given.extract().map(Self::Listed)
    }
}

impl Tensions {
    /// By name, for a body.
    ///
    /// # Errors
    /// A list that is not as long as there are contracting muscles.
    pub fn of(self, assembly: &simulation::Assembly<2>) -> PyResult<Vec<(String, f64)>> {
        match self {
            Self::Named(named) => Ok(named),
            Self::Listed(values) => {
                let names = assembly.contracting();
                if values.len() != names.len() {
                    let (given, known) = (values.len(), names.join(", "));
                    return Err(wrong(format!(
                        "{given} tensions are given; {} muscles contract: {known}",
                        names.len()
                    )));
                }
                Ok(names.into_iter().map(str::to_owned).zip(values).collect())
            }
        }
    }
}

/// Solves equilibria, one after another. One a thread: what it writes to is its own.
#[pyclass(module = "tongue_fit")]
pub struct Solver {
    solver: simulation::Solver<2>,
    assembly: simulation::Assembly<2>,
}

impl Solver {
    /// Of an assembly.
    pub fn new(assembly: &simulation::Assembly<2>) -> Self {
        Self { solver: assembly.solver(), assembly: assembly.clone() }
    }

    /// The rates of all nodes, for each contracting muscle.
    fn rates(&mut self, py: Python<'_>, shape: &Shape) -> PyResult<Vec<Vec<SVector<f64, 2>>>> {
        let rates = py.detach(|| self.solver.position_rates(&shape.0)).map_err(refused)?;
        rates.ok_or_else(|| {
            wrong("the shape is no stable equilibrium, so it has no derivatives by the tensions")
        })
    }
}

#[pymethods]
impl Solver {
    /// The equilibrium at these tensions (N per metre of thickness; a dict by muscle, or an array in the order of
    /// Assembly.contracting), from rest. The same bits whatever was solved before.
    fn equilibrium(&mut self, py: Python<'_>, tensions: Tensions) -> PyResult<Shape> {
        let given = tensions.of(&self.assembly)?;
        py.detach(|| self.solver.equilibrium(&borrowed(&given))).map(Shape).map_err(refused)
    }

    /// As equilibrium, from a shape that was solved before: for tensions that change little.
    fn equilibrium_from(&mut self, py: Python<'_>, start: &Shape, tensions: Tensions) -> PyResult<Shape> {
        let given = tensions.of(&self.assembly)?;
        py.detach(|| self.solver.equilibrium_from(&start.0, &borrowed(&given))).map(Shape).map_err(refused)
    }

    /// As equilibrium, and follows the equilibria from rest as the tensions grow, which tells whether the shape lies on the branch
    /// that begins at rest (Shape.is_traced). Costs about forty solves.
    fn follow_from_rest(&mut self, py: Python<'_>, tensions: Tensions) -> PyResult<Shape> {
        let given = tensions.of(&self.assembly)?;
        py.detach(|| self.solver.follow_from_rest(&borrowed(&given))).map(Shape).map_err(refused)
    }

    /// Has every later solve bring a bone to where it is at rest, and `shift` (x, y; m) from there.
    fn shift_bone(&mut self, bone: &str, shift: [f64; 2]) -> PyResult<()> {
        self.solver.shift_bone(bone, shift.into()).map_err(refused)
    }

    /// How the nodes of an equilibrium move for a unit of each tension, m per N per metre of thickness: shape (contracting muscles,
    /// nodes, 2).
    fn jacobian<'py>(&mut self, py: Python<'py>, shape: &Shape) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let rates = self.rates(py, shape)?;
        let (muscles, nodes) = (rates.len(), shape.0.positions().len());
        let flat: Vec<f64> = rates.iter().flatten().flat_map(|p| [p.x, p.y]).collect();
        PyArray1::from_vec(py, flat).reshape([muscles, nodes, 2])
    }

    /// The derivatives by the tensions (shape (contracting muscles,)) of a function whose derivatives by the positions of an
    /// equilibrium are `cotangent` (shape (nodes, 2)): the vector-Jacobian product.
    fn vjp<'py>(
        &mut self,
        py: Python<'py>,
        shape: &Shape,
        cotangent: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let along = to_points("the cotangent", &cotangent, shape.0.positions().len())?;
        let rates = self.rates(py, shape)?;
        let product =
            |motion: &Vec<SVector<f64, 2>>| motion.iter().zip(&along).map(|(m, c)| m.dot(c)).sum::<f64>();
        Ok(rates.iter().map(product).collect::<Vec<_>>().to_pyarray(py))
    }
}

fn borrowed(given: &[(String, f64)]) -> Vec<(&str, f64)> {
    given.iter().map(|(name, n)| (name.as_str(), *n)).collect()
}

/// A shape of a body under tensions.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Shape(pub simulation::Shape<2>);

#[pymethods]
impl Shape {
    /// Positions of all nodes, m, shape (nodes, 2).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.0.positions())
    }

    /// The body under these tensions.
    #[getter]
    fn assembly(&self) -> Assembly {
        Assembly(self.0.assembly().clone())
    }

    /// How the solve ended: `converged`, or why not.
    #[getter]
    fn status(&self) -> String {
        word(&self.0.solution.status)
    }

    /// Whether it is an equilibrium.
    #[getter]
    fn is_converged(&self) -> bool {
        self.0.is_converged()
    }

    /// Whether it is known to lie on the branch of equilibria that begins at rest.
    #[getter]
    fn is_traced(&self) -> bool {
        self.0.is_traced()
    }

    /// Number of elements in which the barrier against inversion acts.
    #[getter]
    fn guarded(&self) -> usize {
        self.0.guarded()
    }

    /// Newton iterations.
    #[getter]
    fn iterations(&self) -> usize {
        self.0.solution.iterations
    }

    /// Potential energy, J per metre of thickness.
    #[getter]
    fn energy_j(&self) -> f64 {
        self.0.solution.energy
    }

    /// The tension of a muscle, N per metre of thickness.
    fn tension(&self, muscle: &str) -> PyResult<f64> {
        self.0.tension(muscle).map_err(refused)
    }

    /// The length of a muscle, the straight distance between its ends, m.
    fn length(&self, muscle: &str) -> PyResult<f64> {
        self.0.length(muscle).map_err(refused)
    }

    /// The length of a muscle at rest, m.
    fn rest_length(&self, muscle: &str) -> PyResult<f64> {
        self.0.rest_length(muscle).map_err(refused)
    }

    /// The length of a muscle over its length at rest: below 1 where it shortened.
    fn stretch(&self, muscle: &str) -> PyResult<f64> {
        self.0.stretch(muscle).map_err(refused)
    }

    /// The length of a muscle over another's.
    fn ratio(&self, muscle: &str, over: &str) -> PyResult<f64> {
        self.0.ratio(muscle, over).map_err(refused)
    }

    /// What `tongue-fit simulate --json` prints, as a dict: `lengths_mm`, `ratios`, `stretches`, `positions_m`, `alarms` and so on.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let by = Provenance::new("python").with_tissue(self.0.assembly().model().tissue);
        record(py, &self.0.record(), &by)
    }

    /// A picture (SVG): the tissue at rest and deformed, and the muscles with their names.
    #[pyo3(signature = (title = "Tongue at rest (grey) and deformed"))]
    fn picture(&self, title: &str) -> PyResult<String> {
        let picture = self.0.picture(title).map_err(refused)?;
        picture.text(&Provenance::new("python")).map_err(refused)
    }

    /// Shape and tensions for ParaView (VTU).
    fn vtu(&self) -> PyResult<String> {
        self.0.vtu().map_err(refused)?.text(&Provenance::new("python")).map_err(refused)
    }

    fn __repr__(&self) -> String {
        format!("<Shape: {}, {}>", self.0.assembly().body().what, self.status())
    }
}

/// A body in motion, from rest, at even times.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Trajectory(pub simulation::Trajectory<2>);

#[pymethods]
impl Trajectory {
    /// Times, s, shape (times,).
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.times.to_pyarray(py)
    }

    /// Positions of all nodes at each of them, m, shape (times, nodes, 2).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let frames = &self.0.positions;
        let nodes = frames.first().map_or(0, Vec::len);
        let flat: Vec<f64> = frames.iter().flatten().flat_map(|p| [p.x, p.y]).collect();
        PyArray1::from_vec(py, flat).reshape([frames.len(), nodes, 2])
    }

    /// Part of its way to equilibrium that the body has gone at the end; None where there is no such way.
    #[getter]
    fn part_of_way(&self) -> Option<f64> {
        self.0.part_of_way
    }

    /// The length of a muscle at each of the times, m, shape (times,).
    fn lengths<'py>(&self, py: Python<'py>, muscle: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.0.lengths(muscle).map_err(refused)?.to_pyarray(py))
    }
}
