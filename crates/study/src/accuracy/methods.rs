//! Axes 1 to 3: methods that find the equilibrium, those that follow the motion to t = 3 s, where the thesis stops, and what is left from
//! equilibrium there.

use std::time::Instant;

use nalgebra::SVector;
use serde::Serialize;

use tongue_core::dynamics::{self, Control, IntegrationMethod, Motion, MotionStatus, StepCounts};
use tongue_core::statics::{SolveStatus, Workspace};
use tongue_core::statistics::{least_by, median};

use crate::measure::{Effort, measure};
use crate::table::duration;
use crate::{Error, TestTensions};

/// How a run ended that reached its tolerance.
pub const DONE: &str = "done";
pub const NEWTON: &str = "Newton";

/// Residual forces at which Newton's method stops, N.
const FORCE_TOLERANCES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11];
/// Times at which implicit methods are compared with the equilibrium, s.
const TIMES: [f64; 11] = [1.0, 3.0, 5.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0, 60.0, 100.0];
/// Times for explicit methods, s; each second costs a million steps. At the last one they are within 1e-2 mm.
const EXPLICIT_TIMES: [f64; 5] = [1.0, 3.0, 5.0, 8.0, 10.0];
/// Tolerances of the adaptive methods to equilibrium, m.
const STEP_TOLERANCES: [f64; 4] = [1e-4, 1e-5, 1e-6, 1e-8];
/// Steps of explicit methods over the stability limit; a step of twice the limit is refused.
const PARTS_OF_LIMIT: [f64; 3] = [2.0, 0.99, 0.01];

/// Times at which trajectories are compared, s, tolerances of the adaptive methods, m, and steps of explicit methods over the stability
/// limit.
const TIMES_ON_THE_WAY: [f64; 7] = [0.03, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0];
pub(super) const TOLERANCES_ON_THE_WAY: [f64; 6] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
pub(super) const PARTS_ON_THE_WAY: [f64; 3] = [2.0, 0.99, 0.05];
/// Tolerances of the reference and of the run that checks it, m. The error of a trajectory grows with the power 2/3 of the tolerance, so
/// the reference is a hundred times more accurate than the best run.
const REFERENCE: [f64; 2] = [1e-12, 1e-11];

/// Times at which a trajectory is stopped, s.
const EARLY_TIMES: [f64; 4] = [1.0, 3.0, 10.0, 30.0];
/// Error of a step, m, which is far below the distance from equilibrium.
const EARLY_TOLERANCE: f64 = 1e-9;

/// Number of measurements of the cost of a step, of which the quickest counts.
const MEASUREMENTS: usize = 5;

/// A run of a method: a point in the diagram of time against accuracy.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Run {
    pub method: &'static str,
    pub setting: String,
    /// Largest distance of a node from its position in the reference, mm.
    pub error_mm: Option<f64>,
    /// Largest difference of a muscle's ratio to GGa.
    pub ratio_error: Option<f64>,
    /// Median wall-clock time, s.
    pub seconds: Option<f64>,
    pub repeats: usize,
    pub steps: u64,
    /// Evaluations of the force; in Newton's method, of the energy.
    pub force_evaluations: u64,
    pub factorisations: u64,
    /// `done`, or whether and why it stopped short, failed or was refused.
    pub ended: String,
}

impl Run {
    fn new(method: &'static str, setting: String, ended: String) -> Self {
        Self { method, setting, ended, ..Self::default() }
    }

    /// Sets the errors (of a position, mm, and of a ratio), the median time (s) with the number of repeats, and the cost.
    fn with_measurements(
        self,
        (error_mm, ratio_error): (f64, f64),
        (seconds, repeats): (f64, usize),
        counts: StepCounts,
    ) -> Self {
        Self {
            error_mm: Some(error_mm),
            ratio_error: Some(ratio_error),
            seconds: Some(seconds),
            repeats,
            steps: counts.steps,
            force_evaluations: counts.force_evaluations,
            factorisations: counts.factorisations,
            ..self
        }
    }
}

pub fn fastest<'a>(
    runs: impl IntoIterator<Item = &'a Run>,
    error: fn(&Run) -> Option<f64>,
    most: f64,
) -> Option<&'a Run> {
    let timed = runs.into_iter().filter_map(|run| Some((run.seconds?, error(run)?, run)));
    let good = timed.filter(|(_, error, _)| *error <= most);
    least_by(good, |(seconds, ..)| *seconds).map(|(.., run)| run)
}

/// How a solve ended, in words. If it stopped before its tolerance, its last state is measured.
pub fn ending(status: SolveStatus) -> String {
    let why = match status {
        SolveStatus::Converged => return DONE.to_owned(),
        SolveStatus::IterationLimit => "iteration limit",
        SolveStatus::Stalled => "rounding stops the descent before the force tolerance is reached",
        SolveStatus::Inverted => "a cell is inverted",
        SolveStatus::Unstable => "an unstable equilibrium",
        SolveStatus::NotFinite => "a number is not finite",
    };
    format!("stopped short: {why}")
}

/// Axis 1: runs of every method, and the residual force of the reference, N.
pub fn to_equilibrium(scene: &TestTensions, effort: &Effort) -> Result<(Vec<Run>, f64), Error> {
    let (reference, residual) = scene.reference()?;
    let mut workspace = Workspace::new(&scene.system);
    let mut runs = Vec::new();
    for tolerance in FORCE_TOLERANCES {
        let timed = measure(effort, || scene.solve(&mut workspace, tolerance));
        let solution = timed.result;
        let counts = StepCounts {
            steps: solution.iterations as u64,
            force_evaluations: solution.energy_evaluations as u64,
            factorisations: solution.factorisations as u64,
            ..StepCounts::default()
        };
        let run = Run::new(NEWTON, format!("force tolerance {tolerance:.0e} N"), ending(solution.status));
        let errors = scene.differences(workspace.positions(), &reference);
        runs.push(run.with_measurements(errors, (timed.seconds, timed.repeats), counts));
    }
    let motion = scene.motion()?;
    for (method, control) in settings(&motion, &STEP_TOLERANCES, &PARTS_OF_LIMIT) {
        let times: &[f64] = if method.is_explicit() { &EXPLICIT_TIMES } else { &TIMES };
        let outcome = integrate(&motion, method, control, times, effort);
        let to = |time: f64, ended: String| {
            Run::new(method.name(), format!("{}, to {time} s", words(control)), ended)
        };
        runs.extend(outcome.stops.iter().map(|stop| {
            let errors = scene.differences(&stop.positions, &reference);
            let run = to(stop.time, DONE.to_owned());
            run.with_measurements(errors, (stop.seconds, outcome.repeats), stop.counts)
        }));
        if let Some(why) = outcome.missing {
            let reached = outcome.stops.len();
            let next = if reached == 0 { times.last() } else { times.get(reached) };
            runs.push(to(next.copied().unwrap_or_default(), why));
        }
    }
    Ok((runs, residual))
}

/// Axis 2: runs of every method, and the largest distance between the reference and the run that checks it, mm.
pub fn along_the_trajectory(scene: &TestTensions, effort: &Effort) -> Result<(Vec<Run>, f64), Error> {
    let motion = scene.motion()?;
    let once = Effort { repeats: 1, ..*effort };
    let [reference, check] = REFERENCE;
    let reference = reference_stops(&motion, reference, &TIMES_ON_THE_WAY, &once)?;
    let (doubt, _) =
        largest_errors(scene, &reference_stops(&motion, check, &TIMES_ON_THE_WAY, &once)?, &reference);
    let runs = settings(&motion, &TOLERANCES_ON_THE_WAY, &PARTS_ON_THE_WAY).into_iter();
    let runs = runs.map(|(method, control)| {
        let outcome = integrate(&motion, method, control, &TIMES_ON_THE_WAY, effort);
        let is_done = outcome.missing.is_none();
        let ended = outcome.missing.unwrap_or_else(|| DONE.to_owned());
        let run = Run::new(method.name(), words(control), ended);
        match outcome.stops.last().filter(|_| is_done) {
            Some(last) => {
                let errors = largest_errors(scene, &outcome.stops, &reference);
                run.with_measurements(errors, (last.seconds, outcome.repeats), last.counts)
            }
            None => run,
        }
    });
    Ok((runs.collect(), doubt))
}

/// Largest errors over all times: of a position (mm) and of a ratio.
fn largest_errors(scene: &TestTensions, stops: &[Stop], reference: &[Stop]) -> (f64, f64) {
    let errors = stops.iter().zip(reference).map(|(a, b)| scene.differences(&a.positions, &b.positions));
    errors.fold((0.0, 0.0), |(e, r): (f64, f64), (error, ratio)| (e.max(error), r.max(ratio)))
}

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

/// Axis 3: the distance from equilibrium of a trajectory that is stopped early.
pub fn stopped_early(scene: &TestTensions, effort: &Effort) -> Result<Vec<Stopped>, Error> {
    let (reference, _) = scene.reference()?;
    let stops = reference_stops(&scene.motion()?, EARLY_TOLERANCE, &EARLY_TIMES, effort)?;
    let (moved, _) = scene.differences(scene.system.rest(), &reference);
    let stopped = stops.into_iter().map(|stop| {
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

/// A trajectory by TR-BDF2, however long it takes.
fn reference_stops(
    motion: &Motion<'_, 2>,
    tolerance: f64,
    times: &[f64],
    effort: &Effort,
) -> Result<Vec<Stop>, Error> {
    let whole = Effort { longest_run_s: f64::INFINITY, ..*effort };
    let outcome = integrate(motion, IntegrationMethod::TrBdf2, Control::Adaptive(tolerance), times, &whole);
    match outcome.missing {
        Some(why) => Err(format!("the reference trajectory was not found: {why}").into()),
        None => Ok(outcome.stops),
    }
}

struct Stop {
    time: f64,
    positions: Vec<SVector<f64, 2>>,
    /// Median wall-clock time from the start, s.
    seconds: f64,
    counts: StepCounts,
}

#[derive(Default)]
struct TimeSteppingRun {
    stops: Vec<Stop>,
    repeats: usize,
    /// Why later times were not reached: the run failed or was refused.
    missing: Option<String>,
}

fn words(control: Control) -> String {
    match control {
        Control::Fixed(dt) => format!("step {dt:.2e} s"),
        Control::Adaptive(tolerance) => format!("tolerance {:.0e} mm", tolerance * 1e3),
    }
}

/// Every method with its settings: tolerances (m) if it controls its error, otherwise parts of its stability limit.
fn settings(motion: &Motion<'_, 2>, tolerances: &[f64], parts: &[f64]) -> Vec<(IntegrationMethod, Control)> {
    let of_method = IntegrationMethod::ALL.map(|method| match method.step_limit(motion) {
        Some(limit) => parts.iter().map(|p| (method, Control::Fixed(p * limit))).collect::<Vec<_>>(),
        None => tolerances.iter().map(|t| (method, Control::Adaptive(*t))).collect(),
    });
    of_method.concat()
}

/// Integrates to each of the ascending `times` (s), with as many repeats as the effort allows. A run with fixed steps that would take
/// longer than the effort allows is refused.
fn integrate(
    motion: &Motion<'_, 2>,
    method: IntegrationMethod,
    control: Control,
    times: &[f64],
    effort: &Effort,
) -> TimeSteppingRun {
    // The check of the step computes a spectrum, whose time is not part of the run.
    let checked = method.checked_integrator(motion, control);
    let begin = Instant::now();
    let once = || once(motion, method, control, times, effort);
    let mut run = match checked.map_err(Error::from).and_then(|_| once()) {
        Ok(run) => run,
        Err(why) => {
            return TimeSteppingRun { missing: Some(format!("refused: {why}")), ..Default::default() };
        }
    };
    let mut seconds: Vec<Vec<f64>> = run.stops.iter().map(|s| vec![s.seconds]).collect();
    while run.missing.is_none()
        && run.repeats < effort.repeats
        && begin.elapsed().as_secs_f64() < effort.repeat_within_s
    {
        let Ok(again) = once() else { break };
        seconds.iter_mut().zip(&again.stops).for_each(|(all, s)| all.push(s.seconds));
        run.repeats += 1;
    }
    for (stop, all) in run.stops.iter_mut().zip(seconds) {
        stop.seconds = median(all).unwrap_or(stop.seconds);
    }
    run
}

fn once(
    motion: &Motion<'_, 2>,
    method: IntegrationMethod,
    control: Control,
    times: &[f64],
    effort: &Effort,
) -> Result<TimeSteppingRun, Error> {
    let mut integrator = method.integrator(motion, control)?;
    let mut state = motion.at_rest();
    let mut counts = StepCounts::default();
    if let Control::Fixed(dt) = control {
        let end = times.last().copied().unwrap_or(0.0);
        let steps = end / dt;
        // The quickest measurement counts, because other load on the machine must not cause a refusal.
        let costs = (0..MEASUREMENTS).filter_map(|_| {
            let mut trial = method.integrator(motion, control).ok()?;
            Some(dynamics::cost_per_step(motion, trial.as_mut(), &state, end).as_secs_f64())
        });
        let estimate = steps * costs.fold(f64::INFINITY, f64::min);
        if estimate > effort.longest_run_s || steps > effort.most_steps {
            let about = duration(estimate);
            return Err(format!(
                "{steps:.1e} steps to t = {end} s, about {about}, are more than one run of this study may take; take tr-bdf2"
            )
            .into());
        }
    }
    let mut run = TimeSteppingRun { repeats: 1, ..TimeSteppingRun::default() };
    let clock = Instant::now();
    for &time in times {
        let so_far = clock.elapsed().as_secs_f64();
        if so_far > effort.longest_run_s {
            run.missing = Some(format!("refused: cut off after {}", duration(so_far)));
            break;
        }
        let outcome = dynamics::run(motion, integrator.as_mut(), &mut state, time, &[], &mut ());
        counts.steps += outcome.counts.steps;
        counts.force_evaluations += outcome.counts.force_evaluations;
        counts.factorisations += outcome.counts.factorisations;
        if outcome.status != MotionStatus::Completed {
            run.missing = Some(format!("failed: {:?} at t = {:.3} s", outcome.status, outcome.time_s));
            break;
        }
        let seconds = clock.elapsed().as_secs_f64();
        run.stops.push(Stop { time, positions: state.positions.clone(), seconds, counts });
    }
    Ok(run)
}
