//! tongue-fit.

pub mod mesh;
pub mod muscle;
pub mod suggest;
pub mod target;
