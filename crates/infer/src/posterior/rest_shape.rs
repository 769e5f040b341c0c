//! Sensitivities of muscle lengths to the shape of a body of springs at rest: exact derivatives by adjoints.
//!
//! At equilibrium the forces are functions of the positions, the rest lengths `l0` of springs, the rest areas `S0` of cells and kappa. With
//! `u` the adjoint of a length, its response to a force on every node, the derivative of the length is the product of `u` with the
//! derivative of the forces: for a spring along `n` from a to b `-k n·(u_a - u_b)`; for a cell of strain `e = (S - S0)/S0` with gradient
//! `g` of its area `kappa (1 + 2 e)/S0² sum g·u`; for the logarithm of kappa the product with the forces of the cells. Rest lengths and
//! areas follow from the node positions at rest, and kappa is proportional to the square of the mean length of a connection.

use nalgebra::SVector;

use tongue_core::effect::PrimitiveElement;
use tongue_core::geometry::simplex::{self, Corners};
use tongue_core::statics::lanes::Adjoint;
use tongue_core::system::System;

use super::finite_differences;
use super::linearisation::{DifferentiatedPoint, GeometrySensitivities};
use super::model::{Field, PosteriorModel};

enum ElementTerm {
    /// A spring: nodes, stiffness (N/m), and directions in the shape and at rest.
    Line { nodes: [usize; 2], stiffness: f64, along: SVector<f64, 2>, at_rest: SVector<f64, 2> },
    /// A cell: nodes, derivatives of its area by these in the shape and at rest (m), and the factors of the work of a motion on the former
    /// in the derivatives by its area at rest and by the logarithm of kappa.
    Cell { nodes: [usize; 3], gradient: Corners<2>, at_rest: Corners<2>, by_area: f64, by_ln_kappa: f64 },
}

struct LinearisedShape<'a> {
    posterior_model: &'a PosteriorModel,
    elements: Vec<ElementTerm>,
    /// Every connection with its direction at rest.
    connections: Vec<([usize; 2], SVector<f64, 2>)>,
    /// Total length of the connections at rest, m.
    total: f64,
    held: Vec<usize>,
}

impl<'a> LinearisedShape<'a> {
    fn new(posterior_model: &'a PosteriorModel, positions: &[SVector<f64, 2>]) -> Self {
        let system: &System<2> = &posterior_model.system;
        let rest = system.rest();
        let direction = |x: &[SVector<f64, 2>], [a, b]: [usize; 2]| (x[b] - x[a]).normalize();
        let mut elements = Vec::new();
        for effect in system.effects() {
            effect.parts(&mut |part| match part {
                PrimitiveElement::Line { spring, .. } => elements.push(ElementTerm::Line {
                    nodes: spring.nodes,
                    stiffness: spring.stiffness,
                    along: direction(positions, spring.nodes),
                    at_rest: direction(rest, spring.nodes),
                }),
                PrimitiveElement::Cell { nodes, rest: area, kappa } => {
                    let here = simplex::corners(positions, nodes);
                    let strain = (simplex::measure(&here) - area) / area;
                    elements.push(ElementTerm::Cell {
                        nodes: [nodes[0], nodes[1], nodes[2]],
                        gradient: simplex::gradient(&here),
                        at_rest: simplex::gradient(&simplex::corners(rest, nodes)),
                        by_area: kappa * (1.0 + 2.0 * strain) / (area * area),
                        by_ln_kappa: kappa * strain / area,
                    });
                }
            });
        }
        let mesh = &posterior_model.body.mesh;
        let connections = mesh.connections.iter().map(|&c| (c, direction(rest, c))).collect();
        let total = mesh.connections.iter().map(|c| mesh.distance(*c)).sum();
        Self { posterior_model, elements, connections, total, held: system.held() }
    }

    /// Derivatives of a length by the rest position of every node, from its adjoint, dimensionless.
    fn slope(&self, adjoint: &Adjoint<2>) -> Vec<SVector<f64, 2>> {
        let system = &self.posterior_model.system;
        let free = |n: usize| match system.pattern().unknown(n) {
            Some(_) => adjoint.by_node[n],
            None => SVector::zeros(),
        };
        let mut by_node = vec![SVector::zeros(); system.rest().len()];
        let mut by_ln_kappa = 0.0;
        for element in &self.elements {
            match element {
                ElementTerm::Line { nodes: [a, b], stiffness, along, at_rest } => {
                    let by_rest_length = -stiffness * along.dot(&(free(*a) - free(*b)));
                    by_node[*b] += at_rest * by_rest_length;
                    by_node[*a] -= at_rest * by_rest_length;
                }
                ElementTerm::Cell { nodes, gradient, at_rest, by_area, by_ln_kappa: by_ln } => {
                    let work: f64 = nodes.iter().zip(gradient).map(|(&n, g)| g.dot(&free(n))).sum();
                    by_ln_kappa -= by_ln * work;
                    let by_area = by_area * work;
                    nodes.iter().zip(at_rest).for_each(|(&n, g)| by_node[n] += g * by_area);
                }
            }
        }
        // Kappa is proportional to the square of the mean length of a connection.
        for &([a, b], direction) in &self.connections {
            let by_length = direction * (2.0 * by_ln_kappa / self.total);
            by_node[b] += by_length;
            by_node[a] -= by_length;
        }
        // Bones are displaced from their places at rest.
        for &node in &self.held {
            by_node[node] += adjoint.by_node[node];
        }
        by_node
    }
}

/// The sensitivities at a solved point; `None` where another kappa leads to no equilibrium.
pub(super) fn of_springs(point: &DifferentiatedPoint<'_>) -> Option<GeometrySensitivities> {
    let posterior_model = point.problem.posterior_model;
    // Derivatives of the numbers of each shape by the rest position of every node.
    let slopes = Vec::from_iter(point.adjoints.iter().enumerate().map(|(index, own)| {
        let shape = LinearisedShape::new(posterior_model, point.solved.shape(index).0);
        own.iter().map(|adjoint| shape.slope(adjoint)).collect::<Vec<_>>()
    }));
    let of_fields = |fields: &[Field]| {
        let columns = fields.iter().map(|field| {
            let of_shapes: Vec<Vec<f64>> = Vec::from_iter(slopes.iter().map(|own| {
                own.iter().map(|slope| slope.iter().zip(field).map(|(s, d)| s.dot(d)).sum()).collect()
            }));
            point.changes(1.0, &of_shapes, |_| 0.0)
        });
        point.matrix(&columns.collect::<Vec<_>>())
    };
    Some(GeometrySensitivities {
        ends: of_fields(&posterior_model.ends),
        outline: of_fields(&posterior_model.outline),
        kappa: finite_differences::by_kappa(point)?,
        width: point.matrix(&[]),
        patch: point.matrix(&[]),
    })
}
