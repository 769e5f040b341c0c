//! Repeated measurement of times, and orders of convergence.

use std::time::{Duration, Instant};

use tongue_core::statistics::median;

/// The error that the conclusions are about: of a ratio, or of a tension as a part of it.
pub const ONE_PER_CENT: f64 = 0.01;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Maximum number of repeats of a run; its time is their median.
    pub repeats: usize,
    /// A run is not repeated after this total time, s.
    pub repeat_within_s: f64,
    /// A run that would take longer is refused, s.
    pub longest_run_s: f64,
    /// A run with more fixed steps is refused.
    pub most_steps: f64,
    /// Mesh spacings, m, the coarsest first.
    pub spacings: &'static [f64],
}

impl Effort {
    pub const FULL: Self = Self {
        repeats: 15,
        repeat_within_s: 1.0,
        longest_run_s: 100.0,
        most_steps: 2e7,
        spacings: &[11e-3, 5.5e-3, 2.75e-3, 1.4e-3, 0.7e-3],
    };
    pub const QUICK: Self = Self {
        repeats: 5,
        repeat_within_s: 0.1,
        longest_run_s: 0.5,
        spacings: &[11e-3, 5.5e-3, 2.75e-3, 1.4e-3],
        ..Self::FULL
    };
    /// For tests: each run once, with few steps on coarse meshes.
    #[cfg(test)]
    pub const TINY: Self = Self {
        repeats: 1,
        repeat_within_s: 0.0,
        longest_run_s: f64::INFINITY,
        most_steps: 5000.0,
        spacings: &[11e-3, 9e-3, 7e-3],
    };
}

#[derive(Debug, Clone)]
pub struct Timed<T> {
    /// The result of the last repeat.
    pub result: T,
    /// Median wall-clock time, s.
    pub seconds: f64,
    pub repeats: usize,
}

/// The result of `work`, and its wall-clock time, s.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let clock = Instant::now();
    let result = work();
    (result, clock.elapsed().as_secs_f64())
}

/// Runs `work` up to `effort.repeats` times and takes the median time. The first of several runs is not counted.
pub fn measure<T>(effort: &Effort, mut work: impl FnMut() -> T) -> Timed<T> {
    let begin = Instant::now();
    let (mut result, warming) = timed(&mut work);
    let mut times = Vec::new();
    while times.len() < effort.repeats && begin.elapsed() < Duration::from_secs_f64(effort.repeat_within_s) {
        let (again, seconds) = timed(&mut work);
        result = again;
        times.push(seconds);
    }
    Timed { result, repeats: times.len().max(1), seconds: median(times).unwrap_or(warming) }
}

/// The exponent p in `error ~ step^p`, by least squares of logarithms; `None` with fewer than two usable points.
pub fn observed_order(points: &[(f64, f64)]) -> Option<f64> {
    let usable: Vec<(f64, f64)> =
        points.iter().filter(|(h, e)| *h > 0.0 && *e > 0.0).map(|(h, e)| (h.ln(), e.ln())).collect();
    let n = usable.len() as f64;
    let (mx, my) = (usable.iter().map(|p| p.0).sum::<f64>() / n, usable.iter().map(|p| p.1).sum::<f64>() / n);
    let across: f64 = usable.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let along: f64 = usable.iter().map(|p| (p.0 - mx).powi(2)).sum();
    (along > 0.0).then(|| across / along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_a_power_law_is_its_exponent() {
        let points = [0.5, 0.1, 0.02].map(|h: f64| (h, 3.0 * h.powf(1.7)));
        assert!((observed_order(&points).unwrap() - 1.7).abs() < 1e-12);
        assert_eq!(observed_order(&points[..1]), None);
        assert_eq!(observed_order(&[(1.0, 0.0), (2.0, 1.0)]), None, "an error of zero has no logarithm");
    }
}
