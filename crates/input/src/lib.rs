//! Inputs of tongue-fit: measured muscle lengths, recordings of moving tongues and targets made from them
//! ([`measured`]), bodies from mesh files ([`bodies`]) and tensions over time ([`curves`]).

pub mod bodies;
pub mod curves;
pub mod files;
pub mod measured;
