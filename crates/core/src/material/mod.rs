//! What the body is made of: its constants, the law of a continuum, and the coefficients of springs that stand for one.

mod constants;
pub mod law;
mod matching;
mod mooney_rivlin;

pub use constants::{Constants, MaterialError};
pub use law::{NeoHookean, Stress};
pub use matching::{Coefficients, MatchedCell, Preset, Spread, match_stiffness, regular_simplex};
pub use mooney_rivlin::MooneyRivlin;
