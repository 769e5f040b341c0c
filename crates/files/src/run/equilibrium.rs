//! An equilibrium with its alarms, of a system or a body; and a motion with its lengths and shapes at equidistant times.

use std::sync::Arc;
use std::time::Instant;

use nalgebra::{SVector, Vector2};
use serde::{Serialize, Serializer};
use serde_json::json;

use tongue_core::body::Body;
use tongue_core::dynamics::{self, Integrator, Motion, MotionOutcome, Observer, State};
use tongue_core::statics::{self, Solution, SolveSettings, Trace, Workspace};
use tongue_core::system::{Model, SpaceModel, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};

/// An equilibrium at given tensions (activations in space). Its positions are elsewhere: in the workspace, or in [`Solved`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Equilibrium {
    #[serde(flatten, serialize_with = "serialize_solution")]
    pub solution: Solution,
    #[serde(rename = "branch", serialize_with = "serialize_trace")]
    pub trace: Option<Trace>,
    pub alarms: Vec<Alarm>,
}

/// Forces are in N (2D: per metre of thickness). In `guarded` elements a barrier replaces the published law.
fn serialize_solution<S: Serializer>(solution: &Solution, serializer: S) -> Result<S::Ok, S::Error> {
    let record = json!({
        "status": solution.status,
        "max_residual_force_n": solution.max_residual_force,
        "load_reached": solution.load_reached,
        "stability": solution.stability,
        "connection": solution.connection,
        "guarded": solution.guarded,
        "iterations": solution.iterations,
        "factorisations": solution.factorisations,
    });
    record.serialize(serializer)
}

fn serialize_trace<S: Serializer>(trace: &Option<Trace>, serializer: S) -> Result<S::Ok, S::Error> {
    let record = trace.map(|Trace { from_rest, another, .. }| {
        json!({ "critical": from_rest.critical(), "another": another, "stopped": from_rest.stopped() })
    });
    record.serialize(serializer)
}

impl Equilibrium {
    /// The equilibrium at the tensions (activations in space) of all muscles, solved from the positions in the workspace. Unless `direct`,
    /// the equilibria from rest are followed as the tensions grow, to check that it lies on their branch.
    pub fn of<const D: usize>(
        system: &System<D>,
        workspace: &mut Workspace<D>,
        pulls: &[f64],
        direct: bool,
    ) -> Self {
        let settings = SolveSettings::default();
        if direct {
            statics::solve(system, workspace, pulls, &settings).into()
        } else {
            statics::solve_and_trace(system, workspace, pulls, &settings).into()
        }
    }
}

/// A solution that was not followed from rest.
impl From<Solution> for Equilibrium {
    fn from(solution: Solution) -> Self {
        Self { solution, trace: None, alarms: alarms::barrier(solution.guarded).into_iter().collect() }
    }
}

impl From<Trace> for Equilibrium {
    fn from(trace: Trace) -> Self {
        let Trace { solution, from_rest, .. } = trace;
        Self { solution, trace: Some(trace), alarms: alarms::of_equilibrium(&solution, from_rest) }
    }
}

#[derive(Debug, Clone)]
pub struct Solved<const D: usize> {
    pub equilibrium: Equilibrium,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Tensions (activations in space) of all muscles of the body.
    pub pulls: Vec<f64>,
    /// The system of one half if both sides of a body in space are alike.
    pub system: Arc<System<D>>,
    pub wall_s: f64,
}

impl<const D: usize> Solved<D> {
    /// The equilibrium of a system at the tensions (activations in space) of all muscles, from rest. For `direct` see [`Equilibrium::of`].
    pub fn of(system: Arc<System<D>>, pulls: &[f64], direct: bool) -> Self {
        let mut workspace = Workspace::new(&system);
        let clock = Instant::now();
        let equilibrium = Equilibrium::of(&system, &mut workspace, pulls, direct);
        let wall_s = clock.elapsed().as_secs_f64();
        Self { equilibrium, positions: workspace.positions().to_vec(), pulls: pulls.to_vec(), system, wall_s }
    }

    /// Doubts about the equilibrium, and tissue that is strained too far.
    pub fn alarms(&self, body: &Body<D>) -> Vec<Alarm> {
        let strain = alarms::of_shape(body, &self.system, &self.positions);
        self.equilibrium.alarms.iter().cloned().chain(strain).collect()
    }
}

impl Solved<2> {
    /// The equilibrium of a body in which the muscles of these indices contract with these tensions, N per metre of thickness. For `direct`
    /// see [`Equilibrium::of`].
    pub fn in_plane(
        body: &Body<2>,
        model: &Model,
        given: &[(usize, f64)],
        direct: bool,
    ) -> Result<Self, SystemError> {
        let pulling: Vec<usize> = given.iter().map(|(muscle, _)| *muscle).collect();
        let mut tensions = vec![0.0; body.mesh.muscles.len()];
        given.iter().for_each(|(muscle, tension)| tensions[*muscle] = *tension);
        Ok(Self::of(Arc::new(System::new(&body.mesh, model, &pulling)?), &tensions, direct))
    }
}

impl Solved<3> {
    /// The equilibrium at these activations of all muscles. If both sides of the body are alike, one half is solved. `tell` gets the size
    /// of the system once it is set up. For `direct` see [`Equilibrium::of`].
    pub fn in_space(
        body: &Body<3>,
        model: &SpaceModel,
        activations: &[f64],
        direct: bool,
        tell: &dyn Fn(&str),
    ) -> Result<Self, SystemError> {
        let half = body.half().and_then(|half| Some((half.activations(activations)?, half)));
        let clock = Instant::now();
        let system = match &half {
            Some((_, half)) => System::of_half(half, model),
            None => System::in_space(body, model),
        }?;
        let system = Arc::new(system);
        let (unknowns, entries) = (3 * system.pattern().unknowns(), system.pattern().factor_entries::<3>());
        let made = clock.elapsed().as_secs_f64();
        let what = if half.is_some() { "only one half is solved: " } else { "" };
        tell(&format!(
            "{}: {what}{unknowns} unknowns, {entries} entries of the factor, set up in {made:.2} s",
            body.what
        ));
        let Some((own, half)) = half else { return Ok(Self::of(system, activations, direct)) };
        let solved = Self::of(system, &own, direct);
        Ok(Self {
            positions: half.positions_of_whole(&solved.positions),
            pulls: activations.to_vec(),
            ..solved
        })
    }

    /// Positions of all nodes projected onto the midsagittal plane, m; the front is towards smaller x.
    pub fn midsagittal_positions(&self) -> Vec<Vector2<f64>> {
        self.positions.iter().map(|p| Vector2::new(p.x, p.z)).collect()
    }
}

/// Default error of a step of a motion, mm. Lengths over time are then within 3e-5 mm, so that all printed decimals hold, for 1 to 8 ms
/// more than at 1e-3 mm on the tongue of springs.
pub const STEP_ERROR_MM: f64 = 1e-6;

#[derive(Debug, Clone)]
pub struct SampledMotion<const D: usize> {
    pub outcome: MotionOutcome,
    /// Part of the way to equilibrium that the body has moved at the end; `None` if it has no equilibrium to go to.
    pub part_of_way: Option<f64>,
    pub end: State<D>,
    /// Times, s, with the lengths of all muscles, m.
    pub lengths: Vec<(f64, Vec<f64>)>,
    /// Times, s, with the positions of all nodes, m.
    pub shapes: Vec<(f64, Vec<SVector<f64, D>>)>,
}

impl<const D: usize> SampledMotion<D> {
    /// Follows a motion from `start` (positions of all nodes, m; `None` for rest). Lengths are kept at `samples` equidistant times with the
    /// first and the last one, the shape at each of them if `shape_every` is 1, at every second one if it is 2, and so on. From time to time
    /// `progress` gets the time reached, s.
    pub fn follow(
        motion: &Motion<'_, D>,
        start: Option<&[SVector<f64, D>]>,
        t_end_s: f64,
        [samples, shape_every]: [usize; 2],
        integrator: &mut dyn Integrator<D>,
        progress: &mut dyn FnMut(f64),
    ) -> Self {
        let system = motion.system;
        let mut end = motion.at_rest();
        end.positions.copy_from_slice(start.unwrap_or(system.rest()));
        let begin = end.positions.clone();
        let times = dynamics::sample_times(t_end_s, samples);
        let mut seen = Samples { system, shape_every, progress, lengths: Vec::new(), shapes: Vec::new() };
        let outcome = dynamics::run(motion, integrator, &mut end, t_end_s, &times, &mut seen);
        let Samples { lengths, shapes, .. } = seen;
        Self { outcome, part_of_way: motion.part_of_way(&begin, &end), end, lengths, shapes }
    }
}

struct Samples<'a, const D: usize> {
    system: &'a System<D>,
    shape_every: usize,
    progress: &'a mut dyn FnMut(f64),
    lengths: Vec<(f64, Vec<f64>)>,
    shapes: Vec<(f64, Vec<SVector<f64, D>>)>,
}

impl<const D: usize> Observer<D> for Samples<'_, D> {
    fn sample(&mut self, time: f64, positions: &[SVector<f64, D>]) {
        if self.lengths.len().is_multiple_of(self.shape_every) {
            self.shapes.push((time, positions.to_vec()));
        }
        self.lengths.push((time, self.system.lengths(positions)));
    }

    fn progress(&mut self, time: f64) {
        (self.progress)(time);
    }
}
