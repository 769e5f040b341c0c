//! A mass-spring body in the plane as flat lists of edges and triangles in the order of elimination, which are made once and used by all
//! solves.

pub(crate) mod local;

use std::collections::HashMap;

use nalgebra::SVector;

use super::System;
use crate::effect::spring::Spring;
use crate::effect::{Effect, PrimitiveElement};
use crate::geometry::topology::pair;
use crate::sparse::flat::Symbolic;
use crate::sparse::simd::{Simd, SimdPair};

/// A spring, a side of triangles, or both. Nodes are renumbered: unknowns in the order of elimination, then the nodes of bones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    /// The node that is eliminated later, then the other one.
    pub nodes: [u32; 2],
    /// The triangles on its left and on its right, seen from the first node to the second; the number of cells if there is none.
    pub cells: [u32; 2],
    /// The third corners of the triangles; any node where there is no triangle.
    pub opposite: [u32; 2],
}

/// Elements and unknowns of a system in the plane whose effects consist of [`PrimitiveElement`]s only.
#[derive(Debug)]
pub(crate) struct Elements {
    pub edges: Vec<Edge>,
    /// Corners of every triangle, counter-clockwise.
    pub cells: Vec<[u32; 3]>,
    /// Muscles along edges: `(edge, muscle)`.
    pub pulls: Vec<(u32, u32)>,
    /// Edge, nodes in the mesh and muscle of every spring, in the order of the effects.
    springs: Vec<(u32, [usize; 2], Option<usize>)>,
    corners: Vec<Vec<usize>>,
    /// Number in the mesh of every node.
    pub node: Vec<usize>,
    /// Number of every node of the mesh here; `None` for inner nodes of paths.
    pub number: Vec<Option<u32>>,
    /// Number of unknowns, which are the first nodes.
    pub unknowns: usize,
    pub factor: Symbolic,
}

/// Numbers that differ between bodies with the same edges and triangles.
#[derive(Debug)]
pub(crate) struct ElementNumbers<const L: usize> {
    /// Spring constant of every edge, N/m; zero without a spring.
    pub stiffness: Vec<Simd<L>>,
    /// Length of every edge at rest, m; zero without a spring.
    pub rest: Vec<Simd<L>>,
    /// kappa of every triangle, J, then a zero for edges without a second triangle.
    pub kappa: Vec<Simd<L>>,
    /// One over the area of every triangle at rest, 1/m².
    pub inverse_area: Vec<Simd<L>>,
}

impl<const L: usize> ElementNumbers<L> {
    /// Copies the numbers of the first lane to all lanes.
    pub fn copy_first_lane(&mut self) {
        let all = self.stiffness.iter_mut().chain(&mut self.rest);
        all.chain(&mut self.kappa).chain(&mut self.inverse_area).for_each(|n| n.0 = [n.0[0]; L]);
    }
}

/// Linear response of a body at rest to its muscles.
#[derive(Debug)]
pub(crate) struct AtRest {
    pub energy: f64,
    /// For every muscle that can contract, the motion of the unknowns per unit of its tension, m.
    pub responses: Vec<(usize, Vec<[f64; 2]>)>,
}

impl Elements {
    /// `None` if the system is not in the plane, has other effects, or has elements that are not joined like those of a mesh.
    pub fn new<const D: usize>(system: &System<D>) -> Option<Self> {
        if D != 2 {
            return None;
        }
        let (pattern, effects) = (system.pattern(), system.effects());
        let mut number = vec![None; system.rest().len()];
        let mut node = pattern.nodes().to_vec();
        let unknowns = node.len();
        let (mut edges, mut at) = (Vec::new(), HashMap::new());
        let (mut springs, mut pulls, mut cells, mut corners) = (vec![], vec![], vec![], vec![]);
        node.iter().enumerate().for_each(|(k, &n)| number[n] = Some(k as u32));
        let mut number_of = |n: usize| {
            *number[n].get_or_insert_with(|| {
                node.push(n);
                node.len() as u32 - 1
            })
        };
        let (mut sides, mut is_mesh) = (Vec::new(), true);
        each_part(effects, |part| match part {
            PrimitiveElement::Line { spring, muscle } => {
                let edge = *at.entry(pair(spring.nodes[0], spring.nodes[1])).or_insert_with(|| {
                    let [a, b] = spring.nodes.map(&mut number_of);
                    edges.push(Edge { nodes: [a.max(b), a.min(b)], cells: [u32::MAX; 2], opposite: [a; 2] });
                    edges.len() - 1
                }) as u32;
                springs.push((edge, spring.nodes, muscle));
                pulls.extend(muscle.map(|m| (edge, m as u32)));
            }
            PrimitiveElement::Cell { nodes, .. } => {
                let &[a, b, c] = nodes else { return is_mesh = false };
                corners.push(nodes.to_vec());
                cells.push([a, b, c].map(&mut number_of));
                sides.extend([[a, b, c], [b, c, a], [c, a, b]].map(|side| (cells.len() as u32 - 1, side)));
            }
        })?;
        for (cell, [a, b, c]) in sides {
            let [na, nb, nc] = [a, b, c].map(&mut number_of);
            let edge = *at.entry(pair(a, b)).or_insert_with(|| {
                edges.push(Edge { nodes: [na.max(nb), na.min(nb)], cells: [u32::MAX; 2], opposite: [na; 2] });
                edges.len() - 1
            });
            let edge: &mut Edge = &mut edges[edge];
            let side = usize::from(edge.nodes[0] != na);
            is_mesh &= edge.cells[side] == u32::MAX;
            edge.cells[side] = cell;
            edge.opposite[side] = nc;
        }
        for edge in &mut edges {
            edge.cells.iter_mut().for_each(|c| *c = (*c).min(cells.len() as u32));
        }
        // Nodes of bones without an element have a number too, because they move with their bone.
        system.held().into_iter().for_each(|n| _ = number_of(n));
        let factor = Symbolic::new(pattern, edges.iter().map(|e| e.nodes))?;
        is_mesh.then_some(Self { edges, cells, pulls, springs, corners, node, number, unknowns, factor })
    }

    pub fn numbers<const L: usize>(&self) -> ElementNumbers<L> {
        let [edges, cells] = [self.edges.len(), self.cells.len() + 1].map(|n| vec![Simd::ZERO; n]);
        ElementNumbers { stiffness: edges.clone(), rest: edges, kappa: cells.clone(), inverse_area: cells }
    }

    /// Copies vectors of all nodes of the mesh to a lane.
    pub fn put_into_lane<const D: usize, const L: usize>(
        &self,
        lane: usize,
        of_nodes: &[SVector<f64, D>],
        to: &mut [SimdPair<L>],
    ) {
        for (to, &node) in to.iter_mut().zip(&self.node) {
            (0..2).for_each(|axis| to[axis].0[lane] = of_nodes[node][axis]);
        }
    }

    /// Copies vectors of a lane, as many as there are, to the nodes of the mesh; other nodes, as those within paths, keep theirs.
    pub fn take_from_lane<const D: usize, const L: usize>(
        &self,
        lane: usize,
        from: &[SimdPair<L>],
        of_nodes: &mut [SVector<f64, D>],
    ) {
        for (from, &node) in from.iter().zip(&self.node) {
            (0..2).for_each(|axis| of_nodes[node][axis] = from[axis].0[lane]);
        }
    }

    /// Writes the numbers of a body to a lane. Returns false if its edges, triangles or unknowns differ.
    pub fn fill<const D: usize, const L: usize>(
        &self,
        system: &System<D>,
        lane: usize,
        numbers: &mut ElementNumbers<L>,
    ) -> bool {
        let unknowns = system.pattern().nodes();
        if system.rest().len() != self.number.len() || unknowns != &self.node[..self.unknowns] {
            return false;
        }
        numbers.stiffness.iter_mut().for_each(|k| k.0[lane] = 0.0);
        numbers.rest.iter_mut().for_each(|l| l.0[lane] = 0.0);
        let (mut springs, mut cells) = (self.springs.iter(), self.corners.iter().enumerate());
        let mut same = true;
        let visited = each_part(system.effects(), |part| match part {
            PrimitiveElement::Line { spring: Spring { nodes, stiffness, rest_length, .. }, muscle } => {
                let Some((edge, ..)) = springs.next().filter(|(_, n, m)| (n, *m) == (nodes, muscle)) else {
                    return same = false;
                };
                let rest = &mut numbers.rest[*edge as usize].0[lane];
                same &= *rest == 0.0 || rest == rest_length;
                *rest = *rest_length;
                numbers.stiffness[*edge as usize].0[lane] += stiffness;
            }
            PrimitiveElement::Cell { nodes, rest, kappa } => {
                let Some((cell, _)) = cells.next().filter(|(_, n)| n.as_slice() == nodes) else {
                    return same = false;
                };
                numbers.kappa[cell].0[lane] = kappa;
                numbers.inverse_area[cell].0[lane] = 1.0 / rest;
            }
        });
        same && visited.is_some() && springs.next().is_none() && cells.next().is_none()
    }
}

/// Visits every element of a body; `None` if an effect has other elements.
fn each_part<const D: usize>(
    effects: &[Box<dyn Effect<D>>],
    mut visit: impl FnMut(PrimitiveElement<'_>),
) -> Option<()> {
    effects.iter().all(|e| e.parts(&mut visit)).then_some(())
}
