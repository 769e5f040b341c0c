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
//!
//! # Example
//! ```
//! use tongue_core::{body::Body, observe::Observation, system::Model};
//! use tongue_files::simulation::{Assemble, InverseProblem};
//!
//! let body = Body::tongue(5.5e-3)?;
//! let model = Model::default().assemble(&body, ["GGa", "HGa"])?;
//! let shape = model.solver().equilibrium(&[("GGa", 12.0), ("HGa", 4.5)])?;
//! // Both lengths as measured to 1 mm, with the hyoid at its place at rest to within 2 mm:
//! let observations: Vec<_> = ["GGa", "HGa"].into_iter()
//!     .map(|name| {
//!         let seen = Observation::new(model.length(name)?, shape.length(name)?);
//!         Ok(seen.with_standard_deviation(0.3e-3))
//!     })
//!     .collect::<Result<_, Box<dyn std::error::Error>>>()?;
//! let estimate = InverseProblem::new(&model, observations)
//!     .free_bone("hyoid", 10e-3)?
//!     .with_bone_prior("hyoid", 2e-3)?
//!     .fit()?;
//! assert!((estimate.tension("GGa")? - 12.0).abs() < 0.5);
//! assert_eq!(
//!     model.solver().equilibrium(&[("GGaa", 12.0)]).unwrap_err().to_string(),
//!     "there is no muscle \"GGaa\" in this body; did you mean \"GGa\"? \
//!      (known: GGa, GGm, GGp, SGp, SGm, SGa, HGa, HGp)"
//! );
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assembly;
mod error;
mod estimate;
mod problem;
mod shape;
mod solver;
mod trajectory;
mod words;

pub use assembly::{Assemble, Assembly};
pub use error::{SimulationError, check_tension};
pub use estimate::Estimate;
pub use problem::{InverseProblem, Observations};
pub use shape::Shape;
pub use solver::Solver;
pub use trajectory::Trajectory;
pub use words::{BadTension, read_tensions};
