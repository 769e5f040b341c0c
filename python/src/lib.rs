//! tongue-fit for Python: a thin layer over the library's [`tongue_fit::simulation`], [`tongue_fit::inverse`]
//! and [`tongue_fit::measured`]. It computes nothing itself; names and units are those of Rust, arrays are
//! numpy's, and an error of the library is an exception with the same text.

mod answer;
mod assembly;
mod body;
mod errors;
mod fit;
mod given;
mod measured;
mod observe;
mod problem;
mod program;
mod solver;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _tongue_fit {
    #[pymodule_export]
    use super::assembly::{Assembly, Model};
    #[pymodule_export]
    use super::body::Body;
    #[pymodule_export]
    use super::errors::Error;
    #[pymodule_export]
    use super::fit::{fit_row, fit_rows};
    #[pymodule_export]
    use super::measured::{Dataset, Target};
    #[pymodule_export]
    use super::observe::{Observable, Observation};
    #[pymodule_export]
    use super::problem::{Estimate, InverseProblem};
    #[pymodule_export]
    use super::program::{call_program, run_program};
    #[pymodule_export]
    use super::solver::{Shape, Solver, Trajectory};

    use super::{Bound, PyModule, PyModuleMethods, PyResult};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERSION", tongue_fit::VERSION)
    }
}
