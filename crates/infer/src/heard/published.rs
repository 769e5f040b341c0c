//! Published means of formants.

use serde::{Deserialize, Serialize};

const MEANS: &str = include_str!("../../../../targets/japanese_vowels.csv");

/// Mean formants of a vowel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeanVowel {
    /// The vowel.
    pub vowel: String,
    /// First formant, Hz.
    pub f1_hz: f64,
    /// Second formant, Hz.
    pub f2_hz: f64,
}

/// The means of Japanese men that are built in; their source is in `targets/japanese_vowels.csv`.
///
/// # Errors
/// As the table cannot be read; none that a test does not find.
pub fn mean_vowels() -> Result<Vec<MeanVowel>, csv::Error> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(MEANS.as_bytes()).deserialize().collect()
}
