//! The library by names of muscles and bones: a body, its contracting muscles, shapes, motions and fits. This
//! layer uses no numbers of nodes or muscles and computes nothing itself: it calls [`tongue_core::system`],
//! [`tongue_core::statics`], [`tongue_core::dynamics`] and [`tongue_infer::inverse`] with the same results to
//! the last bit.
//!
//! ```text
//! Model::default().assemble(&body, ["GGa", ..]) -> Assembly   the body ready to be solved; threads share it
//!     .solver()            -> Solver      one a thread        .equilibrium(&[("GGa", 12.0)]) -> Shape
//!     .trajectory(..)      -> Trajectory  the motion there
//!     .stretch("GGa")      -> an observable; with what was measured an Observation
//!     InverseProblem::new(&model, observations).fit() -> Estimate    fitted tensions, bones and constants
//! ```
//! An [`SimulationError`] is a wrong name or number, reported before anything is solved. A failure of a solve, motion
//! or fit is a status of its result.

mod assembly;
mod error;
mod estimate;
mod problem;
mod shape;
mod solver;

pub use assembly::{Assemble, Assembly};
pub use error::{SimulationError, check_tension, read_tensions};
pub use estimate::Estimate;
pub use problem::{InverseProblem, Observations};
pub use shape::{Shape, Trajectory};
pub use solver::Solver;
