//! Bones with unknown displacements.

use std::sync::Arc;

use nalgebra::SVector;

use tongue_core::body::{Body, Mesh};
use tongue_core::effect::{Configuration, Tangent};
use tongue_core::material::Constants;
use tongue_core::sparse::BlockMatrix;
use tongue_core::system::{Model, System, SystemError};

use crate::standard_deviations::HYOID_MM;

use super::FitError;

/// Standard deviation of the displacement of a bone, m.
pub const BONE_SD_M: f64 = 1e-3 * HYOID_MM;

/// A bone that may be displaced: its nodes, and the system in which they are free, for the forces of the tissue on them.
#[derive(Debug, Clone)]
pub struct MovableBone<const D: usize> {
    nodes: Vec<usize>,
    mesh: Mesh<D>,
    contracting: Vec<usize>,
    loose: Arc<System<D>>,
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
        let loose = Arc::new(System::new(&mesh, model, contracting)?);
        Ok(Self { nodes: nodes.to_vec(), mesh, contracting: contracting.to_vec(), loose })
    }

    /// Frees a bone of a body by its name.
    pub fn of(body: &Body<D>, model: &Model, contracting: &[usize], name: &str) -> Result<Self, FitError> {
        let nodes = body.bone(name);
        if nodes.is_empty() {
            let known: Vec<&str> = body.bones.iter().map(|b| b.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let what = format!("the bone \"{name}\" cannot be freed: the bones of this body are {known}");
            return Err(FitError::Unknown { what });
        }
        Ok(Self::new(&body.mesh, model, contracting, nodes)?)
    }

    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Adds the derivative of the force on every node by a displacement of the bone along an axis with all
    /// other nodes fixed, N/m; `other` are constants of the tissue instead of the model's.
    pub(crate) fn add_force(
        &self,
        at: Configuration<'_, D>,
        axis: usize,
        other: Option<Constants>,
        force: &mut [SVector<f64, D>],
    ) {
        let anew =
            other.and_then(|constants| System::new(&self.mesh, &Model { constants }, &self.contracting).ok());
        let loose = anew.as_ref().unwrap_or(&self.loose);
        let pattern = loose.pattern();
        let mut stiffness = BlockMatrix::zeros(pattern);
        loose.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut stiffness));
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
