//! Trajectories at given times, with the time that it takes to reach them.

use std::time::Instant;

use nalgebra::SVector;

use tongue_core::dynamics::{self, Control, IntegrationMethod, Motion, MotionStatus, StepCounts};
use tongue_core::statistics::median;
use tongue_core::system::SystemError;

use crate::measure::Effort;
use crate::table::duration;

/// Number of measurements of the cost of a step, of which the quickest counts.
const MEASUREMENTS: usize = 5;

#[derive(Debug, Clone)]
pub struct Stop {
    pub time: f64,
    pub positions: Vec<SVector<f64, 2>>,
    /// Median wall-clock time from the start, s.
    pub seconds: f64,
    pub counts: StepCounts,
}

#[derive(Debug, Clone, Default)]
pub struct TimeSteppingRun {
    pub stops: Vec<Stop>,
    pub repeats: usize,
    /// Why later times were not reached: the run failed or was refused.
    pub missing: Option<String>,
}

/// Integrates to each of the ascending `times` (s), with as many repeats as the effort allows. A run with fixed steps that would take
/// longer than the effort allows is refused.
pub fn integrate(
    motion: &Motion<'_, 2>,
    method: IntegrationMethod,
    control: Control,
    times: &[f64],
    effort: &Effort,
) -> TimeSteppingRun {
    // The check of the step computes a spectrum, whose time is not part of the run.
    let checked = method.checked_integrator(motion, control);
    let begin = Instant::now();
    let mut run = match checked.and_then(|_| once(motion, method, control, times, effort)) {
        Ok(run) => run,
        Err(error) => return refused(&error.to_string()),
    };
    let mut seconds: Vec<Vec<f64>> = run.stops.iter().map(|s| vec![s.seconds]).collect();
    while run.missing.is_none()
        && run.repeats < effort.repeats
        && begin.elapsed().as_secs_f64() < effort.repeat_within_s
    {
        let Ok(again) = once(motion, method, control, times, effort) else { break };
        seconds.iter_mut().zip(&again.stops).for_each(|(all, s)| all.push(s.seconds));
        run.repeats += 1;
    }
    for (stop, all) in run.stops.iter_mut().zip(seconds) {
        stop.seconds = median(all).unwrap_or(stop.seconds);
    }
    run
}

fn refused(why: &str) -> TimeSteppingRun {
    TimeSteppingRun { missing: Some(format!("refused: {why}")), ..TimeSteppingRun::default() }
}

pub fn words(control: Control) -> String {
    match control {
        Control::Fixed(dt) => format!("step {dt:.2e} s"),
        Control::Adaptive(tolerance) => format!("tolerance {:.0e} mm", tolerance * 1e3),
    }
}

/// Every method with its settings: tolerances (m) if it controls its error, otherwise parts of its stability limit.
pub fn settings(
    motion: &Motion<'_, 2>,
    tolerances: &[f64],
    parts: &[f64],
) -> Vec<(IntegrationMethod, Control)> {
    let of_method = IntegrationMethod::ALL.map(|method| match method.step_limit(motion) {
        Some(limit) => parts.iter().map(|p| (method, Control::Fixed(p * limit))).collect::<Vec<_>>(),
        None => tolerances.iter().map(|t| (method, Control::Adaptive(*t))).collect(),
    });
    of_method.concat()
}

fn once(
    motion: &Motion<'_, 2>,
    method: IntegrationMethod,
    control: Control,
    times: &[f64],
    effort: &Effort,
) -> Result<TimeSteppingRun, SystemError> {
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
            let why = format!(
                "{steps:.1e} steps to t = {end} s, about {}, are more than one run of this study may take; take tr-bdf2",
                duration(estimate)
            );
            return Ok(refused(&why));
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
        counts.rejected += outcome.counts.rejected;
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
