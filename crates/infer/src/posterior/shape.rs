//! How the lengths of muscles answer to the shape of the body at rest and to its constants: exact derivatives, from the adjoint of every
//! length.
//!
//! At equilibrium the forces are functions of the positions, of the rest lengths `l0` of springs, of the rest areas `S0` of cells and of
//! kappa. With `u` the adjoint of a length (its answer to a force on every node) that length answers to any of these by the product of `u`
//! with the change of the forces: for a spring along `n` from a to b `-k n·(u_a - u_b)`, for a cell of strain `e = (S - S0)/S0` with
//! gradient `g` of its area `kappa (1 + 2 e)/S0² sum g·u`, for the logarithm of kappa the product with the forces of the cells. Rest
//! lengths and areas are functions of the places of the nodes at rest, and kappa goes with the square of the mean length of a
//! connection; so every length has a derivative by the place of every node.

use nalgebra::{DMatrix, SVector};

use tongue_core::effect::Part;
use tongue_core::geometry::simplex;
use tongue_core::statics::lanes::Adjoint;
use tongue_core::system::System;

use super::density::Place;
use super::differences::Answers;
use super::ground::{Field, Ground};

/// How a length answers to the body.
#[derive(Debug, Clone)]
struct ShapeSlope {
    /// To the place at rest of every node, dimensionless.
    by_node: Vec<SVector<f64, 2>>,
    /// To the logarithm of kappa, m.
    by_ln_kappa: f64,
}

/// That of the length whose adjoint is given, at an equilibrium with these positions, m.
fn slope(ground: &Ground, positions: &[SVector<f64, 2>], adjoint: &Adjoint<2>) -> ShapeSlope {
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

/// How the stretches of all muscles answer at a place, given the adjoints of all lengths there.
pub fn of_springs(
    ground: &Ground,
    place: &Place,
    posture: &[Adjoint<2>],
    baseline: &[Adjoint<2>],
) -> Answers {
    let count = ground.muscles.len();
    let stretch = |m: usize| place.lengths[m] / place.baseline_lengths[m];
    // d(L/L0) = dL/L0 - s dL0/L0.
    let parts = |m: usize| (1.0 / place.baseline_lengths[m], -stretch(m) / place.baseline_lengths[m]);
    let shape = |positions: &[SVector<f64, 2>], all: &[Adjoint<2>]| -> Vec<ShapeSlope> {
        all.iter().map(|a| slope(ground, positions, a)).collect()
    };
    let (own, over) = (shape(&place.posture, posture), shape(&place.baseline, baseline));
    let of_fields = |fields: &[Field]| {
        DMatrix::from_fn(count, fields.len(), |m, f| {
            let dot = |slope: &ShapeSlope| -> f64 {
                slope.by_node.iter().zip(&fields[f].displacement).map(|(s, d)| s.dot(d)).sum()
            };
            let (a, b) = parts(m);
            a * dot(&own[m]) + b * dot(&over[m])
        })
    };
    let kappa = &ground.priors.compressibility;
    Answers {
        ends: of_fields(&ground.ends),
        outline: of_fields(&ground.outline),
        kappa: DMatrix::from_fn(count, usize::from(!kappa.off), |m, _| {
            let (a, b) = parts(m);
            kappa.sd_ln_kappa * (a * own[m].by_ln_kappa + b * over[m].by_ln_kappa)
        }),
        ..Answers::none(count)
    }
}
