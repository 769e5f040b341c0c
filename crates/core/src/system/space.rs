//! Systems of bodies in space: hexahedra, and muscles as stress along fibres or as lines between nodes.

use serde::Deserialize;

use super::{Additions, Model, System, SystemError, coefficients};
use crate::body::space::{Half, Segment};
use crate::body::{Body, Muscle, Strand};
use crate::effect::{Effect, Fibres, Hexahedra, Stiffening, SymmetryPlane};
use crate::geometry::hexahedron;
use crate::limits::{BeyondLimit, STIFFENING};
use crate::material::MooneyRivlin;

/// Model of the muscles of a body in space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MusclesAs {
    /// Stress along the fibres at the points of every element of a muscle's region, and lines outside the tissue. It converges as the mesh
    /// is refined.
    #[default]
    Stress,
    /// Forces along the segments of fibres between nodes, as in ArtiSynth, which do not converge as the mesh is refined.
    Lines,
}

/// Choices by which a body in space becomes a system.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceModel {
    pub law: MooneyRivlin,
    pub muscles: MusclesAs,
    /// Additional stiffness of a muscle's tissue at full activation over its passive stiffness. ArtiSynth has 9.
    pub stiffening: f64,
}

impl SpaceModel {
    pub fn check(&self) -> Result<(), BeyondLimit> {
        STIFFENING.check(self.stiffening)
    }
}

impl Default for SpaceModel {
    fn default() -> Self {
        Self { law: MooneyRivlin::TONGUE, muscles: MusclesAs::default(), stiffening: 0.0 }
    }
}

/// Tension that scales the barrier of strands, as an activation; the barrier acts below a tenth of the length at rest.
const BARRIER_ACTIVATION: f64 = 0.1;
/// Stiffness of the springs that hold nodes in the symmetry plane, N/m; the forces there move them by less than 1e-8 m.
const SYMMETRY_STIFFNESS: f64 = 1e7;
/// Time constant with which a muscle follows its activation, s.
const CONTRACTION_TIME_S: f64 = 0.015;

impl System<3> {
    /// The system of a body in space in which every muscle can contract. Its tensions are activations from 0 to 1.
    pub fn in_space(body: &Body<3>, model: &SpaceModel) -> Result<Self, SystemError> {
        Self::in_space_with(body, model, Additions::default())
    }

    /// The system of one half of a symmetric body, which is held in the symmetry plane.
    pub fn of_half(half: &Half, model: &SpaceModel) -> Result<Self, SystemError> {
        let mirror = SymmetryPlane::new(1, SYMMETRY_STIFFNESS, &half.plane, &half.body.mesh.nodes);
        let effects: Vec<Box<dyn Effect<3>>> = vec![Box::new(mirror)];
        Self::in_space_with(&half.body, model, Additions { effects, ..Additions::default() })
    }

    /// [`Self::in_space`] with a scene's additions.
    pub fn in_space_with(
        body: &Body<3>,
        model: &SpaceModel,
        mut additions: Additions<3>,
    ) -> Result<Self, SystemError> {
        body.check()?;
        body.mesh.check_size()?;
        let (law, mesh) = (model.law, &body.mesh);
        // Elements of a checked body are not inverted.
        let tissue = law.is_sound().then(|| Hexahedra::new(law, &mesh.hexahedra, &mesh.nodes)).flatten();
        let mut tissue = tissue.ok_or_else(|| {
            let MooneyRivlin { c10, c20, bulk } = law;
            SystemError::Invalid(format!(
                "C10 = {c10} Pa, C20 = {c20} Pa and K = {bulk} Pa do not define a solid: C10 and K must be positive, C20 not negative"
            ))
        })?;
        tissue.scale(&body.factors);
        if model.stiffening > 0.0 {
            let mut muscles = vec![Vec::new(); mesh.hexahedra.len()];
            for (number, muscle) in body.muscles.iter().enumerate() {
                muscle.region.iter().for_each(|&e| muscles[e].push(number));
            }
            tissue.stiffening = Some(Stiffening { gain: model.stiffening, muscles });
        }
        let mut effects: Vec<Box<dyn Effect<3>>> = vec![Box::new(tissue)];
        for (number, muscle) in body.muscles.iter().enumerate() {
            let strands = match model.muscles {
                MusclesAs::Lines => lines(muscle.segments.iter()),
                MusclesAs::Stress => stresses(body, number, muscle),
            };
            effects.push(Box::new(Fibres::new(
                number,
                &strands,
                &mesh.nodes,
                CONTRACTION_TIME_S,
                BARRIER_ACTIVATION,
            )));
        }
        effects.append(&mut additions.effects);
        let contracting: Vec<usize> = (0..body.muscles.len()).collect();
        // Motions use the mass of a node in the coefficients of springs equivalent to the tissue.
        let poisson_ratio = law.poisson_ratio();
        let young_modulus = 4.0 * law.c10 * (1.0 + poisson_ratio);
        let coefficients = coefficients(mesh, &Model { young_modulus, poisson_ratio, ..Model::default() })?;
        Self::assemble(mesh, coefficients, effects, additions, Vec::new(), &contracting)
    }
}

/// Strands along segments from node to node.
fn lines<'a>(segments: impl Iterator<Item = &'a Segment>) -> Vec<Strand> {
    segments
        .map(|s| Strand { nodes: s.nodes.to_vec(), coefficients: vec![-1.0, 1.0], weight: s.force_n })
        .collect()
}

/// Strands along the fibres at the points of a muscle's elements, and along its segments outside the tissue.
fn stresses(body: &Body<3>, number: usize, muscle: &Muscle) -> Vec<Strand> {
    let mut strands = lines(muscle.segments.iter().filter(|s| s.outside));
    for &element in &muscle.region {
        let nodes = &body.mesh.hexahedra[element];
        let x = hexahedron::corners(&body.mesh.nodes, nodes);
        for (direction, at) in body.directions(number, element).into_iter().zip(hexahedron::points()) {
            let Some((direction, (gradients, share))) = direction.zip(hexahedron::gradients(&x, at)) else {
                continue;
            };
            strands.push(Strand {
                nodes: nodes.to_vec(),
                coefficients: gradients.iter().map(|g| g.dot(&direction)).collect(),
                weight: muscle.stress_pa * share,
            });
        }
    }
    strands
}
