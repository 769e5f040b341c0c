//! The sound of a vocal tract: from its walls in the midsagittal plane to areas, formants and a voice.
//!
//! | step | here | source |
//! |---|---|---|
//! | walls to areas | [`profile`] | Heinz and Stevens 1965; Mermelstein 1973; Maeda 1979 |
//! | areas to transfer function | [`chain`] | Flanagan 1972, chapter 3; Sondhi and Schroeter 1987 |
//! | formants, bandwidths and their exact rates | [`formants`] | poles of the transfer function |
//! | a voice that is heard | [`voice`] | Klatt 1980; Klatt and Klatt 1990 |
//!
//! Everything is in SI units: m, m^2, Hz, s, Pa. The crate has no tongue, muscles or files.

mod acoustics;
pub mod chain;
mod error;
pub mod formants;
pub mod profile;
pub mod voice;

pub use acoustics::{Acoustics, Air, WallImpedance};
pub use chain::Section;
pub use error::TractError;
pub use formants::Formant;
