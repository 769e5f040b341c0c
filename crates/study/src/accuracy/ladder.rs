//! Shared by the axes: repeated measurement, medians, observed order, and how a run ended.

use std::time::{Duration, Instant};

use serde::{Serialize, Serializer};

use tongue_core::dynamics::StepCounts;
use tongue_core::statistics::median;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Maximum number of repeats of a run; its time is their median.
    pub repeats: usize,
    /// Total time after which a run is not repeated, s.
    pub repeat_within_s: f64,
    /// Longest time that a single run may take, s; longer runs are refused with an estimate.
    pub longest_run_s: f64,
    /// Maximum number of steps of a run with fixed steps; longer runs are refused with an estimate.
    pub most_steps: f64,
    /// Mesh spacings, m, coarsest first.
    pub spacings: &'static [f64],
}

impl Effort {
    /// The full study, in ten minutes on two cores.
    pub const FULL: Self = Self {
        repeats: 15,
        repeat_within_s: 1.0,
        longest_run_s: 100.0,
        most_steps: 2e7,
        spacings: &[11e-3, 5.5e-3, 2.75e-3, 1.4e-3, 0.7e-3],
    };
    /// A quick study, in half a minute.
    pub const QUICK: Self = Self {
        repeats: 5,
        repeat_within_s: 0.1,
        longest_run_s: 0.5,
        most_steps: 2e7,
        spacings: &[11e-3, 5.5e-3, 2.75e-3, 1.4e-3],
    };
    /// A smoke test without timing: each run once, with few steps on coarse meshes.
    #[cfg(test)]
    pub const TINY: Self = Self {
        repeats: 1,
        repeat_within_s: 0.0,
        longest_run_s: f64::INFINITY,
        most_steps: 5000.0,
        spacings: &[11e-3, 9e-3, 7e-3],
    };
}

/// How a run ended. Failed and refused runs stay in the tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    Done,
    /// Stopped by itself before its tolerance; its last state is measured.
    Short(String),
    /// No usable answer.
    Failed(String),
    /// Not begun or not finished, because it would take too long or cannot work.
    Refused(String),
}

impl Ended {
    pub fn words(&self) -> String {
        match self {
            Self::Done => "done".into(),
            Self::Short(why) => format!("stopped short: {why}"),
            Self::Failed(why) => format!("failed: {why}"),
            Self::Refused(why) => format!("refused: {why}"),
        }
    }
}

impl Serialize for Ended {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.words())
    }
}

/// One run of a method: a point in the diagram of time against accuracy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    pub method: String,
    /// The setting of this run, in words and units.
    pub setting: String,
    /// Largest distance of a node from its position in the reference, mm.
    pub error_mm: Option<f64>,
    /// Largest difference of a muscle's ratio to GGa.
    pub ratio_error: Option<f64>,
    /// Wall-clock time, s: the median of the repeats.
    pub seconds: Option<f64>,
    pub repeats: usize,
    pub steps: u64,
    /// Evaluations of the force (for methods on the energy, of energy and force together).
    pub force_evaluations: u64,
    pub factorisations: u64,
    pub ended: Ended,
}

impl Run {
    /// A run without results.
    pub fn new(method: &str, setting: String) -> Self {
        Self {
            method: method.into(),
            setting,
            error_mm: None,
            ratio_error: None,
            seconds: None,
            repeats: 0,
            steps: 0,
            force_evaluations: 0,
            factorisations: 0,
            ended: Ended::Done,
        }
    }

    /// Sets the errors (of a position, mm, and of a ratio), the median time, s, the number of repeats, and
    /// the cost.
    pub fn measured(self, errors: (f64, f64), (seconds, repeats): (f64, usize), counts: StepCounts) -> Self {
        Self {
            error_mm: Some(errors.0),
            ratio_error: Some(errors.1),
            seconds: Some(seconds),
            repeats,
            steps: counts.steps,
            force_evaluations: counts.force_evaluations,
            factorisations: counts.factorisations,
            ..self
        }
    }

    /// Sets how the run ended.
    pub fn ended(self, ended: Ended) -> Self {
        Self { ended, ..self }
    }

    /// Time and error, if both are known.
    pub fn point(&self) -> Option<(f64, f64)> {
        self.seconds.zip(self.error_mm)
    }

    fn is_within(&self, error: Option<f64>, limit: f64) -> bool {
        self.seconds.is_some() && error.is_some_and(|e| e <= limit)
    }
}

fn fastest<'a>(runs: impl Iterator<Item = &'a Run>) -> Option<&'a Run> {
    runs.min_by(|a, b| a.seconds.unwrap_or(f64::INFINITY).total_cmp(&b.seconds.unwrap_or(f64::INFINITY)))
}

/// The fastest run whose position error is at most `error_mm`.
pub fn fastest_within<'a>(runs: impl IntoIterator<Item = &'a Run>, error_mm: f64) -> Option<&'a Run> {
    fastest(runs.into_iter().filter(|r| r.is_within(r.error_mm, error_mm)))
}

pub fn fastest_within_ratio<'a>(runs: impl IntoIterator<Item = &'a Run>, error: f64) -> Option<&'a Run> {
    fastest(runs.into_iter().filter(|r| r.is_within(r.ratio_error, error)))
}

/// Result of a repeated measurement.
#[derive(Debug, Clone)]
pub struct Timed<T> {
    /// The result of the last repeat; all repeats give the same.
    pub result: T,
    /// Median wall-clock time, s.
    pub seconds: f64,
    pub repeats: usize,
}

/// Runs `work` up to `effort.repeats` times and takes the median time. If there are several repeats, the
/// first warms up and is not counted.
pub fn measure<T>(effort: &Effort, mut work: impl FnMut() -> T) -> Timed<T> {
    let begin = Instant::now();
    let mut result = work();
    let mut times = vec![begin.elapsed().as_secs_f64()];
    let warming = times[0];
    while times.len() < effort.repeats + 1
        && begin.elapsed() < Duration::from_secs_f64(effort.repeat_within_s)
    {
        let clock = Instant::now();
        result = work();
        times.push(clock.elapsed().as_secs_f64());
    }
    if times.len() > 1 {
        times.remove(0);
    }
    Timed { result, seconds: median(times.iter().copied()).unwrap_or(warming), repeats: times.len() }
}

/// `p` in `error ~ step^p`, by least squares on logarithms; `None` from fewer than two usable points.
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

    #[test]
    fn a_run_that_takes_long_is_run_once() {
        let mut calls = 0;
        let timed = measure(&Effort { repeat_within_s: 0.0, ..Effort::FULL }, || calls += 1);
        assert_eq!((timed.repeats, calls), (1, 1));
    }
}
