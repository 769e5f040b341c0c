//! Equilibria and motions.

use std::sync::{Arc, Mutex, TryLockError};

use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tongue_fit::report::{Export, Provenance};
use tongue_fit::run::SampledMotion;
use tongue_fit::simulation;
use tongue_fit::system::TissueModel;

use super::answer::{points, record, word};
use super::assembly::Assembly;
use super::errors::{refused, wrong};
use super::given::{self, Given};
use super::work::{alone, aside};

/// The argument `tensions`: by name, or in the order of the contracting muscles.
pub struct Tensions(Given);

impl<'a, 'py> FromPyObject<'a, 'py> for Tensions {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Given::read("tensions", &given).map(Self)
    }
}

impl Tensions {
    /// # Errors
    /// A list whose length is not the number of contracting muscles.
    pub fn by_name(self, assembly: &simulation::Assembly<2>) -> PyResult<Vec<(String, f64)>> {
        match self.0 {
            Given::Named(named) => Ok(named),
            Given::Listed(values) => {
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

/// A body with at most this number of nodes is solved on the calling thread, because the solve ends before Ctrl-C matters and takes less
/// time than starting a thread.
const QUICK_NODES: usize = 400;
/// Largest tension for which that holds, N per metre of thickness: a hundred times that of muscles. Beyond it Newton's method can take
/// thousands of steps.
const QUICK_TENSION: f64 = 1e5;

#[pymethods]
impl Assembly {
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
        let (assembly, given) = (self.0.clone(), tensions.by_name(&self.0)?);
        let followed = aside(py, move || {
            let given: Vec<(&str, f64)> = given.iter().map(|(name, n)| (name.as_str(), *n)).collect();
            assembly.trajectory(&given, ramp_s, t_end_s, samples)
        })?;
        Ok(Trajectory { assembly: self.0.clone(), sampled: followed.map_err(refused)? })
    }
}

/// Solves equilibria, one after another. Each thread needs its own, because a solve writes to it.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Solver {
    assembly: Assembly,
    work: Mutex<SolverMemory>,
}

struct SolverMemory {
    /// None after a solve that Ctrl-C ended; the next solve makes a new one.
    solver: Option<simulation::Solver<2>>,
    /// Displacements of bones.
    shifts: Vec<(String, SVector<f64, 2>)>,
}

impl Solver {
    pub fn new(assembly: &Assembly) -> Self {
        let work = SolverMemory { solver: Some(assembly.0.solver()), shifts: Vec::new() };
        Self { assembly: assembly.clone(), work: Mutex::new(work) }
    }

    /// Runs `solve` without Python's lock: on this thread if it is quick, otherwise on another one, so that Ctrl-C ends the wait.
    ///
    /// # Errors
    /// A solver in use by another thread; `KeyboardInterrupt`.
    fn solve<T: Send + 'static>(
        &self,
        py: Python<'_>,
        is_long: bool,
        solve: impl FnOnce(&mut simulation::Solver<2>) -> Result<T, simulation::SimulationError> + Send + 'static,
    ) -> PyResult<T> {
        let mut work = match self.work.try_lock() {
            Ok(work) => work,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                return Err(wrong(
                    "this Solver is at work in another thread; give each thread its own: assembly.solver()",
                ));
            }
        };
        let mut solver = match work.solver.take() {
            Some(solver) => solver,
            None => {
                let mut solver = self.assembly.0.solver();
                let mut shifts = work.shifts.iter();
                shifts.try_for_each(|(bone, shift)| solver.shift_bone(bone, *shift)).map_err(refused)?;
                solver
            }
        };
        let is_quick = !is_long && self.assembly.0.body.mesh.nodes.len() <= QUICK_NODES;
        let (solved, solver) = if is_quick {
            let solved = py.detach(|| solve(&mut solver));
            (solved, solver)
        } else {
            alone(py, move || {
                let solved = solve(&mut solver);
                (solved, solver)
            })?
        };
        work.solver = Some(solver);
        solved.map_err(refused)
    }

    fn shape(&self, shape: simulation::Shape<2>) -> Shape {
        Shape { shape: Arc::new(shape), assembly: self.assembly.clone() }
    }

    /// Derivatives of the positions of all nodes by the tension of each contracting muscle.
    fn rates(&self, py: Python<'_>, shape: &Shape) -> PyResult<Vec<Vec<SVector<f64, 2>>>> {
        let shape = Arc::clone(&shape.shape);
        let rates = self.solve(py, false, move |solver| solver.position_rates(&shape))?;
        rates.ok_or_else(|| {
            wrong("the shape is no stable equilibrium, so it has no derivatives by the tensions")
        })
    }
}

#[pymethods]
impl Solver {
    /// The equilibrium at these tensions (N per metre of thickness; by muscle, or in the order of
    /// Assembly.contracting), from rest. The result does not depend on earlier solves.
    fn equilibrium(&self, py: Python<'_>, tensions: Tensions) -> PyResult<Shape> {
        let given = tensions.by_name(&self.assembly.0)?;
        let solved = self.solve(py, is_long(&given), move |solver| solver.equilibrium(&borrowed(&given)))?;
        Ok(self.shape(solved))
    }

    /// The equilibrium at these tensions, found from the earlier shape `start`, which is faster for small changes of the tensions.
    fn equilibrium_from(&self, py: Python<'_>, start: &Shape, tensions: Tensions) -> PyResult<Shape> {
        let (given, start) = (tensions.by_name(&self.assembly.0)?, Arc::clone(&start.shape));
        let solved = self
            .solve(py, is_long(&given), move |solver| solver.equilibrium_from(&start, &borrowed(&given)))?;
        Ok(self.shape(solved))
    }

    /// The equilibrium at these tensions. The branch from rest is followed, too, to check that the shape lies on it (Shape.is_traced).
    /// Costs about twenty solves, or some 120 more where that branch ends.
    fn follow_from_rest(&self, py: Python<'_>, tensions: Tensions) -> PyResult<Shape> {
        let given = tensions.by_name(&self.assembly.0)?;
        let solved = self.solve(py, true, move |solver| solver.follow_from_rest(&borrowed(&given)))?;
        Ok(self.shape(solved))
    }

    /// Displaces a bone by `shift` (x, y; m) from its place at rest in all later solves.
    fn shift_bone(&self, py: Python<'_>, bone: String, shift: &Bound<'_, PyAny>) -> PyResult<()> {
        let shift = Given::pair("shift", shift)?;
        let name = bone.clone();
        self.solve(py, false, move |solver| solver.shift_bone(&name, shift))?;
        if let Ok(mut work) = self.work.try_lock() {
            work.shifts.push((bone, shift));
        }
        Ok(())
    }

    /// Derivatives of the positions of the nodes of an equilibrium by each tension, m per N per metre of
    /// thickness: shape (contracting muscles, nodes, 2).
    fn jacobian<'py>(&self, py: Python<'py>, shape: &Shape) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let rates = self.rates(py, shape)?;
        let (muscles, nodes) = (rates.len(), shape.shape.positions().len());
        let flat: Vec<f64> = rates.iter().flatten().flat_map(|p| [p.x, p.y]).collect();
        PyArray1::from_vec(py, flat).reshape([muscles, nodes, 2])
    }

    /// The derivatives by the tensions (shape (contracting muscles,)) of a function whose derivatives by the
    /// positions of an equilibrium are `cotangent` (shape (nodes, 2)): the vector-Jacobian product.
    fn vjp<'py>(
        &self,
        py: Python<'py>,
        shape: &Shape,
        cotangent: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let along = given::points("cotangent", cotangent, shape.shape.positions().len())?;
        let rates = self.rates(py, shape)?;
        let product =
            |motion: &Vec<SVector<f64, 2>>| motion.iter().zip(&along).map(|(m, c)| m.dot(c)).sum::<f64>();
        Ok(rates.iter().map(product).collect::<Vec<_>>().to_pyarray(py))
    }
}

/// Whether a solve at these tensions can take long on any body.
fn is_long(given: &[(String, f64)]) -> bool {
    given.iter().any(|(_, n)| *n > QUICK_TENSION)
}

fn borrowed(given: &[(String, f64)]) -> Vec<(&str, f64)> {
    given.iter().map(|(name, n)| (name.as_str(), *n)).collect()
}

/// A shape of a body under tensions.
#[pyclass(frozen, module = "tongue_fit")]
#[derive(Clone)]
pub struct Shape {
    pub shape: Arc<simulation::Shape<2>>,
    pub assembly: Assembly,
}

#[pymethods]
impl Shape {
    /// Positions of all nodes, m, shape (nodes, 2).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.shape.positions())
    }

    /// The assembly of the shape.
    #[getter]
    fn assembly(&self) -> Assembly {
        self.assembly.clone()
    }

    /// How the solve ended: `converged`, or the reason why not.
    #[getter]
    fn status(&self) -> String {
        word(&self.shape.solved.equilibrium.solution.status)
    }

    /// Whether it is an equilibrium.
    #[getter]
    fn is_converged(&self) -> bool {
        self.shape.is_converged()
    }

    /// Whether the shape is known to lie on the branch of equilibria from rest.
    #[getter]
    fn is_traced(&self) -> bool {
        self.shape.is_traced()
    }

    /// Number of elements in which the barrier against inversion acts.
    #[getter]
    fn guarded(&self) -> usize {
        self.shape.solved.equilibrium.solution.guarded
    }

    /// Newton iterations.
    #[getter]
    fn iterations(&self) -> usize {
        self.shape.solved.equilibrium.solution.iterations
    }

    /// Potential energy, J per metre of thickness.
    #[getter]
    fn energy_j(&self) -> f64 {
        self.shape.solved.equilibrium.solution.energy
    }

    /// The tension of a muscle, N per metre of thickness.
    fn tension(&self, muscle: &str) -> PyResult<f64> {
        self.shape.tension(muscle).map_err(refused)
    }

    /// The length of a muscle, the straight distance between its ends, m.
    fn length(&self, muscle: &str) -> PyResult<f64> {
        self.shape.length(muscle).map_err(refused)
    }

    /// The length of a muscle at rest, m.
    fn rest_length(&self, muscle: &str) -> PyResult<f64> {
        self.shape.rest_length(muscle).map_err(refused)
    }

    /// The length of a muscle over its length at rest: below 1 if it shortened.
    fn stretch(&self, muscle: &str) -> PyResult<f64> {
        self.shape.stretch(muscle).map_err(refused)
    }

    /// The length of a muscle over another's.
    fn ratio(&self, muscle: &str, over: &str) -> PyResult<f64> {
        self.shape.ratio(muscle, over).map_err(refused)
    }

    /// The output of `tongue-fit simulate --json` as a dict: `lengths_mm`, `ratios`, `stretches`,
    /// `positions_m`, `alarms` and so on.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let by = Provenance::new("python").with_tissue(TissueModel::of(&self.shape.assembly.body.mesh));
        record(py, &self.shape.record(), &by)
    }

    /// A picture (SVG) with a `title`: the tissue at rest and deformed, and the muscles with their names.
    #[pyo3(signature = (title = "Tongue at rest (grey) and deformed"))]
    pub fn picture(&self, title: &str) -> PyResult<String> {
        let picture = self.shape.picture(title).map_err(refused)?;
        picture.text(&Provenance::new("python")).map_err(refused)
    }

    /// Shape and tensions for ParaView (VTU).
    fn vtu(&self) -> PyResult<String> {
        self.shape.vtu().map_err(refused)?.text(&Provenance::new("python")).map_err(refused)
    }

    /// The picture, for notebooks.
    fn _repr_svg_(&self) -> PyResult<String> {
        self.picture("Tongue at rest (grey) and deformed")
    }

    fn __repr__(&self) -> String {
        format!("<Shape: {}, {}>", self.shape.assembly.body.what, self.status())
    }
}

/// The motion of a body from rest, at equidistant times.
#[pyclass(frozen, module = "tongue_fit")]
pub struct Trajectory {
    assembly: simulation::Assembly<2>,
    sampled: SampledMotion<2>,
}

#[pymethods]
impl Trajectory {
    /// Times, s, shape (times,).
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.sampled.shapes.iter().map(|(time, _)| *time).collect::<Vec<_>>().to_pyarray(py)
    }

    /// Positions of all nodes at each time, m, shape (times, nodes, 2).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let frames = &self.sampled.shapes;
        let nodes = frames.first().map_or(0, |(_, positions)| positions.len());
        let flat: Vec<f64> =
            frames.iter().flat_map(|(_, positions)| positions).flat_map(|p| [p.x, p.y]).collect();
        PyArray1::from_vec(py, flat).reshape([frames.len(), nodes, 2])
    }

    /// Part of the way to equilibrium that the body has moved at the end; None if the way is not known.
    #[getter]
    fn part_of_way(&self) -> Option<f64> {
        self.sampled.part_of_way
    }

    /// The length of a muscle at each of the times, m, shape (times,).
    fn lengths<'py>(&self, py: Python<'py>, muscle: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        // A motion without frames checks the name, too.
        self.assembly.mean_length(muscle, self.assembly.system.rest()).map_err(refused)?;
        let frames = self.sampled.shapes.iter();
        let lengths = frames.map(|(_, positions)| self.assembly.mean_length(muscle, positions));
        Ok(lengths.collect::<Result<Vec<_>, _>>().map_err(refused)?.to_pyarray(py))
    }
}
