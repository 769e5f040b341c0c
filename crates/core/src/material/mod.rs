//! Materials: constants, the laws of a continuum, and the coefficients of equivalent springs.

mod constants;
pub mod law;
mod matching;
mod mooney_rivlin;

pub use constants::Constants;
pub use law::{NeoHookean, Stress};
pub use matching::{Coefficients, MatchedCell, match_stiffness, regular_simplex};
pub use mooney_rivlin::MooneyRivlin;
