//! Axis 3: the distance from equilibrium of a trajectory that is stopped early.

use serde::Serialize;

use crate::measure::Effort;
use crate::{Error, TestTensions};
use tongue_core::dynamics::{Control, IntegrationMethod};

use super::time_stepping::integrate;

const TIMES: [f64; 4] = [1.0, 3.0, 10.0, 30.0];
/// Tolerance of each step, m. Its error is far below the distance from equilibrium.
const TOLERANCE: f64 = 1e-9;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stopped {
    /// Time at which it was stopped, s.
    pub t_end_s: f64,
    /// Largest distance of a node from its place at equilibrium, mm.
    pub left_mm: f64,
    /// `left_mm` as a part of the largest displacement at equilibrium.
    pub left_part: f64,
    /// Largest difference of a ratio from that at equilibrium.
    pub ratio_error: f64,
    /// Median wall-clock time to reach that time, s.
    pub seconds: f64,
    pub steps: u64,
    pub factorisations: u64,
}

/// Compares the shape at each of the times with the equilibrium; integrated by TR-BDF2 at a tight tolerance.
pub fn work_precision(scene: &TestTensions, effort: &Effort) -> Result<Vec<Stopped>, Error> {
    let (reference, _) = scene.reference()?;
    let motion = scene.motion()?;
    let whole = Effort { longest_run_s: f64::INFINITY, ..*effort };
    let marched = integrate(&motion, IntegrationMethod::TrBdf2, Control::Adaptive(TOLERANCE), &TIMES, &whole);
    if let Some(why) = marched.missing {
        return Err(format!("the reference trajectory was not found: {}", why.words()).into());
    }
    let (moved, _) = scene.apart(scene.system.rest(), &reference);
    let stopped = marched.stops.into_iter().map(|stop| {
        let (left_mm, ratio_error) = scene.apart(&stop.positions, &reference);
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
