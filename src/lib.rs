//! tongue-fit.

pub mod dynamics;
pub mod effect;
pub mod equilibrium;
pub mod fit;
pub mod material;
pub mod mesh;
pub mod muscle;

pub mod report;
pub mod sparse;
pub mod study;
pub mod suggest;
pub mod system;
pub mod target;
