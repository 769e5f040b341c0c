//! Weight: a constant force on every node of the tissue.

use nalgebra::SVector;

use crate::body::Mesh;
use crate::geometry::simplex;

use super::{Configuration, Effect};

#[derive(Debug, Clone)]
struct NodeLoad<const D: usize> {
    node: usize,
    /// N (2D: per metre of thickness).
    weight: SVector<f64, D>,
    /// The position at which its potential energy is zero, m.
    origin: SVector<f64, D>,
}

/// `W = - sum m_i g·(x_i - X_i)` with the positions `X` at rest. From a far origin the energy would be so large that rounding hides the
/// differences that the line search needs.
#[derive(Debug, Clone)]
pub struct Gravity<const D: usize> {
    loads: Vec<NodeLoad<D>>,
}

impl<const D: usize> Gravity<D> {
    /// Weight of masses (node, kg; 2D: per metre of thickness) under an acceleration, m/s²; the energy is zero at `rest`, the positions of
    /// all nodes, m. Masses of nodes that do not exist are ignored.
    pub fn new(masses: &[(usize, f64)], acceleration: SVector<f64, D>, rest: &[SVector<f64, D>]) -> Self {
        let loads = masses.iter().filter_map(|&(node, mass)| {
            rest.get(node).map(|&origin| NodeLoad { node, weight: acceleration * mass, origin })
        });
        Self { loads: loads.collect() }
    }
}

/// The mass of every node of the tissue, kg (2D: per metre of thickness): each cell gives equal shares of its mass to its corners.
///
/// The thesis (eq. 4.1) and motions give all nodes the same mass, with the same sum. By that rule a corner of the outline would weigh as
/// much as an inner node with twice the tissue around it, on finer meshes too.
pub fn lumped_masses<const D: usize>(mesh: &Mesh<D>, density: f64) -> Vec<(usize, f64)> {
    let mut mass = vec![0.0; mesh.nodes.len()];
    for cell in mesh.cells.iter() {
        let share = density * simplex::measure(&simplex::corners(&mesh.nodes, cell)) / (D + 1) as f64;
        cell.iter().for_each(|&n| mass[n] += share);
    }
    for (corners, volume) in mesh.hexahedra.iter().zip(mesh.hexahedron_volumes()) {
        corners.iter().for_each(|&n| mass[n] += density * volume / corners.len() as f64);
    }
    mass.into_iter().enumerate().filter(|(_, m)| *m > 0.0).collect()
}

impl<const D: usize> Effect<D> for Gravity<D> {
    fn name(&self) -> &'static str {
        "gravity"
    }

    fn elements(&self) -> usize {
        self.loads.len()
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        -self.loads.iter().map(|l| l.weight.dot(&(at.positions[l.node] - l.origin))).sum::<f64>()
    }

    fn add_force(&self, _at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        self.loads.iter().for_each(|l| force[l.node] += l.weight);
    }
}
