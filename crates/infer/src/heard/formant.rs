//! A formant as an observable, and the formants of a posture as data of a posterior.

use std::sync::Arc;

use nalgebra::{DMatrix, SVector};
use tongue_sound::profile::Articulation;

use tongue_core::observe::{Observable, Observation};

use super::{Airway, AirwayError, Rates};
use crate::posterior::{Beside, Of, Sight, View};

/// Standard deviation of a formant by the errors of an estimated tract, as a part of its frequency. Walls
/// moved by 2 mm, areas 20 % larger, lips 2 mm wider and a larynx 5 mm lower change formants by 1 to 7 %
/// each, together by 12 % (docs/sound.md).
pub const TRACT_SD: f64 = 0.15;

/// Standard deviation of formants that are linear about the mode from exact ones, over draws of a posterior, as a part of the frequency.
const LINEAR_SD: f64 = 0.07;

/// The frequency of a formant, Hz. Without an airway (the tongue touches the palate) it is infinite, so that
/// no fit goes there.
#[derive(Debug, Clone)]
pub struct Heard {
    airway: Arc<Airway>,
    posture: Articulation,
    number: usize,
}

impl Heard {
    /// Formant `number`, from 0, of a tract around a body in a posture.
    pub fn new(airway: Arc<Airway>, posture: Articulation, number: usize) -> Self {
        Self { airway, posture, number }
    }

    /// An observation of the formant, Hz, with the standard deviation of its measurement, Hz; the error of
    /// the tract is added.
    pub fn measured(self, frequency_hz: f64, sd_hz: f64) -> Observation<2> {
        let sd = sd_hz.hypot(TRACT_SD * frequency_hz);
        Observation::new(self, frequency_hz).with_standard_deviation(sd)
    }
}

/// The lowest formants of a posture, Hz, linear in the places of the nodes about a shape. Draws of a posterior ask for them a hundred thousand
/// times; over its draws they differ from exact formants by less than the error of a drawn tract (a test holds that).
#[derive(Debug, Clone)]
pub struct Formants {
    about: Vec<SVector<f64, 2>>,
    hz: Vec<f64>,
    rates: Rates,
}

impl Formants {
    /// Of a tract round a body in a posture, about a shape (positions of all nodes, m).
    pub fn about(
        airway: &Airway,
        posture: &Articulation,
        count: usize,
        about: &[SVector<f64, 2>],
    ) -> Result<Self, AirwayError> {
        let mut sound = airway.sound(about, posture)?;
        sound.formants.truncate(count);
        let hz = sound.formants.iter().map(|f| f.frequency_hz).collect();
        Ok(Self { about: about.to_vec(), hz, rates: airway.rates(&sound) })
    }

    /// What was measured of them in posture number `number` of a posterior, Hz, with the standard deviation of a measurement as a part of
    /// the frequency; the errors of the tract and of linear formants are added.
    pub fn measured(self, number: usize, hz: &[f64], relative_sd: f64) -> Beside {
        // The tract's error is one of the computed frequency. Half of its variance moves all formants together, as a larynx or lips do.
        let error = |i: usize, j: usize| {
            let tract = TRACT_SD.powi(2) * self.hz[i] * self.hz[j];
            let own = (LINEAR_SD * self.hz[i]).powi(2) + (relative_sd * hz[i]).powi(2);
            if i == j { tract + own } else { 0.5 * tract }
        };
        let errors = DMatrix::from_fn(hz.len(), hz.len(), error);
        Beside {
            kind: "formants".to_owned(),
            names: (1..=hz.len()).map(|i| format!("F{i}")).collect(),
            of: Of::Shapes(vec![View { posture: Some(number), count: hz.len(), sight: Arc::new(self) }]),
            measured: hz.to_vec(),
            errors,
        }
    }
}

impl Sight for Formants {
    fn values(&self, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let moved =
            |&(node, rate): &(usize, SVector<f64, 2>)| rate.dot(&(positions[node] - self.about[node]));
        self.hz.iter().zip(&self.rates).map(|(hz, rates)| hz + rates.iter().map(moved).sum::<f64>()).collect()
    }

    fn gradient(&self, _: &[SVector<f64, 2>], weights: &[f64], by_node: &mut [SVector<f64, 2>]) {
        for (rates, weight) in self.rates.iter().zip(weights) {
            rates.iter().for_each(|(node, rate)| by_node[*node] += rate * *weight);
        }
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
