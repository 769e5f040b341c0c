//! How the lengths of muscles answer to the shape of the body at rest and to its constants: exact derivatives, from the adjoint of every
//! length.
//!
//! At equilibrium the forces are functions of the positions, of the rest lengths `l0` of springs, of the rest areas `S0` of cells and of
//! kappa. With `u` the adjoint of a length (its answer to a force on every node) that length answers to any of these by the product of `u`
//! with the change of the forces: for a spring along `n` from a to b `-k n·(u_a - u_b)`, for a cell of strain `e = (S - S0)/S0` with
//! gradient `g` of its area `kappa (1 + 2 e)/S0² sum g·u`, for the logarithm of kappa the product with the forces of the cells. Rest
//! lengths and areas are functions of the places of the nodes at rest, and kappa goes with the square of the mean length of a
//! connection; so every length has a derivative by the place of every node.

use nalgebra::SVector;

use crate::effect::Part;
use crate::geometry::simplex;
use crate::statics::lanes::Adjoint;
use crate::system::System;

use super::ground::Ground;

/// How a length answers to the body.
#[derive(Debug, Clone)]
pub struct ShapeSlope {
    /// To the place at rest of every node, dimensionless.
    pub by_node: Vec<SVector<f64, 2>>,
    /// To the logarithm of kappa, m.
    pub by_ln_kappa: f64,
}

/// That of the length whose adjoint is given, at an equilibrium with these positions, m.
pub fn slope(ground: &Ground, positions: &[SVector<f64, 2>], adjoint: &Adjoint<2>) -> ShapeSlope {
    let system: &System<2> = &ground.system;
    let rest = system.rest();
    let free = |n: usize| match system.pattern().unknown(n) {
        Some(_) => adjoint.by_node[n],
        None => SVector::zeros(),
    };
    let mut by_node = vec![SVector::zeros(); rest.len()];
    let mut by_ln_kappa = 0.0;
    for effect in system.effects() {
        effect.parts(&mut |part| match part {
            Part::Line { spring, .. } => {
                let [a, b] = spring.nodes;
                let along = (positions[b] - positions[a]).normalize();
                let by_rest_length = -spring.stiffness * along.dot(&(free(a) - free(b)));
                let direction = (rest[b] - rest[a]).normalize();
                by_node[b] += direction * by_rest_length;
                by_node[a] -= direction * by_rest_length;
            }
            Part::Cell { nodes, rest: area, kappa } => {
                let here = simplex::corners(positions, nodes);
                let gradient = simplex::gradient(&here);
                let work: f64 = nodes.iter().zip(&gradient).map(|(&n, g)| g.dot(&free(n))).sum();
                let strain = (simplex::measure(&here) - area) / area;
                let by_area = kappa * (1.0 + 2.0 * strain) / (area * area) * work;
                by_ln_kappa -= kappa * strain / area * work;
                let at_rest = simplex::gradient(&simplex::corners(rest, nodes));
                nodes.iter().zip(&at_rest).for_each(|(&n, g)| by_node[n] += g * by_area);
            }
        });
    }
    // Kappa goes with the square of the mean length of a connection.
    let mesh = &ground.body.mesh;
    let total: f64 = mesh.connections.iter().map(|c| mesh.distance(*c)).sum();
    for &[a, b] in &mesh.connections {
        let direction = (rest[b] - rest[a]).normalize() * (2.0 * by_ln_kappa / total);
        by_node[b] += direction;
        by_node[a] -= direction;
    }
    // Bones are where they are at rest, and displaced from there.
    for node in system.held() {
        by_node[node] += adjoint.by_node[node];
    }
    ShapeSlope { by_node, by_ln_kappa }
}
