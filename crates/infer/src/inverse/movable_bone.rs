//! Bones with unknown displacements.

use std::sync::Arc;

use nalgebra::SVector;

use tongue_core::body::{Body, Mesh};
use tongue_core::effect::{Configuration, Tangent};
use tongue_core::sparse::BlockMatrix;
use tongue_core::system::{Model, System, SystemError};

use crate::standard_deviations::HYOID_MM;

use super::{FitError, refused};

pub const BONE_SD_M: f64 = 1e-3 * HYOID_MM;

/// A bone with unknown displacement: its nodes, and the system in which they are free, which gives the tissue's forces on them.
#[derive(Debug, Clone)]
pub struct MovableBone<const D: usize> {
    nodes: Vec<usize>,
    mesh: Mesh<D>,
    freed_system: Arc<System<D>>,
}

impl<const D: usize> MovableBone<D> {
    /// Frees nodes that a bone holds.
    ///
    /// # Errors
    /// [`SystemError::NotOnBone`] for a node that no bone holds; [`SystemError::Loose`] if nothing else holds the body.
    pub fn new(
        mesh: &Mesh<D>,
        model: &Model,
        contracting: &[usize],
        nodes: &[usize],
    ) -> Result<Self, SystemError> {
        if let Some(&node) = nodes.iter().find(|n| !mesh.fixed.contains(n)) {
            return Err(SystemError::NotOnBone { node });
        }
        let mut mesh = mesh.clone();
        mesh.fixed.retain(|n| !nodes.contains(n));
        let freed_system = Arc::new(System::new(&mesh, model, contracting)?);
        Ok(Self { nodes: nodes.to_vec(), mesh, freed_system })
    }

    /// Frees a bone of a body by its name.
    pub fn of(body: &Body<D>, model: &Model, contracting: &[usize], name: &str) -> Result<Self, FitError> {
        let nodes = body.bone(name);
        if nodes.is_empty() {
            let known: Vec<&str> = body.bones.iter().map(|b| b.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return refused(format!(
                "the bone \"{name}\" cannot be freed: the bones of this body are {known}"
            ));
        }
        Ok(Self::new(&body.mesh, model, contracting, nodes)?)
    }

    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Adds the derivative of all nodes' forces by a displacement of the bone along an axis, N/m; `model` replaces that of the body.
    pub(crate) fn add_force(
        &self,
        at: Configuration<'_, D>,
        axis: usize,
        model: Option<Model>,
        force: &mut [SVector<f64, D>],
    ) {
        let contracting = self.freed_system.contracting();
        let replaced = model.and_then(|model| System::new(&self.mesh, &model, contracting).ok());
        let system = replaced.as_ref().unwrap_or(&self.freed_system);
        let pattern = system.pattern();
        let mut stiffness = BlockMatrix::zeros(pattern);
        system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut stiffness));
        let motion = Vec::from_iter(pattern.nodes().iter().map(|node| {
            let mut v = SVector::<f64, D>::zeros();
            if self.nodes.contains(node) {
                v[axis] = 1.0;
            }
            v
        }));
        let mut image = vec![SVector::zeros(); motion.len()];
        stiffness.multiply(pattern, &motion, &mut image);
        pattern.nodes().iter().zip(image).for_each(|(&node, f)| force[node] -= f);
    }
}
