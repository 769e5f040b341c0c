//! Inference from measurements: tensions that meet them ([`inverse`]), the posterior of tensions ([`posterior`]), tensions over time
//! ([`track`]), a speaker's body ([`adapt`]) and the sound of a tongue ([`acoustics`]).
//!
//! Each estimate is the solution of a problem: parameters with priors, equilibria that predict the measurements, and a model of the errors.
//!
//! | problem | parameters | errors | solution |
//! |---|---|---|---|
//! | [`LeastSquaresProblem`](inverse::LeastSquaresProblem) | [`Unknown`](inverse::Unknown): tensions or activations, displaced bones, constants | standard deviation of each observation | `solve`, by [`Method`](inverse::Method): Nelder-Mead as in the thesis, or Gauss-Newton |
//! | [`PosteriorProblem`](posterior::PosteriorProblem) | [`Parameter`](posterior::Parameter): tensions in each posture and in the baseline, hyoid, its tilt | covariance: geometry, discrepancy, rounding, [`AuxiliaryData`](posterior::AuxiliaryData) | `map`: the most probable values; `posterior`: draws |
//! | [`TrackingContext`](track::TrackingContext) with recordings | levels, deviations over time, bones, shape at rest | [`ErrorModel`](error_model::ErrorModel) | `smooth`: draws for every frame |
//! | [`RegistrationData`](adapt::RegistrationData) | shift, turn and scale of a body, places of coils | standard deviations | `place` |
//!
//! All have their standard deviations from one table ([`standard_deviations`]) and one damped least-squares search (`least_squares`).
//! Whether tensions lead here from rest is decided in [`tongue_core::statics`].

#![allow(clippy::toplevel_ref_arg)] // in what nalgebra's `stack!` expands to

pub mod acoustics;
pub mod adapt;
pub mod error_model;
pub mod inverse;
mod least_squares;
pub mod posterior;
pub mod standard_deviations;
pub mod track;
