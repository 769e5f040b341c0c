//! Weight: a constant force on every node of the tissue.

use nalgebra::SVector;

use super::{Configuration, Effect};
use crate::body::Mesh;
use crate::geometry::simplex;

/// `W = - sum m_i g·(x_i - X_i)` with the positions `X` at rest. From a far origin the energy would be so large that rounding hides the
/// differences that the line search needs.
#[derive(Debug, Clone)]
pub struct Gravity<const D: usize> {
    /// Nodes, their weights, N (2D: per metre of thickness), and the positions at which their energy is zero, m.
    loads: Vec<(usize, SVector<f64, D>, SVector<f64, D>)>,
}

impl<const D: usize> Gravity<D> {
    /// Weight of masses (node, kg; 2D: per metre of thickness) under an acceleration, m/s²; the energy is zero at `rest`, the positions of
    /// all nodes, m. Masses of nodes that do not exist are ignored.
    pub fn new(masses: &[(usize, f64)], acceleration: SVector<f64, D>, rest: &[SVector<f64, D>]) -> Self {
        let load = |&(node, mass): &(usize, f64)| Some((node, acceleration * mass, *rest.get(node)?));
        Self { loads: masses.iter().filter_map(load).collect() }
    }
}

/// The mass of every node of the tissue, kg (2D: per metre of thickness): each cell gives equal shares of its mass to its corners.
///
/// With equal masses, the rule of the thesis (eq. 4.1) and of motions, a corner of the outline would weigh as much as an inner node.
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
        let work =
            self.loads.iter().map(|(node, weight, origin)| weight.dot(&(at.positions[*node] - origin)));
        -work.sum::<f64>()
    }

    fn add_force(&self, _at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        self.loads.iter().for_each(|(node, weight, _)| force[*node] += weight);
    }
}
