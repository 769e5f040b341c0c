//! Inference from measurements: tensions that meet them ([`inverse`]), the posterior of tensions ([`posterior`]), tensions over time
//! ([`track`]), a speaker's body ([`adapt`]) and the sound of a tongue ([`acoustics`]).

pub mod acoustics;
pub mod adapt;
pub mod error_model;
pub mod inverse;
mod least_squares;
pub mod posterior;
pub mod standard_deviations;
pub mod track;
