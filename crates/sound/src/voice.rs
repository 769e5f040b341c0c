//! A synthetic voice: glottal pulses through a cascade of resonators at the formants (Klatt 1980), as samples and as a WAV file.

use std::f64::consts::{PI, TAU};

use crate::Formant;

pub const RATE_HZ: u32 = 22_050;
/// Decrease of the pitch until the end over the pitch at the beginning.
const FALL: f64 = 0.15;
/// Part of a period in which the glottis is open (Klatt and Klatt 1990).
const OPEN_QUOTIENT: f64 = 0.6;
/// Largest sample over full scale.
const LEVEL: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voice {
    pub seconds: f64,
    pub pitch_hz: f64,
}

impl Default for Voice {
    fn default() -> Self {
        Self { seconds: 1.0, pitch_hz: 120.0 }
    }
}

/// A resonator of second order whose gain at 0 Hz is one (Klatt 1980, equations 1 and 2).
#[derive(Debug, Clone, Copy)]
struct Resonator {
    a: f64,
    b: f64,
    c: f64,
    before: [f64; 2],
}

impl Resonator {
    fn new(formant: &Formant, rate_hz: f64) -> Self {
        let c = -(-TAU * formant.bandwidth_hz / rate_hz).exp();
        let b =
            2.0 * (-PI * formant.bandwidth_hz / rate_hz).exp() * (TAU * formant.frequency_hz / rate_hz).cos();
        Self { a: 1.0 - b - c, b, c, before: [0.0; 2] }
    }

    fn next(&mut self, x: f64) -> f64 {
        let y = self.a * x + self.b * self.before[0] + self.c * self.before[1];
        self.before = [y, self.before[0]];
        y
    }
}

/// Derivative of the flow of a glottal pulse (`t^2 - t^3` while the glottis is open; Klatt and Klatt 1990) at a phase from 0 to 1. Flow
/// falls by 12 dB per octave; the derivative, which stands for radiation at the lips, raises it by 6.
fn pulse(phase: f64) -> f64 {
    let t = phase / OPEN_QUOTIENT;
    if t < 1.0 { 2.0 * t - 3.0 * t * t } else { 0.0 }
}

/// The samples of a vowel, between -1 and 1.
pub fn samples(formants: &[Formant], voice: &Voice) -> Vec<f64> {
    const OVERSAMPLED: usize = 8;
    let rate = f64::from(RATE_HZ);
    let count = (voice.seconds * rate).round() as usize;
    let mut cascade: Vec<Resonator> =
        formants.iter().filter(|f| f.frequency_hz < 0.45 * rate).map(|f| Resonator::new(f, rate)).collect();
    let (mut phase, fade) = (0.0_f64, (0.03 * rate).max(1.0));
    let mut out = Vec::with_capacity(count);
    for i in 0..count {
        let part = i as f64 / count as f64;
        let pitch = voice.pitch_hz * (1.0 - FALL * part);
        // The pulse has a corner, whose aliasing the mean over finer steps reduces.
        let mut source = 0.0;
        for _ in 0..OVERSAMPLED {
            phase = (phase + pitch / (rate * OVERSAMPLED as f64)).fract();
            source += pulse(phase) / OVERSAMPLED as f64;
        }
        let rise = (i as f64 / fade).min((count - i) as f64 / fade).min(1.0);
        let envelope = 0.5 - 0.5 * (PI * rise).cos();
        out.push(cascade.iter_mut().fold(source, |x, r| r.next(x)) * envelope);
    }
    let highest = out.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if highest > 0.0 {
        out.iter_mut().for_each(|x| *x *= LEVEL / highest);
    }
    out
}

/// A WAV file of one channel with 16 bits a sample, and a comment.
pub fn wav(samples: &[f64], rate_hz: u32, comment: &str) -> Vec<u8> {
    // The text ends with a zero byte, and chunks have an even length.
    let mut text = comment.as_bytes().to_vec();
    text.resize((text.len() + 2) / 2 * 2, 0);
    let rates = [rate_hz, 2 * rate_hz].map(u32::to_le_bytes);
    // PCM, one channel; two bytes, 16 bits a sample.
    let [kind, width] = [[1_u16, 1], [2, 16]].map(|pair| pair.map(u16::to_le_bytes));
    let format = [kind.as_flattened(), rates.as_flattened(), width.as_flattened()].concat();
    let samples = samples.iter().map(|x| (x.clamp(-1.0, 1.0) * f64::from(i16::MAX)).round() as i16);
    let samples: Vec<u8> = samples.flat_map(i16::to_le_bytes).collect();
    let list = [&b"INFO"[..], &chunk(b"ICMT", &text)].concat();
    let chunks = [chunk(b"fmt ", &format), chunk(b"LIST", &list), chunk(b"data", &samples)].concat();
    chunk(b"RIFF", &[&b"WAVE"[..], &chunks].concat())
}

fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    [&name[..], &(content.len() as u32).to_le_bytes(), content].concat()
}
