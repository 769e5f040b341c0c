//! The plan: what is simulated, what is left out, and why.

use nalgebra::SVector;
use serde::Serialize;

use super::SceneError;
use super::file::{Scene, Want};
use tongue_core::system::System;

/// One effect in the plan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planned {
    /// The effect.
    pub effect: &'static str,
    /// Whether it is simulated.
    pub simulated: bool,
    /// Why, or why not.
    pub why: String,
    /// Elements that every evaluation visits (springs, cells, nodes and so on); 0 where it is left out.
    pub elements: usize,
    /// Estimated cost of one iteration (energy, force and stiffness), microseconds.
    pub estimated_us: f64,
}

/// What a muscle of the mesh is in the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Role {
    /// Its name.
    pub muscle: String,
    /// Whether it contracts: the three-element model in place of tissue.
    pub contracting: bool,
    /// Why, or why not.
    pub why: String,
}

/// What is computed for a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Title of the scene.
    pub title: String,
    /// What is wanted.
    pub want: Want,
    /// The body, in words.
    pub body: String,
    /// How the answer is found, in words.
    pub method: String,
    /// 2 or 3.
    pub dimension: usize,
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Scalar unknowns of a solve.
    pub unknowns: usize,
    /// Scalar entries of the stiffness matrix that can be other than zero, both triangles.
    pub nonzeros: usize,
    /// The same of its Cholesky factor, one triangle, fill-in included.
    pub factor_nonzeros: usize,
    /// Whether it is made in supernodes, by faer, rather than block by block.
    pub factor_in_supernodes: bool,
    /// Floating-point operations of one factorisation.
    pub factor_operations: usize,
    /// Estimated cost of a factorisation, microseconds.
    pub estimated_factor_us: f64,
    /// Every effect that a scene can ask for.
    pub effects: Vec<Planned>,
    /// Every muscle of the mesh; those of one name once.
    pub muscles: Vec<Role>,
}

/// Nanoseconds that an iteration spends for each stiffness block that an element writes, with its share of energy and force. By
/// dimension. Like the other rates here it is what `tongue-fit scene run` measured on the reference tongue and the shipped solids.
const NS_PER_BLOCK: [f64; 2] = [4.0, 10.0];
/// Nanoseconds for an element that writes no blocks of its own (a node's weight, a node facing a segment of a wall).
const NS_PER_LIGHT_ELEMENT: f64 = 8.0;
/// Operations that a factorisation does in a nanosecond: block by block, and in supernodes (`cargo bench factorise`).
const OPERATIONS_PER_NS: [f64; 2] = [8.0, 20.0];

/// What decides about an effect, before the system is there to be counted.
pub(super) struct Decision {
    pub effect: &'static str,
    pub simulated: bool,
    pub why: String,
    /// Nodes or elements of what is no effect of its own in the system.
    pub elements: usize,
}

impl Decision {
    pub fn yes(effect: &'static str, why: impl Into<String>) -> Self {
        Self { effect, simulated: true, why: why.into(), elements: 0 }
    }

    pub fn no(effect: &'static str, why: impl Into<String>) -> Self {
        Self { effect, simulated: false, why: why.into(), elements: 0 }
    }

    pub fn of(self, elements: usize) -> Self {
        Self { elements, ..self }
    }

    /// Asked for or not, nothing else.
    pub fn asked(effect: &'static str, asked: bool) -> Self {
        if asked { Self::yes(effect, "asked for") } else { Self::no(effect, "not asked for") }
    }
}

/// What only a trajectory needs.
pub(super) fn motion(scene: &Scene, contracting: bool) -> Vec<Decision> {
    let e = &scene.effects;
    let moving = scene.want == Want::Trajectory;
    let decide = |name, asked: Option<bool>, needed: bool, need: &str, idle: &str| {
        if needed {
            Decision::yes(name, need)
        } else if asked == Some(true) {
            Decision::no(name, format!("asked for, but {idle}"))
        } else {
            Decision::no(name, idle)
        }
    };
    let still = "an equilibrium is wanted, and it has no effect on where that lies";
    let slack = if moving { "no muscle contracts" } else { still };
    vec![
        decide("inertia", e.inertia, moving, "a trajectory needs it", still),
        decide("viscosity", e.viscosity, moving, "a trajectory needs it", still),
        decide("muscle dynamics", e.muscle_dynamics, moving && contracting, "a trajectory needs it", slack),
    ]
}

/// Elements and estimated microseconds of the effects of a system that carry the name.
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
        ns += match count == stencils {
            true => blocks as f64 * NS_PER_BLOCK[D - 2],
            false => count as f64 * NS_PER_LIGHT_ELEMENT,
        };
    }
    (elements, ns * 1e-3)
}

/// Elements and estimated microseconds of what the plan names: an effect of the system, or what its nodes and elements do in a
/// motion.
fn planned_cost<const D: usize>(system: &System<D>, decision: &Decision) -> (usize, f64) {
    let light = |elements: usize| (elements, elements as f64 * NS_PER_LIGHT_ELEMENT * 1e-3);
    let elements = |name: &str| cost(system, name).0;
    match decision.effect {
        "springs" => cost(system, "tissue"),
        "inertia" => light(system.pattern().unknowns()),
        "viscosity" => light(elements("tissue") + elements("muscle") + elements("finite elements")),
        "muscle dynamics" => light(elements("muscle")),
        "straight paths" => light(system.paths().len()),
        name if decision.elements > 0 => (decision.elements, cost(system, name).1),
        name => cost(system, name),
    }
}

/// Counts what the decisions come to in the system that was made after them.
pub(super) fn count<const D: usize>(
    scene: &Scene,
    body: &str,
    method: String,
    decisions: Vec<Decision>,
    muscles: Vec<Role>,
    system: &System<D>,
) -> Plan {
    let pattern = system.pattern();
    let effects = decisions
        .into_iter()
        .map(|decision| {
            let (elements, estimated_us) =
                if decision.simulated { planned_cost(system, &decision) } else { (0, 0.0) };
            let Decision { effect, simulated, why, .. } = decision;
            Planned { effect, simulated, why, elements, estimated_us }
        })
        .collect();
    let factor_operations = pattern.factor_operations::<D>();
    let factor_in_supernodes = pattern.is_for_supernodes::<D>();
    let operations_per_ns = OPERATIONS_PER_NS[usize::from(factor_in_supernodes)];
    Plan {
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

impl Plan {
    /// The entry of an effect.
    pub fn effect(&self, name: &str) -> Option<&Planned> {
        self.effects.iter().find(|e| e.effect == name)
    }
}

/// A direction with as many numbers as there are dimensions, made a unit vector.
pub(super) fn unit<const D: usize>(given: &[f64]) -> Result<SVector<f64, D>, SceneError> {
    if given.len() != D {
        return Err(SceneError::contradiction(
            format!("effects.gravity.direction with {} numbers", given.len()),
            format!("a body in {D} dimensions"),
            "give one number for each",
        ));
    }
    let direction = SVector::<f64, D>::from_column_slice(given);
    let largest = direction.amax();
    if largest > 0.0 {
        // Scaled first, since squares of very large or small numbers are no numbers.
        Ok((direction / largest).normalize())
    } else {
        Err(SceneError::Value {
            key: "the length of effects.gravity.direction",
            value: 0.0,
            must: "positive",
        })
    }
}
