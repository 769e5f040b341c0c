//! Many equilibria at once: four in the lanes of the processor's vector registers, groups of four on every thread.
//!
//! [`Lanes`] does for any number of loads what [`solve`](super::solve) does for one: draws of a posterior, candidates of a search, frames
//! of a recording. Each load has its own tensions, displaced bones and start, and may have its own body with the same edges and triangles;
//! each solution has its own status, iterations and line search. With AVX2 (detected at run time) an equilibrium from a neighbour takes
//! less than half of the time of a single solve (`cargo bench many`).
//!
//! # Differences from single solves
//! - The equilibria are those of [`solve`](super::solve) to 1e-9 mm, since the method is the same. The bits differ, since sums have
//!   another order and a lane gets a new factor when another lane of its group needs it.
//! - The bits are the same for any number of threads, since the groups depend on the numbers of the loads only, and on every processor,
//!   since no operations are fused. They depend on the other loads of the group.
//! - Lanes solve bodies in the plane of springs, muscles, straight paths and incompressible triangles. A load is solved by
//!   [`solve`](super::solve) from its start instead if the barrier acts, the stiffness stays indefinite, the line search fails, or bones
//!   cannot be moved to their places. So are all loads of other bodies (in space, a continuum, with contact or weight); for these a group
//!   keeps the factor from one solve to the next. [`LaneEquilibrium::alone`] marks such loads; the status is always that of
//!   [`solve`](super::solve).
//!
//! # Example
//! ```
//! use tongue_core::body::Body;
//! use tongue_core::statics::lanes::{Lanes, Load};
//! use tongue_core::statics::{SolveSettings, SolveStatus};
//! use tongue_core::system::{Model, System};
//!
//! let body = Body::tongue(5.5e-3)?;
//! let system = System::new(&body.mesh, &Model::default(), &[0, 4, 6])?;
//! let lanes = Lanes::new(&system);
//!
//! // A hundred draws near one load, each starting at the shape of that load.
//! let tensions = vec![12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];
//! let middle = lanes.solve(&[Load::new(tensions)], &SolveSettings::default());
//! let draw = |i: usize| {
//!     let part = 1.0 + 0.0006 * (i as f64 - 50.0);
//!     let load = Load::new(vec![12.0 * part, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0]);
//!     Load { start: Some(&middle[0].positions), ..load }
//! };
//! let lengths = lanes.map(100, &SolveSettings::default(), draw, |_, shape| {
//!     (shape.solution.status == SolveStatus::Converged).then(|| system.length(&shape.positions, 0))
//! });
//! assert!(lengths[99] < lengths[0], "a larger tension shortens the muscle");
//!
//! // Exact derivatives of the length of every muscle by tensions and bones.
//! let mut group = lanes.group();
//! group.solve(&[draw(0), draw(99)], &SolveSettings::default());
//! let rates = group.length_rates();
//! let gga = &rates[0].as_ref().ok_or("no stable equilibrium")?[0];
//! assert!(gga.by_tension[0] < 0.0, "m/N");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod adjoint;
mod from_rest;
mod scalar_fallback;

use nalgebra::SVector;

use crate::parallel;
use crate::statics::mass_spring::{SimdNewton, at_rest};
use crate::statics::{Solution, SolveSettings};
use crate::system::System;
use crate::system::elements::Elements;

pub use crate::sparse::simd::LANES;
pub use adjoint::{Reshaped, UnitChange};
use scalar_fallback::{ScalarFallback, solve_scalar};

/// Number of loads that one thread solves in a row; if all loads of a group have starts, it begins with the factor of the group before.
const CHUNK: usize = 32 * LANES;

/// A load to solve for. Bones move to their places from those that they have at the start.
#[derive(Debug, Clone)]
pub struct Load<'a, const D: usize> {
    /// Tension of every muscle of the mesh, N (2D: per metre of thickness).
    pub tensions: Vec<f64>,
    /// Nodes of bones, each list with its displacement from the bone's place in the system, m.
    pub bones: Vec<(&'a [usize], SVector<f64, D>)>,
    /// Positions of all nodes at which the solve starts, m, such as those of a solved neighbour; rest if `None`.
    pub start: Option<&'a [SVector<f64, D>]>,
    /// A body with the same edges and triangles but another shape at rest or other constants.
    pub system: Option<&'a System<D>>,
}

impl<'a, const D: usize> Load<'a, D> {
    /// A load with a tension, N, for each muscle of the mesh, that starts from rest.
    pub fn new(tensions: Vec<f64>) -> Self {
        Self { tensions, bones: Vec::new(), start: None, system: None }
    }

    /// Displaces a bone, given by its nodes, by `shift`, m.
    pub fn with_bone(mut self, nodes: &'a [usize], shift: SVector<f64, D>) -> Self {
        self.bones.push((nodes, shift));
        self
    }

    /// Target position of a bone's node, m.
    fn place(&self, system: &System<D>, node: usize) -> SVector<f64, D> {
        let shift = self.bones.iter().rfind(|(nodes, _)| nodes.contains(&node));
        system.bone_position(node) + shift.map_or(SVector::zeros(), |(_, shift)| *shift)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct LaneEquilibrium<const D: usize> {
    pub solution: Solution,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Whether the load was solved by [`solve`](crate::statics::solve).
    pub alone: bool,
}

/// Derivatives of a function of the shape, whose unit is called u here.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjoint<const D: usize> {
    /// By the force on every node, u/N; for a bone's node by its position, u/m. The derivative by another parameter (a rest length, a
    /// constant) is the dot product of the former with the derivative of the forces by the parameter.
    pub by_node: Vec<SVector<f64, D>>,
    /// By the tension of every muscle of the mesh, u/N; zero for muscles that cannot contract.
    pub by_tension: Vec<f64>,
}

impl<const D: usize> Adjoint<D> {
    /// By the displacement of the bone with these nodes, u/m.
    pub fn by_bone(&self, nodes: &[usize]) -> SVector<f64, D> {
        nodes.iter().map(|&n| self.by_node[n]).sum()
    }
}

/// A body whose equilibria are solved in lanes; threads share it.
#[derive(Debug)]
pub struct Lanes<'s, const D: usize> {
    system: &'s System<D>,
}

impl<'s, const D: usize> Lanes<'s, D> {
    pub fn new(system: &'s System<D>) -> Self {
        Self { system }
    }

    /// Whether lanes can solve the system; otherwise every load is solved by itself.
    pub fn are_used(&self) -> bool {
        self.system.elements().is_some()
    }

    /// A group that repeatedly solves up to [`LANES`] loads at once, such as the chains of one thread.
    #[inline(never)]
    pub fn group(&self) -> LaneGroup<'s, D> {
        LaneGroup {
            system: self.system,
            work: self.system.elements().map(|elements| (elements.as_ref(), SimdNewton::new(elements))),
            fallbacks: Vec::new(),
            equilibria: Vec::new(),
            tensions: Vec::new(),
            holds_system: [false; LANES],
            factorised: None,
        }
    }

    pub fn solve(&self, loads: &[Load<'_, D>], settings: &SolveSettings) -> Vec<LaneEquilibrium<D>> {
        self.map(loads.len(), settings, |i| loads[i].clone(), |_, shape| shape.clone())
    }

    /// Solves `count` loads and returns the results of `keep` for every equilibrium, in the order of the loads. The shapes are not kept,
    /// since those of a million loads would fill the memory.
    pub fn map<'l, R: Send>(
        &self,
        count: usize,
        settings: &SolveSettings,
        load: impl Fn(usize) -> Load<'l, D> + Sync,
        keep: impl Fn(usize, &LaneEquilibrium<D>) -> R + Sync,
    ) -> Vec<R> {
        let chunks: Vec<usize> = (0..count).step_by(CHUNK).collect();
        let solved = parallel::map(&chunks, |&chunk| {
            let mut group = self.group();
            let mut out = Vec::with_capacity(CHUNK);
            for first in (chunk..count.min(chunk + CHUNK)).step_by(LANES) {
                let loads: Vec<_> = (first..count.min(first + LANES)).map(&load).collect();
                out.extend((first..).zip(group.solve(&loads, settings)).map(|(i, shape)| keep(i, shape)));
            }
            out
        });
        solved.into_iter().flatten().collect()
    }
}

/// Up to [`LANES`] equilibria and the work space of their solves; each thread has its own.
#[derive(Debug)]
pub struct LaneGroup<'a, const D: usize> {
    system: &'a System<D>,
    work: Option<(&'a Elements, SimdNewton<LANES>)>,
    /// A workspace for each load, for a body that lanes cannot solve.
    fallbacks: Vec<ScalarFallback<D>>,
    equilibria: Vec<LaneEquilibrium<D>>,
    /// Tensions of every answer, N; `None` for one in a body of its own.
    tensions: Vec<Option<Vec<f64>>>,
    /// Whether each lane holds the numbers of `system`.
    holds_system: [bool; LANES],
    /// Whether each lane has the factor of the exact stiffness at its answer; `None` before that is computed.
    factorised: Option<[bool; LANES]>,
}

impl<const D: usize> LaneGroup<'_, D> {
    /// Solves the first [`LANES`] loads. If all have starts, Newton's method begins with the factor of the last solve.
    #[inline(never)]
    pub fn solve(&mut self, loads: &[Load<'_, D>], settings: &SolveSettings) -> &[LaneEquilibrium<D>] {
        let loads = &loads[..loads.len().min(LANES)];
        self.factorised = None;
        self.solve_in_lanes(loads, settings);
        let (system, fallbacks) = (self.system, &mut self.fallbacks);
        self.equilibria = if let Some((elements, work)) = &self.work {
            let equilibria = loads.iter().enumerate().map(|(lane, load)| {
                let body = load.system.unwrap_or(system);
                let Ok(solution) = work.solution(lane) else { return solve_scalar(body, load, settings) };
                let mut positions = body.rest().to_vec();
                elements.take_from_lane(lane, &work.positions, &mut positions);
                body.place_path_nodes(&mut positions);
                if !body.keeps_cells_upright() && body.cell_ratios(&positions).0 <= 0.0 {
                    return solve_scalar(body, load, settings);
                }
                LaneEquilibrium { solution, positions, alone: false }
            });
            equilibria.collect()
        } else {
            fallbacks.resize_with(fallbacks.len().max(loads.len()), || ScalarFallback::new(system));
            parallel::map_mut(&mut fallbacks[..loads.len()], |lane, fallback| match loads[lane].system {
                Some(body) => solve_scalar(body, &loads[lane], settings),
                None => fallback.solve(system, &loads[lane], settings),
            })
        };
        let tensions = loads.iter().map(|l| l.system.is_none().then(|| l.tensions.clone()));
        self.tensions = tensions.collect();
        &self.equilibria
    }

    pub fn equilibria(&self) -> &[LaneEquilibrium<D>] {
        &self.equilibria
    }

    fn solve_in_lanes(&mut self, loads: &[Load<'_, D>], settings: &SolveSettings) {
        let (system, holds_system) = (self.system, &mut self.holds_system);
        let Some((elements, work)) = &mut self.work else { return };
        if loads.iter().any(|l| l.start.is_none()) {
            work.discard_factor();
        }
        work.clear();
        let mut set = [false; LANES];
        for (lane, load) in loads.iter().enumerate() {
            let body = load.system.unwrap_or(system);
            let start = load.start.unwrap_or(body.rest());
            let same =
                load.system.is_none() && holds_system[lane] || elements.fill(body, lane, &mut work.numbers);
            holds_system[lane] = same && load.system.is_none();
            set[lane] = same
                && start.len() == body.rest().len()
                && load.tensions.len() == body.muscle_count()
                && load.tensions.iter().all(|t| t.is_finite());
            if set[lane] {
                work.set_load(elements, lane, &load.tensions, start, |node| load.place(body, node));
                let plain = load.start.is_none() && load.bones.is_empty() && load.system.is_none();
                if let Some(at_rest) = plain.then(|| at_rest(system, elements)).flatten() {
                    work.start_from_linear_response(lane, at_rest, &load.tensions);
                }
            }
        }
        let Some(first) = set.iter().position(|s| *s) else { return };
        for lane in (0..LANES).filter(|lane| !set[*lane]) {
            work.copy_lane(first, lane);
            holds_system[lane] = holds_system[first];
        }
        work.solve(elements, settings);
    }
}
