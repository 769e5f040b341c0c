//! Responses of muscle lengths to the shape of a body of springs at rest: exact derivatives, from the adjoint of every length.
//!
//! At equilibrium the forces are functions of the positions, of the rest lengths `l0` of springs, of the rest areas `S0` of cells and of
//! kappa. Let `u` be the adjoint of a length, its response to a force on every node. The derivative of the length by any of these is the
//! product of `u` with the change of the forces: for a spring along `n` from a to b `-k n·(u_a - u_b)`, for a cell of strain
//! `e = (S - S0)/S0` with gradient `g` of its area `kappa (1 + 2 e)/S0² sum g·u`, for the logarithm of kappa the product with the forces
//! of the cells. Rest lengths and areas are functions of the node positions at rest, and kappa is proportional to the square of the mean
//! length of a connection; so every length has a derivative by the rest position of every node.

use nalgebra::{DMatrix, SVector};

use tongue_core::effect::Part;
use tongue_core::geometry::simplex;
use tongue_core::statics::lanes::Adjoint;
use tongue_core::system::System;

use super::differences::{self, Answers, Solid};
use super::ground::{Field, Ground};

/// Derivatives, dimensionless, of a length by the rest position of every node, from its adjoint, at an equilibrium with these positions,
/// m.
fn slope(ground: &Ground, positions: &[SVector<f64, 2>], adjoint: &Adjoint<2>) -> Vec<SVector<f64, 2>> {
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
    // Kappa is proportional to the square of the mean length of a connection.
    let mesh = &ground.body.mesh;
    let total: f64 = mesh.connections.iter().map(|c| mesh.distance(*c)).sum();
    for &[a, b] in &mesh.connections {
        let direction = (rest[b] - rest[a]).normalize() * (2.0 * by_ln_kappa / total);
        by_node[b] += direction;
        by_node[a] -= direction;
    }
    // Bones are displaced from their places at rest.
    for node in system.held() {
        by_node[node] += adjoint.by_node[node];
    }
    by_node
}

/// Responses of all measurements at a solved point; `None` where another kappa leads to no equilibrium.
pub(super) fn of_springs(ground: &Ground, point: &Solid<'_>) -> Option<Answers> {
    let place = point.place;
    let count = ground.muscles.len();
    let of_muscles = place.lengths.len();
    let slopes: Vec<Vec<_>> = point
        .rates
        .lengths
        .iter()
        .enumerate()
        .map(|(s, all)| all.iter().map(|a| slope(ground, place.shape(s).0, a)).collect())
        .collect();
    let base = of_muscles / count;
    let of_sight = |(shape, adjoint): &(usize, Adjoint<2>)| slope(ground, place.shape(*shape).0, adjoint);
    let beside: Vec<Option<Vec<_>>> =
        point.rates.sights.iter().map(|sight| sight.as_ref().map(of_sight)).collect();
    let rows = of_muscles + beside.len();
    // d(L/L0) = dL/L0 - s dL0/L0.
    let of_fields = |fields: &[Field]| {
        DMatrix::from_fn(rows, fields.len(), |row, f| {
            let by = |slope: &Vec<SVector<f64, 2>>| -> f64 {
                slope.iter().zip(&fields[f].displacement).map(|(s, d)| s.dot(d)).sum()
            };
            if row >= of_muscles {
                return beside[row - of_muscles].as_ref().map_or(0.0, by);
            }
            let over = place.baseline_lengths[row % count];
            let (own, base) = (by(&slopes[row / count][row % count]), by(&slopes[base][row % count]));
            (own - place.lengths[row] / over * base) / over
        })
    };
    Some(Answers {
        ends: of_fields(&ground.ends),
        outline: of_fields(&ground.outline),
        kappa: differences::by_kappa(ground, point)?,
        ..Answers::none(rows)
    })
}
