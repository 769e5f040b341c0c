//! Axis 1: ways to the equilibrium.

use crate::dynamics::{Control, Method, Motion, Tensions};
use crate::statics::Workspace;

use super::StudyError;
use super::ladder::{Effort, Ended, Run, measure};
use super::march::march;
use super::scene::{Scene, shortfall};
use super::{lbfgs, relaxation};

/// Names of the methods that are no integrators.
pub const NEWTON: &str = "Newton";
/// L-BFGS through argmin.
pub const LBFGS: &str = "L-BFGS";
/// Dynamic relaxation.
pub const RELAXATION: &str = "dynamic relaxation";

/// Largest residual force at which a solve stops, N.
const TOLERANCES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11];
/// Times at which integrators are asked how far they are, s.
const TIMES: [f64; 11] = [1.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0, 60.0, 100.0];
/// The same for explicit methods: by the last they are within 1e-2 mm, and each second costs them a million steps.
const EXPLICIT_TIMES: [f64; 5] = [1.0, 3.0, 5.0, 8.0, 10.0];
/// Steps of backward Euler, s.
const IMPLICIT_STEPS: [f64; 4] = [0.1, 0.5, 2.0, 10.0];
/// Tolerances of the adaptive methods, m.
const STEP_TOLERANCES: [f64; 4] = [1e-4, 1e-5, 1e-6, 1e-8];
/// Parts of the stability limit that explicit methods step with; two is refused.
const PARTS: [f64; 3] = [2.0, 0.99, 0.01];
const MOST_ITERATIONS: u64 = 200_000;

/// The ladder of every method, and the force that is left at the reference, N.
///
/// # Errors
/// [`StudyError`] where there is no reference.
pub fn ladder(scene: &Scene, effort: &Effort) -> Result<(Vec<Run>, f64), StudyError> {
    let (reference, residual) = scene.reference()?;
    let mut runs = Vec::new();
    let system = &scene.system;
    let row = |method: &str, setting: String| Run::refused(method, setting, String::new());
    let mut workspace = Workspace::new(system);
    for tolerance in TOLERANCES {
        let timed = measure(effort, || scene.solve(&mut workspace, tolerance));
        let short = shortfall(timed.result.status);
        runs.push(Run {
            error_mm: Some(scene.distance_mm(workspace.positions(), &reference)),
            ratio_error: Some(scene.ratio_difference(workspace.positions(), &reference)),
            seconds: Some(timed.seconds),
            repeats: timed.repeats,
            steps: timed.result.iterations as u64,
            force_evaluations: timed.result.energy_evaluations as u64,
            factorisations: timed.result.factorisations as u64,
            ended: short.map_or(Ended::Done, |why| Ended::Short(why.into())),
            ..row(NEWTON, format!("force tolerance {tolerance:.0e} N"))
        });
    }
    for tolerance in TOLERANCES {
        let timed = measure(effort, || lbfgs::minimise(system, &scene.tensions, tolerance, MOST_ITERATIONS));
        let done = timed.result;
        runs.push(Run {
            error_mm: Some(scene.distance_mm(&done.positions, &reference)),
            ratio_error: Some(scene.ratio_difference(&done.positions, &reference)),
            seconds: Some(timed.seconds),
            repeats: timed.repeats,
            steps: done.iterations,
            force_evaluations: done.evaluations,
            ended: done.shortfall.map_or(Ended::Done, Ended::Short),
            ..row(LBFGS, format!("gradient tolerance {tolerance:.0e} N"))
        });
    }
    for tolerance in TOLERANCES {
        let timed =
            measure(effort, || relaxation::relax(system, &scene.tensions, tolerance, MOST_ITERATIONS));
        let done = timed.result;
        let ended = if done.converged { Ended::Done } else { Ended::Short("step limit".into()) };
        runs.push(Run {
            error_mm: Some(scene.distance_mm(&done.positions, &reference)),
            ratio_error: Some(scene.ratio_difference(&done.positions, &reference)),
            seconds: Some(timed.seconds),
            repeats: timed.repeats,
            steps: done.steps,
            force_evaluations: done.steps,
            ended,
            ..row(RELAXATION, format!("force tolerance {tolerance:.0e} N"))
        });
    }
    let motion = Motion::new(system, Tensions::Constant(scene.tensions.clone()))?;
    for (method, control) in controls(&motion) {
        runs.extend(to_rest(scene, &motion, method, control, &reference, effort));
    }
    Ok((runs, residual))
}

/// Every integrator with its steps or tolerances.
fn controls(motion: &Motion<'_, 2>) -> Vec<(Method, Control)> {
    let mut out = Vec::new();
    for method in Method::ALL {
        if method.is_adaptive() {
            out.extend(STEP_TOLERANCES.map(|t| (method, Control::Adaptive(t))));
        } else if let Some(limit) = method.step_limit(motion) {
            out.extend(PARTS.map(|p| (method, Control::Fixed(p * limit))));
        } else {
            out.extend(IMPLICIT_STEPS.map(|dt| (method, Control::Fixed(dt))));
        }
    }
    out
}

/// A step or tolerance in words.
pub fn in_words(control: Control) -> String {
    match control {
        Control::Fixed(dt) => format!("step {dt:.2e} s"),
        Control::Adaptive(tolerance) => format!("tolerance {:.0e} mm", tolerance * 1e3),
    }
}

fn to_rest(
    scene: &Scene,
    motion: &Motion<'_, 2>,
    method: Method,
    control: Control,
    reference: &[nalgebra::SVector<f64, 2>],
    effort: &Effort,
) -> Vec<Run> {
    // A fixed implicit step is not cut: only multiples of it are looked at.
    let falls_on = |t: f64| match control {
        Control::Fixed(dt) => (t / dt - (t / dt).round()).abs() < 1e-9,
        Control::Adaptive(_) => true,
    };
    let times: Vec<f64> = match method.is_explicit() {
        true => EXPLICIT_TIMES.to_vec(),
        false => TIMES.into_iter().filter(|t| falls_on(*t)).collect(),
    };
    let marched = march(motion, method, control, &times, effort);
    let words = in_words(control);
    let mut runs: Vec<Run> = marched
        .stops
        .iter()
        .map(|stop| Run {
            error_mm: Some(scene.distance_mm(&stop.positions, reference)),
            ratio_error: Some(scene.ratio_difference(&stop.positions, reference)),
            seconds: Some(stop.seconds),
            repeats: marched.repeats,
            steps: stop.counts.steps,
            force_evaluations: stop.counts.force_evaluations,
            factorisations: stop.counts.factorisations,
            ended: Ended::Done,
            ..Run::refused(method.name(), format!("{words}, to {} s", stop.time), String::new())
        })
        .collect();
    if let Some((refused, why)) = marched.missing {
        let ended = if refused { Ended::Refused(why) } else { Ended::Failed(why) };
        let next = if marched.stops.is_empty() { times.last() } else { times.get(marched.stops.len()) };
        let setting = format!("{words}, to {} s", next.copied().unwrap_or_default());
        runs.push(Run { ended, ..Run::refused(method.name(), setting, String::new()) });
    }
    runs
}
