//! Inputs of tongue-fit: measured lengths, recordings, targets and tension curves ([`measured`]), and bodies from mesh files ([`bodies`]).

pub mod bodies;
pub mod files;
pub mod measured;
