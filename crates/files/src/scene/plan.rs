//! The plan: what is simulated, what is left out, and why.

use nalgebra::SVector;
use serde::Serialize;

use super::file::{Scene, Want};
use crate::simulation::SimulationError;
use tongue_core::system::System;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    pub effect: &'static str,
    pub simulated: bool,
    pub why: String,
    /// Number of elements in an evaluation (springs, cells, nodes); 0 if it is left out.
    pub elements: usize,
    /// Estimated cost of one iteration (energy, force and stiffness), microseconds.
    pub estimated_us: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MuscleRole {
    pub muscle: String,
    /// Whether it contracts: it then has the three-element model instead of tissue.
    pub contracting: bool,
    pub why: String,
}

/// Unit of tensions and forces: in the plane they are per metre of thickness.
pub fn force_unit(dimension: usize) -> &'static str {
    if dimension == 2 { "N/m" } else { "N" }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenePlan {
    pub title: String,
    pub want: Want,
    pub body: String,
    pub method: &'static str,
    pub dimension: usize,
    pub nodes: usize,
    pub unknowns: usize,
    /// Structurally nonzero scalar entries of the stiffness matrix, both triangles.
    pub nonzeros: usize,
    /// Nonzero scalar entries of its Cholesky factor, one triangle, with fill-in.
    pub factor_nonzeros: usize,
    /// Whether the factor is computed in supernodes, by faer, rather than block by block.
    pub factor_in_supernodes: bool,
    pub factor_operations: usize,
    pub estimated_factor_us: f64,
    pub effects: Vec<Planned>,
    pub muscles: Vec<MuscleRole>,
}

/// Nanoseconds of an iteration for each stiffness block that an element writes, with its share of energy and force, by dimension. This and
/// the other rates were measured by `tongue-fit scene run` on the reference tongue and the built-in solids.
const NS_PER_BLOCK: [f64; 2] = [4.0, 10.0];
/// Nanoseconds for an element without blocks of its own: the weight of a node, or a node near a segment of a wall.
const NS_PER_LIGHT_ELEMENT: f64 = 8.0;
/// Operations of a factorisation per nanosecond: block by block, and in supernodes (`cargo bench factorise`).
const OPERATIONS_PER_NS: [f64; 2] = [8.0, 20.0];

impl Planned {
    pub fn simulate(effect: &'static str, why: impl Into<String>) -> Self {
        Self { effect, simulated: true, why: why.into(), elements: 0, estimated_us: 0.0 }
    }

    pub fn leave_out(effect: &'static str, why: impl Into<String>) -> Self {
        Self { simulated: false, ..Self::simulate(effect, why) }
    }

    pub fn counting(self, elements: usize) -> Self {
        Self { elements, ..self }
    }

    pub fn by_request(effect: &'static str, asked: bool) -> Self {
        if asked { Self::simulate(effect, "asked for") } else { Self::leave_out(effect, "not asked for") }
    }
}

pub(super) fn motion(scene: &Scene, contracting: bool) -> Vec<Planned> {
    let e = &scene.effects;
    let moving = scene.want == Want::Trajectory;
    let still = "an equilibrium is wanted, and it has no effect on where that lies";
    let slack = if moving { "no muscle contracts" } else { still };
    vec![
        decide("inertia", e.inertia, moving, still),
        decide("viscosity", e.viscosity, moving, still),
        decide("muscle dynamics", e.muscle_dynamics, moving && contracting, slack),
    ]
}

fn decide(name: &'static str, asked: Option<bool>, needed: bool, idle: &str) -> Planned {
    if needed {
        Planned::simulate(name, "a trajectory needs it")
    } else if asked == Some(true) {
        Planned::leave_out(name, format!("asked for, but {idle}"))
    } else {
        Planned::leave_out(name, idle)
    }
}

/// Number of elements and estimated microseconds of all effects with this name.
fn cost<const D: usize>(system: &System<D>, name: &str) -> (usize, f64) {
    let mut elements = 0;
    let mut ns = 0.0;
    for effect in system.effects().iter().filter(|e| e.name() == name) {
        let (mut stencils, mut blocks) = (0, 0);
        effect.stencils(&mut |nodes| {
            stencils += 1;
            blocks += nodes.len() * (nodes.len() + 1) / 2;
        });
        let count = effect.elements();
        elements += count;
        ns += if count == stencils {
            blocks as f64 * NS_PER_BLOCK[D - 2]
        } else {
            count as f64 * NS_PER_LIGHT_ELEMENT
        };
    }
    (elements, ns * 1e-3)
}

/// Number of elements and estimated microseconds of a part of the plan: an effect of the system, or the work of its nodes and elements in a
/// motion.
fn planned_cost<const D: usize>(system: &System<D>, part: &Planned) -> (usize, f64) {
    match part.effect {
        "springs" => cost(system, "tissue"),
        "inertia" => light(system.pattern().unknowns()),
        "viscosity" => light(cost(system, "tissue").0 + cost(system, "quadratic elements").0),
        "muscle dynamics" => light(cost(system, "muscle").0 + cost(system, "fibres").0),
        "straight paths" => light(system.paths().len()),
        name if part.elements > 0 => (part.elements, cost(system, name).1),
        name => cost(system, name),
    }
}

fn light(elements: usize) -> (usize, f64) {
    (elements, elements as f64 * NS_PER_LIGHT_ELEMENT * 1e-3)
}

pub(super) fn count<const D: usize>(
    scene: &Scene,
    body: &str,
    method: &'static str,
    mut effects: Vec<Planned>,
    muscles: Vec<MuscleRole>,
    system: &System<D>,
) -> ScenePlan {
    let pattern = system.pattern();
    for part in effects.iter_mut().filter(|part| part.simulated) {
        (part.elements, part.estimated_us) = planned_cost(system, part);
    }
    let factor_operations = pattern.factor_operations::<D>();
    let factor_in_supernodes = pattern.is_for_supernodes::<D>();
    let operations_per_ns = OPERATIONS_PER_NS[usize::from(factor_in_supernodes)];
    ScenePlan {
        title: scene.title.clone(),
        want: scene.want,
        body: body.to_owned(),
        method,
        dimension: D,
        nodes: system.rest().len(),
        unknowns: D * pattern.unknowns(),
        nonzeros: D * D * (2 * pattern.matrix_blocks() - pattern.unknowns()),
        factor_nonzeros: pattern.factor_entries::<D>(),
        factor_in_supernodes,
        factor_operations,
        estimated_factor_us: factor_operations as f64 / operations_per_ns * 1e-3,
        effects,
        muscles,
    }
}

impl ScenePlan {
    pub fn effect(&self, name: &str) -> Option<&Planned> {
        self.effects.iter().find(|e| e.effect == name)
    }
}

/// A direction as a unit vector, checked for its dimension.
pub(super) fn unit<const D: usize>(given: &[f64]) -> Result<SVector<f64, D>, SimulationError> {
    if given.len() != D {
        return Err(SimulationError::contradiction(
            format!("effects.gravity.direction with {} numbers", given.len()),
            format!("a body in {D} dimensions"),
            "give one number for each",
        ));
    }
    let direction = SVector::<f64, D>::from_column_slice(given);
    let largest = direction.amax();
    if largest > 0.0 {
        // Scaled first, since squares of very large or very small numbers overflow or vanish.
        Ok((direction / largest).normalize())
    } else {
        Err(SimulationError::value("the length of effects.gravity.direction", 0.0, "positive"))
    }
}
