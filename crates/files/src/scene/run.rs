//! Runs a scene: the shape or trajectory, its cost, and the forces on walls and bones.

use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

use super::body::{self, in_space};
use super::file::{Scene, SceneBody, Want};
use super::loads::PointsFit;
pub use super::outcome::{ContactForce, EffectTime, Moment, MuscleLength, Pull, SceneMotion, SceneOutcome};
use super::outcome::{formants, sound_record};
use super::prepare::{Prepared, prepare, search_method};
use super::vocal_tract;
use crate::report::Pulls;
use crate::run::{Equilibrium, STEP_ERROR_MM, SampledMotion};
use crate::simulation::SimulationError;
use crate::surgery::OperationRecord;
use nalgebra::{SVector, Vector3};
use tongue_core::dynamics::{self, Control, IntegrationMethod, Motion, Tensions};
use tongue_core::effect::{Configuration, Tangent};
use tongue_core::sparse::BlockMatrix;
use tongue_core::statics::{self, Connection, SolveSettings, Workspace};
use tongue_core::statistics::distinct;
use tongue_core::system::System;
use tongue_infer::inverse::alarms::{self, Alarm};
use tongue_infer::inverse::{self, FitStatus};
use tongue_infer::track::FrameStatus;
use tongue_input::bodies::AnyBody;

const SAMPLES: usize = 121;
const REPETITIONS: u32 = 50;

/// Makes the body of a scene, plans and runs it. An error says why it cannot begin; later failures are in the outcome.
pub fn simulate(scene: &Scene) -> Result<SceneOutcome, SimulationError> {
    match body::build(scene, &mut |_| ())? {
        AnyBody::Flat(body) => run(scene, &mut prepare(scene, body)?),
        AnyBody::Solid(body) => run(scene, &mut prepare(scene, body)?),
    }
}

/// Runs a prepared scene, and replaces its tensions by those that a fit found or with which a motion ends.
pub fn run<const D: usize>(
    scene: &Scene,
    prepared: &mut Prepared<D>,
) -> Result<SceneOutcome, SimulationError> {
    // The workspace is made before the clock starts; a trajectory does not need it.
    let mut workspace = (scene.want != Want::Trajectory).then(|| Workspace::new(&prepared.system));
    let clock = Instant::now();
    let fitted = fit(prepared)?.map(|answer| (answer.status, answer.misfit));
    let mut points = None;
    if let (Some(wanted), Some(frame)) = (&scene.points, &prepared.seen)
        && let Some((tensions, fit)) = super::loads::fit(wanted, frame, &prepared.system)
    {
        points = Some(fit);
        prepared.tensions = tensions;
    }
    let (mut solution, mut trajectory, mut sound, mut alarms) = (None, None, None, Vec::new());
    let positions = if let Some(workspace) = &mut workspace {
        let solved = equilibrium(prepared, workspace);
        (solution, alarms) = (Some(solved.solution), solved.alarms);
        if scene.want == Want::Sound {
            sound = sound_record(prepared, vocal_tract::posture(scene), workspace)?;
        }
        workspace.positions().to_vec()
    } else {
        let (motion, positions) = follow(scene, prepared)?;
        trajectory = Some(motion);
        positions
    };
    let system = &prepared.system;
    let wall_s = clock.elapsed().as_secs_f64();
    let at = Configuration { positions: &positions, tensions: &prepared.tensions };
    let evaluations = solution
        .map(|s| [s.energy_evaluations as u64, s.iterations as u64 + 1, s.factorisations as u64])
        .or(trajectory
            .as_ref()
            .map(|t| [0, t.outcome.counts.force_evaluations, t.outcome.counts.factorisations]))
        .unwrap_or_default();
    let contact = contact(prepared, at);
    let (min_cell_ratio, max_cell_ratio) = system.cell_ratios(&positions);
    let converged = solution.is_none_or(|s| s.status == statics::SolveStatus::Converged)
        && fitted.is_none_or(|(status, _)| matches!(status, FitStatus::Converged | FitStatus::TargetNotMet))
        && points.as_ref().is_none_or(|p| p.status == FrameStatus::Converged)
        && trajectory.as_ref().is_none_or(|t| t.outcome.status == dynamics::MotionStatus::Completed)
        && contact.as_ref().is_none_or(|c| !c.edge_through_wall)
        && min_cell_ratio > 0.0;
    let missed = fitted.filter(|(status, _)| *status == FitStatus::TargetNotMet);
    alarms.extend(missed.map(|(_, misfit)| Alarm::TargetNotMet { misfit }));
    alarms.extend(alarms::of_shape(&prepared.body, system, &positions));
    alarms.extend(sound.as_ref().and_then(|sound| alarms::of_tract(sound.tract_length_mm)));
    Ok(SceneOutcome {
        converged,
        pulls: Pulls::of(&prepared.body, prepared.tensions.clone()),
        muscles: muscles(prepared, &positions, points.as_ref()),
        min_cell_ratio,
        max_cell_ratio,
        measure_ratio: system.measure(&positions) / system.measure(system.rest()),
        contact,
        on_bones_n: trajectory.is_none().then(|| on_bones(prepared, at)),
        solution,
        fit: fitted.map(|(status, _)| status),
        points,
        sound,
        operation: changes_by_surgery(scene, prepared, &positions)?,
        trajectory,
        alarms,
        wall_s,
        time_by_effect: time_by_effect(prepared, at, evaluations),
        positions_m: positions.iter().map(|p| p.iter().copied().collect()).collect(),
        plan: prepared.plan.clone(),
    })
}

/// Finds the tensions with which a prepared scene meets its target, if it has one, and stores them in it.
pub fn fit<const D: usize>(
    prepared: &mut Prepared<D>,
) -> Result<Option<inverse::Answer<D>>, SimulationError> {
    let Some(target) = prepared.target.clone() else { return Ok(None) };
    let method = search_method(prepared.airway.as_ref());
    let settings = inverse::FitSettings { method, ..inverse::FitSettings::default() };
    let fit = inverse::fit_in(&prepared.system, target, &settings)?;
    prepared.tensions.clone_from(&fit.answer.tensions);
    Ok(Some(fit.answer))
}

/// The equilibrium, followed from rest unless there is a wall. The wall stops nodes but not edges, so on the way an edge of the tissue
/// could slip over a corner of the wall. With a wall the direct solve is followed only if it descended from an unstable state.
fn equilibrium<const D: usize>(prepared: &Prepared<D>, workspace: &mut Workspace<D>) -> Equilibrium {
    let (system, tensions, settings) = (&prepared.system, &prepared.tensions, SolveSettings::default());
    let direct = statics::solve(system, workspace, tensions, &settings);
    if prepared.wall.is_some() && direct.connection != Connection::Downhill {
        return direct.into();
    }
    statics::trace_beside(system, workspace, &direct, tensions, &settings).into()
}

/// Follows the motion from rest. Displaced bones are moved before it begins, and the body follows them to an equilibrium without weight.
/// The tensions become those with which the motion ends, since the ramp may not be complete then.
fn follow<const D: usize>(
    scene: &Scene,
    prepared: &mut Prepared<D>,
) -> Result<(SceneMotion, Vec<SVector<f64, D>>), SimulationError> {
    let wanted = scene.trajectory.as_ref();
    let wanted = wanted.map_or((0.0, STEP_ERROR_MM, 0.0), |t| (t.duration_s, t.tolerance_mm, t.ramp_s));
    let (t_end_s, error_mm, ramp_s) = wanted;
    let start = match &prepared.start {
        None => None,
        Some(start) => {
            let mut workspace = Workspace::new(start);
            let slack = vec![0.0; prepared.tensions.len()];
            let solution = statics::solve(start, &mut workspace, &slack, &SolveSettings::default());
            if solution.status != statics::SolveStatus::Converged {
                return Err(SimulationError::Refused(format!(
                    "effects.jaw and effects.hyoid: the bones could not be brought to their places before the motion began ({:?}); \
                     move them less far, or the wall out of their way",
                    solution.status
                )));
            }
            Some(workspace.positions().to_vec())
        }
    };
    let system = Arc::clone(&prepared.system);
    let motion = Motion::new(&system, Tensions::ramp(prepared.tensions.clone(), ramp_s))?;
    let mut integrator =
        IntegrationMethod::TrBdf2.checked_integrator(&motion, Control::Adaptive(1e-3 * error_mm))?;
    let (start, integrator) = (start.as_deref(), integrator.as_mut());
    let sampled = SampledMotion::follow(&motion, start, t_end_s, [SAMPLES, 1], integrator, &mut |_| ());
    let posture = vocal_tract::posture(scene);
    let moments = sampled.shapes.iter().map(|(time_s, positions)| Moment {
        time_s: *time_s,
        lengths_mm: muscles(prepared, positions, None).into_iter().map(|m| m.length_mm).collect(),
        formants_hz: formants(prepared, &posture, positions),
    });
    let record = SceneMotion {
        outcome: sampled.outcome,
        part_of_way_to_equilibrium: sampled.part_of_way,
        moments: moments.collect(),
    };
    motion.tensions.write_at(sampled.outcome.time_s, &mut prepared.tensions);
    Ok((record, sampled.end.positions))
}

fn muscles<const D: usize>(
    prepared: &Prepared<D>,
    positions: &[SVector<f64, D>],
    points: Option<&PointsFit>,
) -> Vec<MuscleLength> {
    let (system, body) = (&prepared.system, &prepared.body);
    let each = prepared.plan.muscles.iter().map(|role| {
        let same: Vec<usize> = body.muscles_called(&role.muscle).collect();
        let [rest, length] = [system.rest(), positions]
            .map(|x| same.iter().map(|&m| system.length(x, m)).sum::<f64>() / same.len().max(1) as f64);
        let pull = same.first().map_or(0.0, |&m| prepared.tensions[m]);
        MuscleLength {
            muscle: role.muscle.clone(),
            interval_n: points.zip(same.first()).map(|(p, &m)| [p.low_n[m], p.high_n[m]]),
            pull: if body.is_activated() { Pull::Activation(pull) } else { Pull::TensionN(pull) },
            rest_mm: 1e3 * rest,
            length_mm: 1e3 * length,
            stretch: length / rest,
        }
    });
    each.collect()
}

fn contact<const D: usize>(prepared: &Prepared<D>, at: Configuration<'_, D>) -> Option<ContactForce> {
    let wall = prepared.wall.as_ref()?;
    let mut force = vec![SVector::zeros(); at.positions.len()];
    let effects = prepared.system.effects().iter();
    effects.filter(|e| e.name() == "contact").for_each(|e| e.add_force(at, &mut force));
    let total: SVector<f64, D> = force.iter().sum();
    let surface = prepared.body.mesh.surface_nodes();
    let closest = surface.iter().map(|&n| wall.distance(&at.positions[n])).fold(f64::INFINITY, f64::min);
    Some(ContactForce {
        on_wall_n: total.iter().map(|f| -f).collect(),
        largest_n: force.iter().map(SVector::norm).fold(0.0, f64::max),
        touching: force.iter().filter(|f| f.norm() > 0.0).count(),
        closest_mm: 1e3 * closest,
        edge_through_wall: wall.first_penetration(at.positions, &prepared.body.mesh.connections).is_some(),
    })
}

fn on_bones<const D: usize>(prepared: &Prepared<D>, at: Configuration<'_, D>) -> Vec<f64> {
    let mut force = vec![SVector::zeros(); at.positions.len()];
    prepared.system.force(at, &mut force);
    let total: SVector<f64, D> = prepared.body.mesh.fixed.iter().map(|&n| force[n]).sum();
    total.iter().copied().collect()
}

/// Measures the time of every effect at the answer, and multiplies it by the number of evaluations of energy, force and stiffness.
fn time_by_effect<const D: usize>(
    prepared: &Prepared<D>,
    at: Configuration<'_, D>,
    evaluations: [u64; 3],
) -> Vec<EffectTime> {
    let mut force = vec![SVector::zeros(); at.positions.len()];
    let mut stiffness = BlockMatrix::zeros(prepared.system.pattern());
    let all = prepared.system.effects();
    let times = distinct(all.iter().map(|e| e.name())).into_iter().map(|effect| {
        let effects: Vec<_> = all.iter().filter(|e| e.name() == effect).collect();
        let energy_us = fastest_us(&mut || {
            std::hint::black_box(effects.iter().map(|e| e.energy(at)).sum::<f64>());
        });
        let force_us = fastest_us(&mut || effects.iter().for_each(|e| e.add_force(at, &mut force)));
        let stiffness_us = fastest_us(&mut || {
            effects.iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut stiffness))
        });
        let costs = [energy_us, force_us, stiffness_us];
        let total_us =
            costs.iter().zip(evaluations).map(|(fastest_us, times)| fastest_us * times as f64).sum();
        EffectTime { effect, energy_us, force_us, stiffness_us, total_us }
    });
    times.collect()
}

fn fastest_us(work: &mut dyn FnMut()) -> f64 {
    // The fastest of several counts, since other load only adds time.
    let times = (0..REPETITIONS).map(|_| {
        let clock = Instant::now();
        work();
        1e6 * clock.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

/// What surgery changed, by a run of the same scene without it. `after`: positions of all nodes, m, in the axes of the scene.
fn changes_by_surgery<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    after: &[SVector<f64, D>],
) -> Result<Option<OperationRecord>, SimulationError> {
    let [system, body]: [&dyn Any; 2] = [&*prepared.system, &prepared.body];
    let (Some(operation), SceneBody::TongueInSpace(given), Some(system), Some(body)) =
        (&prepared.operation, &scene.body, system.downcast_ref::<System<3>>(), body.downcast_ref())
    else {
        return Ok(None);
    };
    let unoperated = Scene { surgery: None, ..scene.clone() };
    let mut ready = prepare(&unoperated, in_space(given, operation.whole.clone())?)?;
    let before = run(&unoperated, &mut ready)?;
    if !before.converged {
        return Err(SimulationError::contradiction(
            "[surgery]",
            "the scene before it",
            "that did not converge, so there is nothing to compare with; make its activations or loads smaller",
        ));
    }
    let before: Vec<Vector3<f64>> =
        before.positions_m.iter().map(|p| Vector3::from_column_slice(p)).collect();
    let after: Vec<Vector3<f64>> = after.iter().map(|p| Vector3::from_fn(|axis, _| p[axis])).collect();
    let mut record = operation.record([&in_axes_of_body(&before), &in_axes_of_body(&after)]);
    operation.make_up(&mut record, (body, system), &before).map_err(SimulationError::in_surgery)?;
    record.before.made_up = in_axes_of_body(&record.before.made_up);
    Ok(Some(record))
}

/// Places in the axes of a body in space (y to the right, z upwards) from those of a scene.
pub fn in_axes_of_body(places: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    places.iter().map(|p| Vector3::new(p.x, -p.z, p.y)).collect()
}
