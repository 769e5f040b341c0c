//! Axis 1: methods that find the equilibrium.

use nalgebra::SVector;

use crate::{Error, TestTensions};
use tongue_core::dynamics::{Control, IntegrationMethod, Motion, StepCounts};
use tongue_core::statics::Workspace;

use super::runs::{DONE, Run, ending};
use super::time_stepping::{integrate, settings, words};
use crate::measure::{Effort, Timed, measure};

pub const NEWTON: &str = "Newton";

/// Residual forces at which Newton's method stops, N.
const TOLERANCES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11];
/// Times at which implicit methods are compared with the equilibrium, s.
const TIMES: [f64; 11] = [1.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0, 60.0, 100.0];
/// Times for explicit methods, s; each second costs a million steps. At the last one they are within 1e-2 mm.
const EXPLICIT_TIMES: [f64; 5] = [1.0, 3.0, 5.0, 8.0, 10.0];
/// Tolerances of the adaptive methods, m.
const STEP_TOLERANCES: [f64; 4] = [1e-4, 1e-5, 1e-6, 1e-8];
/// Steps of explicit methods over the stability limit; a step of twice the limit is refused.
const PARTS_OF_LIMIT: [f64; 3] = [2.0, 0.99, 0.01];

/// Runs of every method, and the residual force of the reference, N.
pub fn work_precision(scene: &TestTensions, effort: &Effort) -> Result<(Vec<Run>, f64), Error> {
    let (reference, residual) = scene.reference()?;
    let mut workspace = Workspace::new(&scene.system);
    let mut runs = Vec::new();
    for tolerance in TOLERANCES {
        let Timed { result: s, seconds, repeats } =
            measure(effort, || scene.solve(&mut workspace, tolerance));
        let counts = StepCounts {
            steps: s.iterations as u64,
            force_evaluations: s.energy_evaluations as u64,
            factorisations: s.factorisations as u64,
            ..StepCounts::default()
        };
        let setting = format!("force tolerance {tolerance:.0e} N");
        let run = Run { method: NEWTON, setting, ended: ending(s.status), ..Run::default() };
        let errors = scene.differences(workspace.positions(), &reference);
        runs.push(run.with_measurements(errors, (seconds, repeats), counts));
    }
    let motion = scene.motion()?;
    for setting in settings(&motion, &STEP_TOLERANCES, &PARTS_OF_LIMIT) {
        runs.extend(runs_to_equilibrium(scene, &motion, setting, &reference, effort));
    }
    Ok((runs, residual))
}

fn runs_to_equilibrium(
    scene: &TestTensions,
    motion: &Motion<'_, 2>,
    (method, control): (IntegrationMethod, Control),
    reference: &[SVector<f64, 2>],
    effort: &Effort,
) -> Vec<Run> {
    let times: &[f64] = if method.is_explicit() { &EXPLICIT_TIMES } else { &TIMES };
    let outcome = integrate(motion, method, control, times, effort);
    let to = |time: f64| Run {
        method: method.name(),
        setting: format!("{}, to {time} s", words(control)),
        ended: DONE.to_owned(),
        ..Run::default()
    };
    let mut runs: Vec<Run> = Vec::new();
    for stop in &outcome.stops {
        let errors = scene.differences(&stop.positions, reference);
        runs.push(to(stop.time).with_measurements(errors, (stop.seconds, outcome.repeats), stop.counts));
    }
    if let Some(why) = outcome.missing {
        let next = if runs.is_empty() { times.last() } else { times.get(runs.len()) };
        runs.push(Run { ended: why, ..to(next.copied().unwrap_or_default()) });
    }
    runs
}
