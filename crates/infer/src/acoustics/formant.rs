//! A formant as an observable, and published means of formants.

use std::sync::Arc;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::VocalTract;
use crate::standard_deviations as sd;
use tongue_core::observe::Observable;
use tongue_core::statistics::least_by;
use tongue_sound::profile::Articulation;

/// Standard deviation of a formant by errors of an estimated tract, as a part of its frequency. Walls moved by 2 mm, areas 20 % larger,
/// lips 2 mm wider and a larynx 5 mm lower change formants by 1 to 7 % each, and together by 12 % (docs/sound.md).
pub const TRACT_SD: f64 = sd::FORMANT;

/// The frequency of a formant, Hz; infinite where the tongue closes the tract, so that no fit goes there.
#[derive(Debug, Clone)]
pub struct FormantFrequency {
    vocal_tract: Arc<VocalTract>,
    posture: Articulation,
    number: usize,
}

impl FormantFrequency {
    /// Formant `number`, counted from 0.
    pub fn new(vocal_tract: Arc<VocalTract>, posture: Articulation, number: usize) -> Self {
        Self { vocal_tract, posture, number }
    }
}

impl Observable<2> for FormantFrequency {
    fn value(&self, positions: &[SVector<f64, 2>]) -> f64 {
        let sound = self.vocal_tract.sound(positions, &self.posture).ok();
        sound.and_then(|s| Some(s.formants.get(self.number)?.frequency_hz)).unwrap_or(f64::INFINITY)
    }

    fn gradient(&self, positions: &[SVector<f64, 2>], part: &mut dyn FnMut(usize, SVector<f64, 2>)) {
        let Ok(sound) = self.vocal_tract.sound(positions, &self.posture) else { return };
        let only = sound.formants.get(self.number).map(|f| vec![*f]).unwrap_or_default();
        let rates = self.vocal_tract.rates(&super::Sound { formants: only, ..sound });
        rates.into_iter().flatten().for_each(|(node, rate)| part(node, rate));
    }
}

const MEANS: &str = include_str!("../../../../targets/japanese_vowels.csv");

/// Mean first and second formant of a vowel, Hz.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeanVowel {
    pub vowel: String,
    pub f1_hz: f64,
    pub f2_hz: f64,
}

/// Built-in means of Japanese men, with their source in `targets/japanese_vowels.csv`.
pub fn mean_vowels() -> Result<Vec<MeanVowel>, csv::Error> {
    csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(MEANS.as_bytes()).deserialize().collect()
}

/// The vowel whose mean is nearest to two formants, Hz, by the distance in Bark (Traunmüller 1990, J. Acoust. Soc. Am. 88, 97-100, eq. 6).
pub fn nearest_vowel(means: &[MeanVowel], f1_hz: f64, f2_hz: f64) -> Option<&MeanVowel> {
    least_by(means, |m| (bark(m.f1_hz) - bark(f1_hz)).hypot(bark(m.f2_hz) - bark(f2_hz)))
}

fn bark(hz: f64) -> f64 {
    26.81 * hz / (1960.0 + hz) - 0.53
}
