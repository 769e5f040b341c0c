//! The library by names of muscles and bones: a body, its contracting muscles, shapes, motions and fits. It only calls
//! [`tongue_core::system`], [`tongue_core::statics`], [`tongue_core::dynamics`] and [`tongue_infer::inverse`], so that results are the same
//! to the last bit.
//!
//! ```text
//! Assembly::new(&Model::default(), &body, ["GGa", ..])   the body ready to be solved; threads share it
//!     .solver()            -> Solver      one a thread        .equilibrium(&[("GGa", 12.0)]) -> Shape
//!     .trajectory(..)      -> the motion there, at equidistant times
//!     .stretch("GGa")      -> an observable; with what was measured an Observation
//!     InverseProblem::new(&model, observations).fit() -> Estimate    fitted tensions, bones and constants
//! ```
//! A [`SimulationError`] is a wrong name or number, reported before anything is solved. A solve, motion or fit that fails has a status that
//! says so.

mod assembly;
mod error;
mod problem;
mod shape;

pub use assembly::Assembly;
pub use error::{SimulationError, check_tension, read_tensions};
pub use problem::{Estimate, InverseProblem, Observations};
pub use shape::{Shape, Solver};
