//! The sound of a vocal tract: from its walls in the midsagittal plane to areas, formants and a voice.
//!
//! | step | module | source |
//! |---|---|---|
//! | walls to areas | [`profile`] | Heinz and Stevens 1965; Mermelstein 1973; Maeda 1979 |
//! | areas to transfer function | [`chain`] | Flanagan 1972, chapter 3; Sondhi and Schroeter 1987 |
//! | formants, bandwidths and exact rates of formants | [`formants`] | poles of the transfer function |
//! | synthetic voice | [`voice`] | Klatt 1980; Klatt and Klatt 1990 |
//!
//! Everything is in SI units: m, m^2, Hz, s, Pa. The crate has no tongue, muscles or files.

pub mod chain;
pub mod formants;
pub mod profile;
pub mod voice;

pub use chain::{Acoustics, Section};
pub use formants::Formant;

/// Why the areas or the formants of a tract cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct TractError(pub String);
