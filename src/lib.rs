//! tongue-fit.

pub mod mesh;
pub mod muscle;
pub mod report;
pub mod suggest;
