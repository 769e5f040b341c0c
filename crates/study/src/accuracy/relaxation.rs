//! Dynamic relaxation: explicit motion with fictitious masses and kinetic damping (Cundall 1976; Barnes
//! 1999), the classical way to an equilibrium without a matrix.

use nalgebra::SVector;

use tongue_core::effect::{Configuration, Tangent};
use tongue_core::sparse::BlockMatrix;
use tongue_core::system::System;

/// Factor of the masses over the stability limit of Gershgorin's theorem.
const SAFETY: f64 = 1.1;

/// Result of a relaxation.
#[derive(Debug, Clone)]
pub struct Relaxed<const D: usize> {
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// Whether the largest residual force came below the tolerance.
    pub converged: bool,
    /// Steps, each with one evaluation of the force.
    pub steps: u64,
}

/// Relaxes `system` from rest until the residual force of every free node is below `tolerance`, N, or the
/// steps are used up.
///
/// Every node has the mass `1/4 sum_j |K_ij|` of its row of the stiffness, which keeps every mode stable with
/// unit time steps (Underwood 1983). When the kinetic energy passes a maximum, the masses are computed again
/// and all velocities are set to zero.
pub fn relax<const D: usize>(
    system: &System<D>,
    tensions: &[f64],
    tolerance: f64,
    most_steps: u64,
) -> Relaxed<D> {
    let mut positions = system.rest().to_vec();
    let mut velocities = vec![SVector::<f64, D>::zeros(); positions.len()];
    let mut force = velocities.clone();
    let mut matrix = BlockMatrix::zeros(system.pattern());
    let mut mass = masses(system, &positions, tensions, &mut matrix);
    let (mut steps, mut kinetic_before) = (0, 0.0);
    let mut converged = false;
    while steps < most_steps {
        steps += 1;
        system.force(Configuration { positions: &positions, tensions }, &mut force);
        let nodes = system.pattern().nodes();
        let largest = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        let residual = nodes.iter().map(|&n| force[n].norm_squared()).fold(0.0, largest).sqrt();
        if residual <= tolerance {
            converged = true;
            break;
        }
        if !residual.is_finite() {
            break;
        }
        // The velocity in the middle of the first step comes from half a step's acceleration.
        let part = if kinetic_before > 0.0 { 1.0 } else { 0.5 };
        let mut kinetic = 0.0;
        for (&n, m) in nodes.iter().zip(&mass) {
            velocities[n] += force[n] * (part / *m);
            kinetic += m * velocities[n].norm_squared();
        }
        if kinetic < kinetic_before {
            velocities.fill(SVector::zeros());
            mass = masses(system, &positions, tensions, &mut matrix);
            kinetic_before = 0.0;
            continue;
        }
        kinetic_before = kinetic;
        nodes.iter().for_each(|&n| positions[n] += velocities[n]);
    }
    system.place_path_nodes(&mut positions);
    Relaxed { positions, converged, steps }
}

/// A mass for each unknown, in the order of the sparsity pattern.
fn masses<const D: usize>(
    system: &System<D>,
    positions: &[SVector<f64, D>],
    tensions: &[f64],
    matrix: &mut BlockMatrix<D>,
) -> Vec<f64> {
    let at = Configuration { positions, tensions };
    matrix.clear();
    system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Convex, matrix));
    matrix.row_sums(system.pattern()).into_iter().map(|sum| 0.25 * SAFETY * sum).collect()
}
