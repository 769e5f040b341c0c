//! A formant as an observable.

use std::sync::Arc;

use nalgebra::SVector;
use tongue_sound::profile::Articulation;

use tongue_core::observe::Observable;

use super::VocalTract;
use crate::standard_deviations as sd;

/// Standard deviation of a formant by the errors of an estimated tract, as a part of its frequency. Walls
/// moved by 2 mm, areas 20 % larger, lips 2 mm wider and a larynx 5 mm lower change formants by 1 to 7 %
/// each, together by 12 % (docs/sound.md).
pub const TRACT_SD: f64 = sd::FORMANT;

/// The frequency of a formant, Hz. Without an airway (the tongue touches the palate) it is infinite, so that
/// no fit goes there.
#[derive(Debug, Clone)]
pub struct Heard {
    airway: Arc<VocalTract>,
    posture: Articulation,
    number: usize,
}

impl Heard {
    /// Formant `number`, from 0, of a tract around a body in a posture.
    pub fn new(airway: Arc<VocalTract>, posture: Articulation, number: usize) -> Self {
        Self { airway, posture, number }
    }
}

impl Observable<2> for Heard {
    fn value(&self, positions: &[SVector<f64, 2>]) -> f64 {
        let sound = self.airway.sound(positions, &self.posture).ok();
        sound.and_then(|s| Some(s.formants.get(self.number)?.frequency_hz)).unwrap_or(f64::INFINITY)
    }

    fn gradient(&self, positions: &[SVector<f64, 2>], part: &mut dyn FnMut(usize, SVector<f64, 2>)) {
        let Ok(sound) = self.airway.sound(positions, &self.posture) else { return };
        let only = sound.formants.get(self.number).map(|f| vec![*f]).unwrap_or_default();
        let rates = self.airway.rates(&super::Sound { formants: only, ..sound });
        rates.into_iter().flatten().for_each(|(node, rate)| part(node, rate));
    }
}
