//! Materials: constants, the laws of a continuum, and the coefficients of equivalent springs.

pub mod law;
mod matching;

pub use law::{MooneyRivlin, NeoHookean, Stress};
pub use matching::{Coefficients, Model, match_stiffness, regular_simplex};
