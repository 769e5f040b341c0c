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
pub enum TractError {
    /// An invalid number of the file or of the posture, as a message.
    #[error("{0}")]
    Bad(String),
    /// The inner wall passes through the outer one: the outer wall's name, the place (m), and the depth (m).
    #[error(
        "the inner wall (tongue, lower teeth or larynx) touches or passes through the {0} at {at}, by {by:.1} mm: there is no airway, so no \
         vowel can be computed",
        at = mm(.1),
        by = .2 * 1e3
    )]
    Through(String, [f64; 2], f64),
    /// Name of the outer wall and place, m.
    #[error("no inner wall is opposite to the {0} at {at}: the line across the airway meets neither larynx, tongue nor lower teeth", at = mm(.1))]
    Open(String, [f64; 2]),
    /// Name of the outer wall and place, m.
    #[error(
        "walls cross: lines across the airway meet at {at} before they reach the wall opposite to the {0}",
        at = mm(.1)
    )]
    Crossed(String, [f64; 2]),
    #[error("the tract has no sections")]
    Empty,
    #[error("section {0} of the tract, counted from the glottis, has no positive length or area")]
    Closed(usize),
    /// The number of the pole, counted from 1.
    #[error("formant {0} of the tract could not be found")]
    NotFound(usize),
}

fn mm(p: &[f64; 2]) -> String {
    format!("({:.1}, {:.1}) mm", p[0] * 1e3, p[1] * 1e3)
}
