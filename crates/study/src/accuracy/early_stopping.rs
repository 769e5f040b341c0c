//! Axis 3: the distance from equilibrium of a trajectory that is stopped early.

use serde::Serialize;

use crate::measure::Effort;
use crate::{Error, TestTensions};
use tongue_core::dynamics::{Control, IntegrationMethod};

use super::time_stepping::integrate;

const TIMES: [f64; 4] = [1.0, 3.0, 10.0, 30.0];
/// Error of a step, m, which is far below the distance from equilibrium.
const TOLERANCE: f64 = 1e-9;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stopped {
    pub t_end_s: f64,
    /// Largest distance of a node from its position at equilibrium, mm.
    pub left_mm: f64,
    /// `left_mm` over the largest displacement at equilibrium.
    pub left_part: f64,
    /// Largest difference of a ratio from that at equilibrium.
    pub ratio_error: f64,
    /// Median wall-clock time to reach `t_end_s`, s.
    pub seconds: f64,
    pub steps: u64,
    pub factorisations: u64,
}

/// Compares the shapes at `TIMES` with the equilibrium.
pub fn work_precision(scene: &TestTensions, effort: &Effort) -> Result<Vec<Stopped>, Error> {
    let (reference, _) = scene.reference()?;
    let motion = scene.motion()?;
    let whole = Effort { longest_run_s: f64::INFINITY, ..*effort };
    let outcome = integrate(&motion, IntegrationMethod::TrBdf2, Control::Adaptive(TOLERANCE), &TIMES, &whole);
    if let Some(why) = outcome.missing {
        return Err(format!("the reference trajectory was not found: {why}").into());
    }
    let (moved, _) = scene.differences(scene.system.rest(), &reference);
    let stopped = outcome.stops.into_iter().map(|stop| {
        let (left_mm, ratio_error) = scene.differences(&stop.positions, &reference);
        Stopped {
            t_end_s: stop.time,
            left_mm,
            left_part: left_mm / moved,
            ratio_error,
            seconds: stop.seconds,
            steps: stop.counts.steps,
            factorisations: stop.counts.factorisations,
        }
    });
    Ok(stopped.collect())
}
