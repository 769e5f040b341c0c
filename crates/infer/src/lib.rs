//! What follows from measurements: tensions that meet them ([`inverse`]), all tensions that they allow ([`posterior`]), tensions over
//! time ([`track`]), the body of a speaker ([`adapt`]) and what is heard of a tongue ([`heard`]).

pub mod adapt;
pub mod heard;
pub mod inverse;
pub mod posterior;
pub mod track;
