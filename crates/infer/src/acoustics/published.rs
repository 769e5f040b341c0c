//! Published means of formants.

use serde::{Deserialize, Serialize};

const MEANS: &str = include_str!("../../../../targets/japanese_vowels.csv");

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeanVowel {
    pub vowel: String,
    pub f1_hz: f64,
    pub f2_hz: f64,
}

/// The built-in means of Japanese men; their source is in `targets/japanese_vowels.csv`.
pub fn mean_vowels() -> Result<Vec<MeanVowel>, csv::Error> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(MEANS.as_bytes()).deserialize().collect()
}
