//! Published means of formants.

use serde::{Deserialize, Serialize};

const MEANS: &str = include_str!("../../../../targets/japanese_vowels.csv");

/// Mean first and second formant of a vowel, Hz.
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

/// The vowel whose mean is nearest to two formants, Hz, by the distance in Bark (Traunmüller 1990, J. Acoust. Soc. Am. 88, 97-100, eq. 6).
pub fn nearest_vowel(means: &[MeanVowel], f1_hz: f64, f2_hz: f64) -> Option<&MeanVowel> {
    let bark = |hz: f64| 26.81 * hz / (1960.0 + hz) - 0.53;
    let apart = |m: &MeanVowel| (bark(m.f1_hz) - bark(f1_hz)).hypot(bark(m.f2_hz) - bark(f2_hz));
    means.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
}
