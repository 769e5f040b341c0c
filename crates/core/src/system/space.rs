//! Systems of bodies in space: hexahedra, and muscles as stress along fibres or as lines from node to node.

use serde::Deserialize;

use crate::body::space::Half;
use crate::body::{Body, Muscle, Strand};
use crate::effect::{Effect, Fibres, Hexahedra, Stiffening, SymmetryPlane};
use crate::geometry::hexahedron;
use crate::limits::{BeyondLimit, STIFFENING};
use crate::material::{Coefficients, Constants, MooneyRivlin};

use super::{Additions, System, SystemError, TissueModel};

/// Model of the muscles of a body in space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MusclesAs {
    /// Stress along the fibres at the points of every element that a muscle runs through, and lines outside
    /// the tissue. Its answers hold when the mesh is refined.
    #[default]
    Stress,
    /// Forces along the segments of its fibres from node to node, as ArtiSynth has them; refined meshes do
    /// not bear them.
    Lines,
}

/// Choices that make a body in space into a system.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceModel {
    pub law: MooneyRivlin,
    pub muscles: MusclesAs,
    /// Additional stiffness of a muscle's tissue at full activation, as a multiple of its passive stiffness;
    /// 0 for none. ArtiSynth: 9.
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

/// Length below which a strand is held open, counted in its own full force: a barrier that acts below a tenth
/// of the length at rest.
const BAR: f64 = 0.1;
/// Stiffness of the springs that hold nodes in the plane that halves a body, N/m: the forces there move them
/// by less than 1e-8 m.
const MIRROR: f64 = 1e7;
/// Time in which a muscle follows its activation, s.
const CONTRACTION_TIME_S: f64 = 0.015;

impl System<3> {
    /// The system of a body in space in which every muscle can contract; its tensions are activations from 0
    /// to 1.
    pub fn in_space(body: &Body<3>, model: &SpaceModel) -> Result<Self, SystemError> {
        Self::in_space_with(body, model, Additions::default())
    }

    /// The same of one half of a symmetric body, held in the plane that halves it.
    pub fn of_half(half: &Half, model: &SpaceModel) -> Result<Self, SystemError> {
        let mirror = SymmetryPlane::new(1, MIRROR, &half.plane, &half.body.mesh.nodes);
        let effects: Vec<Box<dyn Effect<3>>> = vec![Box::new(mirror)];
        Self::in_space_with(&half.body, model, Additions { effects, ..Additions::default() })
    }

    /// The same, with what a scene adds.
    pub fn in_space_with(
        body: &Body<3>,
        model: &SpaceModel,
        mut additions: Additions<3>,
    ) -> Result<Self, SystemError> {
        body.check()?;
        body.mesh.check_size()?;
        let (law, mesh) = (model.law, &body.mesh);
        // The elements of a checked body are upright.
        let tissue = law.is_sound().then(|| Hexahedra::new(law, &mesh.hexahedra, &mesh.nodes)).flatten();
        let MooneyRivlin { c10, c20, bulk } = law;
        let mut tissue = tissue.ok_or(SystemError::Law { c10, c20, bulk })?;
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
                MusclesAs::Lines => lines(&muscle.segments.iter().collect::<Vec<_>>()),
                MusclesAs::Stress => stresses(body, number, muscle),
            };
            effects.push(Box::new(Fibres::new(number, &strands, &mesh.nodes, CONTRACTION_TIME_S, BAR)));
        }
        effects.append(&mut additions.effects);
        let contracting: Vec<usize> = (0..body.muscles.len()).collect();
        let coefficients = carried_along(body, law)?;
        let tissue = TissueModel::Hexahedra;
        Self::assemble(mesh, tissue, coefficients, effects, additions, Vec::new(), &contracting)
    }
}

/// Segments that pull from node to node.
fn lines(segments: &[&crate::body::space::Segment]) -> Vec<Strand> {
    segments
        .iter()
        .map(|s| Strand { nodes: s.nodes.to_vec(), coefficients: vec![-1.0, 1.0], weight: s.force_n })
        .collect()
}

/// Stress along the fibres at the points of a muscle's elements, and its lines outside the tissue.
fn stresses(body: &Body<3>, number: usize, muscle: &Muscle) -> Vec<Strand> {
    let outside: Vec<_> = muscle.segments.iter().filter(|s| s.outside).collect();
    let mut strands = lines(&outside);
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

/// Coefficients of springs equivalent to the tissue; only motions use them, for the mass of a node.
fn carried_along(body: &Body<3>, law: MooneyRivlin) -> Result<Coefficients, SystemError> {
    let mesh = &body.mesh;
    let poisson_ratio = law.poisson_ratio();
    let young_modulus = 4.0 * law.c10 * (1.0 + poisson_ratio);
    let constants = Constants { young_modulus, poisson_ratio, ..Constants::TONGUE };
    let total: f64 = mesh.connections.iter().map(|&c| mesh.distance(c)).sum();
    let side = total / mesh.connections.len().max(1) as f64;
    let nodes = mesh.in_tissue().iter().filter(|&&t| t).count().max(1);
    let volume = body.mesh.hexahedron_volumes().sum();
    Coefficients::new::<3>(&constants, side, volume, nodes)
}
