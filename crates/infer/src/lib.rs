//! What follows from measurements: tensions that meet them ([`inverse`]), all tensions that they allow ([`posterior`]), tensions over
//! time ([`track`]) and the body of a speaker ([`adapt`]).

pub mod adapt;
pub mod inverse;
pub mod posterior;
pub mod track;
