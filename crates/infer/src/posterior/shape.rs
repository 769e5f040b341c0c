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

/// How the length whose adjoint is given answers to the logarithm of kappa, m, at an equilibrium with these positions, m, of a body with
/// `times` its own kappa.
pub(super) fn by_ln_kappa(
    ground: &Ground,
    positions: &[SVector<f64, 2>],
    times: f64,
    adjoint: &Adjoint<2>,
) -> f64 {
    let system: &System<2> = &ground.system;
    let mut sum = 0.0;
    for effect in system.effects() {
        effect.parts(&mut |part| {
            if let Part::Cell { nodes, rest: area, kappa } = part {
                let here = simplex::corners(positions, nodes);
                let gradient = simplex::gradient(&here);
                let free = |n: usize| {
                    if system.pattern().unknown(n).is_some() { adjoint.by_node[n] } else { SVector::zeros() }
                };
                let work: f64 = nodes.iter().zip(&gradient).map(|(&n, g)| g.dot(&free(n))).sum();
                sum -= times * kappa * (simplex::measure(&here) - area) / (area * area) * work;
            }
        });
    }
    sum
}

/// That of the length whose adjoint is given, at an equilibrium with these positions, m, of a body with `times` its own kappa.
fn slope(ground: &Ground, positions: &[SVector<f64, 2>], times: f64, adjoint: &Adjoint<2>) -> ShapeSlope {
    let system: &System<2> = &ground.system;
    let rest = system.rest();
    let free = |n: usize| match system.pattern().unknown(n) {
        Some(_) => adjoint.by_node[n],
        None => SVector::zeros(),
    };
    let mut by_node = vec![SVector::zeros(); rest.len()];
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
                let by_area = times * kappa * (1.0 + 2.0 * strain) / (area * area) * work;
                let at_rest = simplex::gradient(&simplex::corners(rest, nodes));
                nodes.iter().zip(&at_rest).for_each(|(&n, g)| by_node[n] += g * by_area);
            }
        });
    }
    let by_ln_kappa = by_ln_kappa(ground, positions, times, adjoint);
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

/// How the stretches of all muscles in all postures answer at a place, given the adjoints of all lengths there, shape by shape, and kappa as a
/// multiple of the body's own.
pub(super) fn of_springs(ground: &Ground, place: &Place, kappa: f64, rates: &[Vec<Adjoint<2>>]) -> Answers {
    let count = ground.muscles.len();
    let rows = place.lengths.len();
    let slopes: Vec<Vec<ShapeSlope>> = rates
        .iter()
        .enumerate()
        .map(|(s, all)| all.iter().map(|a| slope(ground, place.shape(s).0, kappa, a)).collect())
        .collect();
    let base = rows / count;
    // d(L/L0) = dL/L0 - s dL0/L0.
    let of_stretch = |row: usize, of: &dyn Fn(&ShapeSlope) -> f64| {
        let over = place.baseline_lengths[row % count];
        let (own, base) = (of(&slopes[row / count][row % count]), of(&slopes[base][row % count]));
        (own - place.lengths[row] / over * base) / over
    };
    let of_fields = |fields: &[Field]| {
        DMatrix::from_fn(rows, fields.len(), |row, f| {
            of_stretch(row, &|slope| {
                slope.by_node.iter().zip(&fields[f].displacement).map(|(s, d)| s.dot(d)).sum()
            })
        })
    };
    let prior = &ground.priors.compressibility;
    let is_source = !prior.off && !ground.samples_kappa();
    Answers {
        ends: of_fields(&ground.ends),
        outline: of_fields(&ground.outline),
        kappa: DMatrix::from_fn(rows, usize::from(is_source), |row, _| {
            prior.sd_ln_kappa * of_stretch(row, &|slope| slope.by_ln_kappa)
        }),
        ..Answers::none(rows)
    }
}
