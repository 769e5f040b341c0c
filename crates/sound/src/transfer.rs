//! The transfer function from the flow at the glottis to the flow at the lips.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::chain::characteristic;
use crate::{Acoustics, Section};

/// Magnitude of the transfer function at a frequency, dB.
pub fn level_db(sections: &[Section], acoustics: &Acoustics, frequency_hz: f64) -> f64 {
    let s = Complex64::new(0.0, TAU * frequency_hz);
    -20.0 * characteristic(sections, s, acoustics, 1.0).0.norm().log10()
}

/// Frequencies, Hz, and levels, dB, in equal steps from one step to a highest frequency.
pub fn curve(sections: &[Section], acoustics: &Acoustics, step_hz: f64, highest_hz: f64) -> Vec<[f64; 2]> {
    let count = (highest_hz / step_hz).floor() as usize;
    (1..=count).map(|i| i as f64 * step_hz).map(|f| [f, level_db(sections, acoustics, f)]).collect()
}
