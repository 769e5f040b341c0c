//! Formants: the poles of the transfer function, and their derivatives by every area and length.
//!
//! Without losses the squared frequencies are the zeros of a real function with real zeros only. From below, Newton's method on the
//! function divided by the known zeros reaches the next zero without passing it (Maehly 1954). Losses, the wall and the resistance of the
//! lips then grow from zero in steps, and each pole is followed into the complex plane.

use std::f64::consts::TAU;

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::chain::{by_sections, characteristic, without_losses};
use crate::{Acoustics, Section, TractError};

/// A resonance of the tract.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Formant {
    pub frequency_hz: f64,
    /// Width at half power, Hz.
    pub bandwidth_hz: f64,
}

impl Formant {
    fn from_pole(s: Complex64) -> Self {
        Self { frequency_hz: s.im / TAU, bandwidth_hz: -s.re * 2.0 / TAU }
    }

    fn pole(&self) -> Complex64 {
        Complex64::new(-self.bandwidth_hz * TAU / 2.0, self.frequency_hz * TAU)
    }
}

/// The lowest `count` formants of a tract whose glottis is closed, in rising order.
pub fn formants(
    sections: &[Section],
    acoustics: &Acoustics,
    count: usize,
) -> Result<Vec<Formant>, TractError> {
    if sections.is_empty() {
        return Err(TractError("the tract has no sections".to_owned()));
    }
    let is_open = |s: &Section| [s.length_m, s.area_m2].iter().all(|x| x.is_finite() && *x > 0.0);
    if let Some(closed) = sections.iter().position(|s| !is_open(s)) {
        let problem = "of the tract, counted from the glottis, has no positive length or area";
        return Err(TractError(format!("section {} {problem}", closed + 1)));
    }
    let squares = ideal_squares(sections, acoustics, count)?;
    let formants = squares.iter().enumerate().map(|(i, square)| {
        let pole = follow(sections, acoustics, Complex64::new(0.0, square.sqrt()));
        pole.map(Formant::from_pole).ok_or_else(|| not_found(i + 1))
    });
    let mut out = formants.collect::<Result<Vec<_>, _>>()?;
    out.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    // Two starts that end in one pole mean that another pole was lost.
    let twin = out.windows(2).position(|w| w[1].frequency_hz - w[0].frequency_hz < 1e-6 * w[1].frequency_hz);
    twin.map_or(Ok(out), |i| Err(not_found(i + 2)))
}

fn not_found(number: usize) -> TractError {
    TractError(format!("formant {number} of the tract could not be found"))
}

/// Squared angular frequencies without losses.
fn ideal_squares(sections: &[Section], acoustics: &Acoustics, count: usize) -> Result<Vec<f64>, TractError> {
    let mut found: Vec<f64> = Vec::with_capacity(count);
    while found.len() < count {
        let mut x = found.last().map_or(0.0, |last| last * (1.0 + 1e-4));
        let mut is_found = false;
        for _ in 0..200 {
            let (value, slope) = without_losses(sections, x, acoustics);
            let rest = slope / value - found.iter().map(|f| 1.0 / (x - f)).sum::<f64>();
            let step = -1.0 / rest;
            if value == 0.0 || step.abs() <= 1e-14 * x {
                is_found = true;
                break;
            }
            x += step;
            if !x.is_finite() {
                break;
            }
        }
        if !is_found || found.last().is_some_and(|last| x <= *last) {
            return Err(not_found(found.len() + 1));
        }
        found.push(x);
    }
    Ok(found)
}

/// Follows a pole while the losses grow from zero to their full value.
fn follow(sections: &[Section], acoustics: &Acoustics, from: Complex64) -> Option<Complex64> {
    let (mut at, mut share, mut step) = (from, 0.0, 0.5);
    while share < 1.0 {
        let next = f64::min(share + step, 1.0);
        match newton(sections, acoustics, at, next) {
            Some(pole) => (at, share) = (pole, next),
            None if step > 1e-3 => step *= 0.5,
            None => return None,
        }
    }
    Some(at)
}

/// Newton's method for a pole; `None` if it moves far away or does not converge.
fn newton(sections: &[Section], acoustics: &Acoustics, from: Complex64, share: f64) -> Option<Complex64> {
    let mut s = from;
    for _ in 0..30 {
        let (value, slope) = characteristic(sections, s, acoustics, share);
        let step = value / slope;
        s -= step;
        let is_near = (s - from).norm() < 0.3 * from.norm() + 300.0;
        if !is_near || s.im <= 0.0 || !s.is_finite() {
            return None;
        }
        if step.norm() <= 1e-13 * s.norm() {
            return Some(s);
        }
    }
    // Rounding may keep the steps above 1e-13.
    let (value, slope) = characteristic(sections, s, acoustics, share);
    ((value / slope).norm() <= 1e-9 * s.norm()).then_some(s)
}

/// Exact derivatives of a formant's frequency by the area, Hz/m^2, and by the length, Hz/m, of every section: the pole moves by
/// `-(dE/dx) / (dE/ds)`.
pub fn rates(sections: &[Section], acoustics: &Acoustics, formant: &Formant) -> Vec<[f64; 2]> {
    let s = formant.pole();
    let (_, slope) = characteristic(sections, s, acoustics, 1.0);
    let by_sections = by_sections(sections, s, acoustics).into_iter();
    by_sections.map(|rates| rates.map(|rate| Formant::from_pole(-rate / slope).frequency_hz)).collect()
}
