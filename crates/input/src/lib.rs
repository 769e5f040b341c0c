//! Inputs of tongue-fit: measured muscle lengths, recordings of moving tongues, targets made from them and tensions
//! over time ([`measured`]), and bodies from mesh files ([`bodies`]).

pub mod bodies;
pub mod files;
pub mod measured;
