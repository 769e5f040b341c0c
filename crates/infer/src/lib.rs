//! Inference from measurements: tensions that meet them ([`inverse`]), the posterior of tensions ([`posterior`]), tensions over time
//! ([`track`]), a speaker's body ([`adapt`]) and the sound of a tongue ([`acoustics`]).

#![allow(clippy::toplevel_ref_arg)] // in what nalgebra's `stack!` expands to

pub mod acoustics;
pub mod adapt;
pub mod error_model;
pub mod inverse;
mod least_squares;
pub mod posterior;
pub mod standard_deviations;
pub mod track;
