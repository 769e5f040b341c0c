//! Axis 2: the trajectory to t = 3 s, where the thesis stops.

use crate::measure::Effort;
use crate::{Error, TestTensions};
use tongue_core::dynamics::{Control, IntegrationMethod};

use super::runs::{DONE, Run};
use super::time_stepping::{Stop, TimeSteppingRun, integrate, settings, words};

/// Times at which trajectories are compared, s.
const TIMES: [f64; 7] = [0.03, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0];
/// Tolerances of the adaptive methods, m.
pub(super) const STEP_TOLERANCES: [f64; 6] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Tolerances of the reference and of the run that checks it, m. The error of a trajectory grows with the power 2/3 of the tolerance, so
/// the reference is a hundred times more accurate than the best run.
const REFERENCE: [f64; 2] = [1e-12, 1e-11];
/// Steps of explicit methods over the stability limit; a step of twice the limit is refused.
pub(super) const PARTS_OF_LIMIT: [f64; 3] = [2.0, 0.99, 0.05];

/// Runs of every method, and the largest distance between the reference and the run that checks it, mm.
pub fn work_precision(scene: &TestTensions, effort: &Effort) -> Result<(Vec<Run>, f64), Error> {
    let motion = scene.motion()?;
    let once = Effort { repeats: 1, longest_run_s: f64::INFINITY, ..*effort };
    let [reference, check] =
        REFERENCE.map(|t| integrate(&motion, IntegrationMethod::TrBdf2, Control::Adaptive(t), &TIMES, &once));
    if let Some(why) = reference.missing.or(check.missing) {
        return Err(format!("the reference trajectory was not found: {why}").into());
    }
    let (doubt, _) = largest_errors(scene, &check.stops, &reference.stops);
    let mut runs = Vec::new();
    for (method, control) in settings(&motion, &STEP_TOLERANCES, &PARTS_OF_LIMIT) {
        let TimeSteppingRun { stops, repeats, missing } = integrate(&motion, method, control, &TIMES, effort);
        let ended = missing.unwrap_or_else(|| DONE.to_owned());
        let run = Run { method: method.name(), setting: words(control), ended, ..Run::default() };
        runs.push(match stops.last().filter(|_| run.ended == DONE) {
            Some(last) => {
                let errors = largest_errors(scene, &stops, &reference.stops);
                run.with_measurements(errors, (last.seconds, repeats), last.counts)
            }
            None => run,
        });
    }
    Ok((runs, doubt))
}

/// Largest errors over all times: of a position (mm) and of a ratio.
fn largest_errors(scene: &TestTensions, stops: &[Stop], reference: &[Stop]) -> (f64, f64) {
    let errors = stops.iter().zip(reference).map(|(a, b)| scene.differences(&a.positions, &b.positions));
    errors.fold((0.0, 0.0), |(e, r): (f64, f64), (error, ratio)| (e.max(error), r.max(ratio)))
}
