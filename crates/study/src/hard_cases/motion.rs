//! Cases 1 and 8: motions with the misprints of the thesis, and with steps from a microsecond to a hundred seconds.

use crate::test_tensions::{PUBLISHED_A, TestTensions, tongue};
use tongue_core::body::largest_distance;
use tongue_core::dynamics::{
    self, Control, IntegrationMethod, Motion, MotionOutcome, MotionStatus, Tensions,
};
use tongue_core::geometry::Point;
use tongue_core::system::Model;
use tongue_files::report::status_name;

use super::HardCase;
use crate::Error;
use crate::measure::timed;

/// Step of table 4.2, s.
const PRINTED_STEP: f64 = 5.0e-6;
/// Mass of a node as printed, and by eq. 4.1, kg.
const MASSES: [(&str, f64); 2] = [("m 2.2e-4 (printed)", 2.2e-4), ("m 2.2e-2", 2.2e-2)];
/// Adaptive runs, with the tolerance of each step, m.
const ADAPTIVE: (IntegrationMethod, Control) = (IntegrationMethod::TrBdf2, Control::Adaptive(1e-5));
/// End of the motions in the thesis, s.
const PRINTED_END: f64 = 3.0;
/// Largest allowed difference of an explicit run from an implicit one at its end, m.
const MOST_DRIFT_M: f64 = 1e-6;
const PRINTED_STEPS: f64 = 4000.0;

/// Case 1: table 4.2 as printed, and with each misprint corrected. Verlet must refuse the step and name the limit, or run; TR-BDF2 must
/// run.
pub(super) fn printed_table() -> Result<Vec<HardCase>, Error> {
    let weak = Model { viscosity: 3.0e-3, ..Model::default() };
    let (mesh, mut rows) = (tongue()?, Vec::new());
    let bodies = [
        ("kappa_s 1.46e3 (printed)", TestTensions::as_printed(&mesh)?),
        ("kappa_s 1.46", TestTensions::new(&mesh, &Model::default(), &PUBLISHED_A)?),
        ("kappa_s 1.46, b 3e-3", TestTensions::new(&mesh, &weak, &PUBLISHED_A)?),
    ];
    for (kappa, body) in bodies {
        for (mass_name, mass) in MASSES {
            let motion = Motion::with_mass(&body.system, Tensions::constant(body.tensions.clone()), mass)?;
            rows.push(explicit(&format!("{mass_name}, {kappa}, dt 5e-6 s"), &motion)?);
            let adaptive = format!("{mass_name}, {kappa}, adaptive to {PRINTED_END} s");
            rows.push(run(&adaptive, &motion, ADAPTIVE, PRINTED_END)?.0);
        }
    }
    Ok(rows)
}

/// A step that is refused is also run without the check, which must end in another status than `completed`.
fn explicit(name: &str, motion: &Motion<'_, 2>) -> Result<HardCase, Error> {
    let (method, control) = (IntegrationMethod::Verlet, Control::Fixed(PRINTED_STEP));
    let (unchecked, _) = run(name, motion, (method, control), PRINTED_STEPS * PRINTED_STEP)?;
    let Err(error) = method.checked_integrator(motion, control) else { return Ok(unchecked) };
    let row = HardCase::refusal(name, method.name(), Some(error.to_string()));
    let note = format!("{}; run all the same: {} at {}", row.note, unchecked.status, unchecked.note);
    Ok(HardCase { kept: unchecked.status != "completed", note, ..row })
}

/// Case 8: implicit steps from a microsecond to a hundred seconds, many explicit steps, and a sudden load of 300 N.
pub(super) fn steps(full: bool) -> Result<Vec<HardCase>, Error> {
    let mesh = tongue()?;
    let body = TestTensions::new(&mesh, &Model::default(), &PUBLISHED_A)?;
    let motion = body.motion()?;
    let mut rows = Vec::new();
    for dt in [1e-6, 1e-4, 1e-2, 1.0, 100.0] {
        let name = format!("20 steps of {dt:e} s");
        rows.push(run(&name, &motion, (IntegrationMethod::TrBdf2, Control::Fixed(dt)), 20.0 * dt)?.0);
    }
    let sudden = TestTensions::new(&mesh, &Model::default(), &PUBLISHED_A.map(|(m, _)| (m, 300.0)))?;
    let suddenly = sudden.motion()?;
    let name = "300 N at once, adaptive to 3 s";
    rows.push(run(name, &suddenly, ADAPTIVE, PRINTED_END)?.0);
    let count = if full { 1_000_000 } else { 10_000 };
    if let Some(limit) = IntegrationMethod::Verlet.step_limit(&motion) {
        let dt = 0.5 * limit;
        let name = format!("{count} steps of half the stability limit, {dt:.2e} s");
        let end = f64::from(count) * dt;
        let (mut row, explicit) = run(&name, &motion, (IntegrationMethod::Verlet, Control::Fixed(dt)), end)?;
        let (_, implicit) =
            integrate(&motion, (IntegrationMethod::TrBdf2, Control::Fixed(end / 400.0)), end)?;
        let drift = largest_distance(&explicit, &implicit);
        row.note += &format!(", {drift:.1e} m from tr-bdf2");
        row.kept &= row.converged && drift < MOST_DRIFT_M;
        rows.push(row);
    }
    Ok(rows)
}

/// Runs from rest; the last positions are returned too. The promise is kept if the last state is finite without inverted cells, and the run
/// completed or says that the step is too long.
fn run(
    variant: &str,
    motion: &Motion<'_, 2>,
    how: (IntegrationMethod, Control),
    end: f64,
) -> Result<(HardCase, Vec<Point>), Error> {
    let (run, wall_s) = timed(|| integrate(motion, how, end));
    let (outcome, positions) = run?;
    let (smallest, _) = motion.system.cell_ratios(&positions);
    let finite = positions.iter().flatten().all(|x| x.is_finite());
    let completed = outcome.status == MotionStatus::Completed;
    let mut note = format!("{:.2e} s", outcome.time_s);
    if outcome.counts.damped > 0 {
        note += &format!(", {} steps by backward Euler", outcome.counts.damped);
    }
    if let Some(equilibrium) = motion.at_equilibrium().filter(|_| completed) {
        let apart = largest_distance(&equilibrium.positions, &positions);
        note += &format!(", {apart:.1e} m from equilibrium");
    }
    let row = HardCase {
        converged: completed,
        kept: finite && smallest > 0.0 && (completed || outcome.status == MotionStatus::NotSolved),
        iterations: usize::try_from(outcome.counts.steps).unwrap_or(usize::MAX),
        min_area_ratio: Some(smallest),
        wall_s,
        note,
        ..HardCase::new(variant, how.0.name(), status_name(&outcome.status))
    };
    Ok((row, positions))
}

/// The outcome of a motion from rest, and its last positions.
fn integrate(
    motion: &Motion<'_, 2>,
    (method, control): (IntegrationMethod, Control),
    end: f64,
) -> Result<(MotionOutcome, Vec<Point>), Error> {
    let mut integrator = method.integrator(motion, control)?;
    let mut state = motion.at_rest();
    let outcome = dynamics::run(motion, integrator.as_mut(), &mut state, end, &[], &mut ());
    Ok((outcome, state.positions))
}
