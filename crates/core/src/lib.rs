//! The physics of tongue-fit, in the midsagittal plane (`D = 2`) and in space (`D = 3`): bodies, materials, effects, equilibria, motion,
//! and observables. All numbers are in SI units. The crate reads and writes no files.

pub mod body;
pub mod choice;
pub mod dynamics;
pub mod effect;
pub mod geometry;
#[doc(hidden)]
pub mod instances;
pub mod limits;
pub mod material;
pub mod observe;
pub mod parallel;
pub mod random;
pub mod sparse;
pub mod statics;
pub mod statistics;
pub mod system;
pub mod toml_text;
