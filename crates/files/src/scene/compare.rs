//! Cost of a scene against the same scene with everything simulated.

use std::time::Instant;

use nalgebra::SVector;
use serde::Serialize;

use super::SceneError;
use super::file::{Scene, SceneTrajectory, Want};
use super::prepare::{Prepared, SceneExtent, prepare};
use super::run;
use tongue_core::body::{Body, largest_distance};
use tongue_core::dynamics;
use tongue_core::statics::{self, SolveSettings, SolveStatus, Workspace};

/// Number of solves, of which the fastest counts.
const REPETITIONS: usize = 15;
/// Duration after which the slowest mode of the tissue (about a second, in space some seconds) has decayed,
/// s.
const LONG_S: f64 = 200.0;
/// Error allowed in each step of the motion, mm.
const TOLERANCE_MM: f64 = 1e-6;

/// Comparison of three runs of a scene. Values that a scene does not have are empty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Name of the scene.
    pub scene: String,
    /// Whether all runs converged.
    pub converged: bool,
    /// Time of the planned computation, ms.
    pub pruned_ms: f64,
    /// Time of the equilibrium with every muscle contracting and weight and wall of zero strength, ms.
    pub full_static_ms: Option<f64>,
    /// Time of the motion of the same system until it rests, ms.
    pub full_dynamic_ms: Option<f64>,
    /// Largest distance of a node between the planned and the full equilibrium, mm.
    pub static_difference_mm: Option<f64>,
    /// Largest distance of a node between the pruned equilibrium and the end of the motion, mm.
    pub dynamic_difference_mm: Option<f64>,
    /// Number of elements of the planned system in an evaluation.
    pub pruned_elements: usize,
    /// Number of elements of the full system in an evaluation.
    pub full_elements: usize,
    /// Number of steps of the motion.
    pub steps: Option<u64>,
}

/// Runs a scene as planned, with everything simulated at equilibrium, and with everything simulated in motion
/// until it rests. For a fit, which solves tens to thousands of equilibria, only the planned run is made. A
/// trajectory is compared by its final equilibrium, because on the way passive muscles with three elements
/// move differently from tissue.
///
/// # Errors
/// [`SceneError`] if a run cannot begin.
pub fn compare<const D: usize>(name: &str, scene: &Scene, body: &Body<D>) -> Result<Compared, SceneError> {
    let mut pruned = prepare(scene, body.clone(), SceneExtent::Pruned)?;
    let full = prepare(scene, body.clone(), SceneExtent::Full)?;
    let mut out = Compared {
        scene: name.to_owned(),
        converged: true,
        pruned_ms: 0.0,
        full_static_ms: None,
        full_dynamic_ms: None,
        static_difference_mm: None,
        dynamic_difference_mm: None,
        pruned_elements: elements(&pruned),
        full_elements: elements(&full),
        steps: None,
    };
    if scene.fit.is_some() || scene.points.is_some() {
        let outcome = run::run(scene, &mut pruned)?;
        (out.converged, out.pruned_ms) = (outcome.converged, 1e3 * outcome.wall_s);
        return Ok(out);
    }
    let (converged, shape, solve_ms) = timed_solve(&pruned);
    out.converged = converged;
    if scene.want == Want::Trajectory {
        let (way, _, ms) = timed_way(scene, &pruned)?;
        out.pruned_ms = ms;
        out.converged &= way.status == dynamics::MotionStatus::Completed;
    } else {
        let (full_converged, full_shape, full_ms) = timed_solve(&full);
        out.pruned_ms = solve_ms;
        out.full_static_ms = Some(full_ms);
        out.static_difference_mm = Some(distance_mm(&shape, &full_shape));
        out.converged &= full_converged;
    }
    if scene.effects.finite_elements != Some(true) {
        let mut moving = scene.clone();
        moving.want = Want::Trajectory;
        moving.trajectory =
            Some(SceneTrajectory { duration_s: LONG_S, ramp_s: 0.0, tolerance_mm: TOLERANCE_MM });
        let full = prepare(&moving, body.clone(), SceneExtent::Full)?;
        let (way, end, ms) = timed_way(&moving, &full)?;
        out.full_dynamic_ms = Some(ms);
        out.dynamic_difference_mm = Some(distance_mm(&shape, &end));
        out.steps = Some(way.counts.steps);
        out.converged &= way.status == dynamics::MotionStatus::Completed;
    }
    Ok(out)
}

type Shape<const D: usize> = Vec<SVector<f64, D>>;

fn timed_solve<const D: usize>(prepared: &Prepared<D>) -> (bool, Shape<D>, f64) {
    let mut workspace = Workspace::new(&prepared.system);
    let (mut converged, mut fastest) = (true, f64::INFINITY);
    for _ in 0..REPETITIONS {
        workspace.start_from_rest(&prepared.system);
        let clock = Instant::now();
        let solution =
            statics::solve(&prepared.system, &mut workspace, &prepared.tensions, &SolveSettings::default());
        fastest = fastest.min(1e3 * clock.elapsed().as_secs_f64());
        converged &= solution.status == SolveStatus::Converged;
    }
    (converged, workspace.positions().to_vec(), fastest)
}

fn timed_way<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
) -> Result<(run::Way, Shape<D>, f64), SceneError> {
    let clock = Instant::now();
    let (way, end) = run::follow(scene, prepared)?;
    Ok((way, end, 1e3 * clock.elapsed().as_secs_f64()))
}

fn distance_mm<const D: usize>(a: &[SVector<f64, D>], b: &[SVector<f64, D>]) -> f64 {
    1e3 * largest_distance(a, b)
}

fn elements<const D: usize>(prepared: &Prepared<D>) -> usize {
    prepared.system.effects().iter().map(|e| e.elements()).sum()
}
