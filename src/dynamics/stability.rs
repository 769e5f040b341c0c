//! How long a step of an explicit method may be, and how long a run of it takes.

use std::time::{Duration, Instant};

use super::{Counts, Integrator, Motion, Spectrum, State};

/// Growth of a step beyond one that is rounding.
const ROUNDING: f64 = 1e-7;
/// Parts of the largest stiffness that are tried with the largest damping, and the other way round.
const PARTS: [f64; 6] = [0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0];
/// A measurement of the cost takes about this long.
const MEASUREMENT: Duration = Duration::from_millis(10);

/// The longest stable step of an explicit method, s, on modes as stiff and as damped as the stiffest and the most damped one
/// (`spectrum`); none for methods that are stable at every step.
pub fn stability_limit<const D: usize>(integrator: &dyn Integrator<D>, spectrum: &Spectrum) -> Option<f64> {
    integrator.amplification(0.0, 0.0)?;
    let (k, c) = (spectrum.stiffness, spectrum.damping);
    let stable = |dt: f64| {
        PARTS.into_iter().flat_map(|p| [(k, p * c), (p * k, c)]).all(|(k, c)| {
            let matrix = integrator.amplification(k * dt * dt, c * dt);
            matrix.is_none_or(|m| m.complex_eigenvalues().iter().all(|e| e.norm() <= 1.0 + ROUNDING))
        })
    };
    // Every explicit method here fails at four times the time scale of the fastest mode.
    let mut high = f64::min(4.0 / k.sqrt(), 4.0 / c);
    if !high.is_finite() {
        return Some(f64::INFINITY);
    }
    let mut low = 0.0;
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if stable(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(low)
}

/// How long a step takes on this machine now: measured on a copy of the state, for about ten milliseconds, before `t_end` (s).
/// The integrator is of no use for a trajectory afterwards.
pub fn cost_per_step<const D: usize>(
    motion: &Motion<'_, D>,
    integrator: &mut dyn Integrator<D>,
    state: &State<D>,
    t_end: f64,
) -> Duration {
    let mut copy = state.clone();
    let mut counts = Counts::default();
    let clock = Instant::now();
    let mut steps = 0;
    while clock.elapsed() < MEASUREMENT && copy.time < t_end {
        if integrator.step(motion, &mut copy, t_end, &mut counts).is_err() {
            break;
        }
        steps += 1;
    }
    clock.elapsed() / steps.max(1)
}
