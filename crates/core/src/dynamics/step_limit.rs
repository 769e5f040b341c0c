//! Velocity Verlet's longest stable step, by the largest eigenvalues of the motion; detection of growing steps; and the duration of a run.

use std::time::{Duration, Instant};

use nalgebra::SVector;

use super::velocity_verlet::amplification;
use super::{Integrator, Motion, State, StepCounts};
use crate::effect::Tangent;
use crate::geometry;
use crate::sparse::{BlockMatrix, Pattern};

/// Amplification beyond 1 that counts as rounding.
const ROUNDING: f64 = 1e-7;
/// Parts of the largest stiffness that are combined with the largest damping, and of the largest damping that are combined with the
/// stiffness.
const PARTS: [f64; 6] = [0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0];
/// Number of steps in a window, over which net motion and node speeds are compared.
const WINDOW: u64 = 64;
/// Smallest number of steps between two computations of the limit, except at the end.
const BETWEEN_SPECTRA: u64 = 1024;
/// Steps alternate or grow if the mean squared speed is this many times that of the net motion in a window.
const ALTERNATING: f64 = 8.0;
/// Speeds whose step is shorter than this part of the body's size count as rounding.
const SPEED_ROUNDING: f64 = 1e-9;
const LIMIT_ACCURACY: f64 = 1e-3;
const MEASUREMENT: Duration = Duration::from_millis(10);

/// The longest step, s, with which Verlet is stable for modes up to the largest stiffness and damping of `spectrum`.
pub(super) fn step_limit(spectrum: &Spectrum) -> f64 {
    let (k, c) = (spectrum.stiffness, spectrum.damping);
    let stable = |dt: f64| {
        PARTS.into_iter().flat_map(|p| [(k, p * c), (p * k, c)]).all(|(k, c)| {
            let eigenvalues = amplification(k * dt * dt, c * dt).complex_eigenvalues();
            eigenvalues.iter().all(|e| e.norm() <= 1.0 + ROUNDING)
        })
    };
    // Verlet is unstable at four times the time scale of the fastest mode.
    let mut high = f64::min(4.0 / k.sqrt(), 4.0 / c);
    if !high.is_finite() {
        return f64::INFINITY;
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
    low
}

/// Detects growing steps in an explicit run. A body under tension becomes stiffer than at rest, and a mode beyond the limit may oscillate
/// from step to step instead of diverging.
#[derive(Debug)]
pub(super) struct Growth<const D: usize> {
    /// The fixed step of an explicit method, s; `None` for other methods, which need no detection.
    step: Option<f64>,
    positions: Vec<SVector<f64, D>>,
    time: f64,
    /// Speed below which a body counts as still, m/s.
    no_speed: f64,
    /// Number of steps until the limit may be computed again.
    wait: u64,
}

impl<const D: usize> Growth<D> {
    pub(super) fn new(motion: &Motion<'_, D>, integrator: &dyn Integrator<D>, state: &State<D>) -> Self {
        let step = integrator.explicit_step();
        let size = geometry::largest(motion.system.rest());
        let no_speed = step.map_or(0.0, |dt| SPEED_ROUNDING * size / dt);
        Self { step, positions: state.positions.clone(), time: state.time, no_speed, wait: 0 }
    }

    /// Whether the nodes move much more than they advance while the step exceeds the stability limit. To be called after every step, with
    /// its number `steps` and the states before and after it, and at the end. In Verlet an alternating motion shows in the positions only.
    pub(super) fn is_detected(
        &mut self,
        motion: &Motion<'_, D>,
        (before, state): (&State<D>, &State<D>),
        steps: u64,
        at_end: bool,
    ) -> bool {
        let Some(dt) = self.step.filter(|_| at_end || steps.is_multiple_of(WINDOW)) else { return false };
        let nodes = motion.system.pattern().nodes();
        let (step, duration) = (state.time - before.time, state.time - self.time);
        let (mut moving, mut gone) = (0.0, 0.0);
        for &i in nodes {
            let x = state.positions[i];
            moving += state.velocities[i].norm_squared();
            moving += (x - before.positions[i]).norm_squared() / (step * step);
            gone += (x - self.positions[i]).norm_squared() / (duration * duration);
        }
        self.positions.copy_from_slice(&state.positions);
        self.time = state.time;
        self.wait = self.wait.saturating_sub(WINDOW);
        if moving <= ALTERNATING * gone + self.no_speed.powi(2) || (self.wait > 0 && !at_end) {
            return false;
        }
        self.wait = BETWEEN_SPECTRA;
        dt > (1.0 - LIMIT_ACCURACY) * step_limit(&Spectrum::of(motion, state))
    }
}

/// Duration of a step on this machine, measured for about 10 ms on a copy of the state, until `t_end`, s, at the latest. The integrator
/// cannot be used for a trajectory afterwards.
pub fn cost_per_step<const D: usize>(
    motion: &Motion<'_, D>,
    integrator: &mut dyn Integrator<D>,
    state: &State<D>,
    t_end: f64,
) -> Duration {
    let mut copy = state.clone();
    let mut counts = StepCounts::default();
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

/// The power iteration ends when a round changes the estimate by less than this part.
const POWER_TOLERANCE: f64 = 1e-7;
/// Number of steps of the power iteration in a round, and the largest number of rounds.
const ROUND_STEPS: usize = 20;
const MOST_ROUNDS: usize = 200;

/// The fastest modes of a state, by power iteration on `K/m` and `C/m` with constant internal states and the convex tangent, so that both
/// matrices are positive semidefinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum {
    /// Largest eigenvalue of `K/m`, 1/s²: the square of the largest angular frequency.
    pub stiffness: f64,
    /// Largest eigenvalue of `C/m`, 1/s: the largest rate at which dampers stop a motion.
    pub damping: f64,
}

impl Spectrum {
    pub fn of<const D: usize>(motion: &Motion<'_, D>, state: &State<D>) -> Self {
        let pattern = motion.system.pattern();
        let mut matrix = BlockMatrix::zeros(pattern);
        motion.add_stiffness(state, 0.0, Tangent::Convex, &mut matrix);
        let stiffness = largest_eigenvalue(pattern, &matrix) / motion.mass;
        matrix.clear();
        motion.add_damping(state, 1.0, &mut matrix);
        Self { stiffness, damping: largest_eigenvalue(pattern, &matrix) / motion.mass }
    }
}

/// Largest eigenvalue of a positive semidefinite matrix. The start has no symmetry, so that it is not orthogonal to a mode.
fn largest_eigenvalue<const D: usize>(pattern: &Pattern, matrix: &BlockMatrix<D>) -> f64 {
    let n = pattern.unknowns();
    let mut v: Vec<SVector<f64, D>> =
        (0..n).map(|i| SVector::from_fn(|d, _| (1.0 + (i * D + d) as f64 * 2.4).sin())).collect();
    let mut image = v.clone();
    let mut estimate = 0.0;
    for _ in 0..MOST_ROUNDS {
        let before = estimate;
        for _ in 0..ROUND_STEPS {
            matrix.multiply(pattern, &v, &mut image);
            let norm = image.iter().map(SVector::norm_squared).sum::<f64>().sqrt();
            if !(norm > 0.0 && norm.is_finite()) {
                return 0.0;
            }
            // |A v| of a unit v is between the Rayleigh quotient and the largest eigenvalue.
            estimate = norm;
            v.iter_mut().zip(&image).for_each(|(v, i)| *v = i / norm);
        }
        if (estimate - before).abs() <= POWER_TOLERANCE * estimate {
            break;
        }
    }
    estimate
}
