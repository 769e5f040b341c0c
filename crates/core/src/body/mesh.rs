//! A body as nodes and the connections between them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::SVector;

use super::Continuum;
use crate::geometry;
use crate::geometry::hexahedron;
use crate::geometry::topology::{self, pair};

/// The cells of a mesh (triangles in 2D, tetrahedra in 3D): `D + 1` node numbers each.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cells<const D: usize> {
    nodes: Vec<usize>,
}

impl<const D: usize> Cells<D> {
    pub const fn new() -> Self {
        Self { nodes: Vec::new() }
    }

    pub fn len(&self) -> usize {
        self.nodes.len() / (D + 1)
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Adds a cell and returns true, if it has `D + 1` nodes; otherwise adds nothing and returns false.
    pub fn push(&mut self, cell: &[usize]) -> bool {
        let fits = cell.len() == D + 1;
        if fits {
            self.nodes.extend_from_slice(cell);
        }
        fits
    }

    /// The cells in order, each as a slice of `D + 1` node numbers.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, usize> {
        self.nodes.chunks_exact(D + 1)
    }

    /// Every edge of the cells, lower node first, ascending, with the number of cells that share it.
    pub fn edges(&self) -> BTreeMap<[usize; 2], usize> {
        topology::edges(self.iter())
    }
}

/// A muscle: a chain of nodes, of which consecutive ones are connections of the mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MuscleChain {
    /// Abbreviation, e.g. `GGa`.
    pub name: String,
    /// Node numbers from the first end to the second, at least two.
    pub nodes: Vec<usize>,
}

impl MuscleChain {
    /// The two end nodes; the straight distance between them is the muscle's length.
    pub fn ends(&self) -> [usize; 2] {
        [self.nodes[0], self.nodes[self.nodes.len() - 1]]
    }
}

/// A body: positions at rest and how they are joined.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh<const D: usize> {
    /// Positions at rest, m.
    pub nodes: Vec<SVector<f64, D>>,
    /// Triangles (2D, counter-clockwise) or tetrahedra (3D, positive volume) of tissue.
    pub cells: Cells<D>,
    /// Hexahedra of tissue, in bodies in space: corners around the bottom, then around the top.
    pub hexahedra: Vec<[usize; 8]>,
    /// Joined pairs of nodes, each once, lower node number first.
    pub connections: Vec<[usize; 2]>,
    pub muscles: Vec<MuscleChain>,
    /// Nodes on bone, in ascending order.
    pub fixed: Vec<usize>,
    /// The quadratic elements of a continuum; `None` for springs.
    pub continuum: Option<Arc<Continuum<D>>>,
}

/// Largest distance of a node between two shapes of one body, m.
pub fn largest_distance<const D: usize>(a: &[SVector<f64, D>], b: &[SVector<f64, D>]) -> f64 {
    a.iter().zip(b).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
}

impl<const D: usize> Mesh<D> {
    /// Sets the connections to the edges of the cells and the steps of the muscles, each once.
    pub fn connect(&mut self) {
        let mut connections: BTreeSet<[usize; 2]> = self.cells.edges().into_keys().collect();
        for corners in &self.hexahedra {
            connections.extend(hexahedron::EDGES.iter().map(|&[a, b]| pair(corners[a], corners[b])));
        }
        connections.extend(self.muscles.iter().flat_map(|m| m.nodes.windows(2)).map(|w| pair(w[0], w[1])));
        self.connections = connections.into_iter().collect();
    }

    /// Nodes on the surface of the tissue, ascending: those of edges (in space: faces) that belong to one cell only.
    pub fn surface_nodes(&self) -> Vec<usize> {
        let of_hexahedra = self.outward_quadrilaterals().into_iter().flat_map(|(_, face)| face);
        let all: BTreeSet<usize> = self.surface().into_iter().flatten().chain(of_hexahedra).collect();
        all.into_iter().collect()
    }

    /// The faces that belong to one hexahedron only, with the number of that hexahedron; their corners are counter-clockwise as seen from
    /// outside.
    pub fn outward_quadrilaterals(&self) -> Vec<(usize, [usize; 4])> {
        let all = self.hexahedra.iter().enumerate();
        let faces = all.flat_map(|(e, c)| hexahedron::FACES.map(|face| (e, face.map(|i| c[i]))));
        let mut count: BTreeMap<[usize; 4], usize> = BTreeMap::new();
        faces.clone().for_each(|(_, face)| *count.entry(sorted(face)).or_default() += 1);
        faces.filter(|(_, face)| count[&sorted(*face)] == 1).collect()
    }

    /// The volume of each hexahedron at rest, m³.
    pub fn hexahedron_volumes(&self) -> impl Iterator<Item = f64> {
        self.hexahedra.iter().map(|nodes| hexahedron::volume(&hexahedron::corners(&self.nodes, nodes)))
    }

    /// The edges (in space: faces) that belong to one cell only, the nodes of each ascending.
    pub fn surface(&self) -> Vec<Vec<usize>> {
        topology::surface(self.cells.iter()).into_keys().collect()
    }

    /// The quadratic elements of a continuum (corners, then the middles of their edges), otherwise the cells.
    pub fn elements(&self) -> impl Iterator<Item = &[usize]> {
        let cells = self.cells.iter().filter(|_| self.continuum.is_none());
        self.continuum.iter().flat_map(|c| c.elements()).chain(cells)
    }

    /// The distance at rest between two nodes, m.
    pub fn distance(&self, [a, b]: [usize; 2]) -> f64 {
        (self.nodes[b] - self.nodes[a]).norm()
    }

    /// Names of the muscles, in their order; several chains may have one name.
    pub fn muscle_names(&self) -> Vec<String> {
        self.muscles.iter().map(|m| m.name.clone()).collect()
    }

    /// For every node whether it belongs to a cell; the others are outside the tissue.
    pub fn in_tissue(&self) -> Vec<bool> {
        let mut inside = vec![false; self.nodes.len()];
        self.cells.iter().flatten().chain(self.hexahedra.iter().flatten()).for_each(|&n| inside[n] = true);
        inside
    }

    /// The longest side of the bounding box, m; 0 without nodes.
    pub fn extent(&self) -> f64 {
        geometry::extent(&self.nodes)
    }
}

pub(super) fn sorted<const N: usize>(mut nodes: [usize; N]) -> [usize; N] {
    nodes.sort_unstable();
    nodes
}

impl Mesh<2> {
    /// The outlines of the tissue; see [`topology::outlines`].
    pub fn outlines(&self) -> Vec<Vec<usize>> {
        topology::outlines(self.cells.iter())
    }
}

impl Mesh<3> {
    /// The triangles of the surface, with corners counter-clockwise as seen from outside.
    pub fn outward_faces(&self) -> Vec<[usize; 3]> {
        let cells: Vec<&[usize]> = self.cells.iter().collect();
        let mut surface: Vec<_> = topology::surface(self.cells.iter()).into_iter().collect();
        surface.sort_by_key(|(_, place)| *place);
        let mut faces = Vec::with_capacity(surface.len());
        for (face, [cell, opposite]) in surface {
            let ([a, b, c], x) = ([face[0], face[1], face[2]], &self.nodes);
            let inwards = (x[b] - x[a]).cross(&(x[c] - x[a])).dot(&(x[cells[cell][opposite]] - x[a])) > 0.0;
            faces.push(if inwards { [a, c, b] } else { [a, b, c] });
        }
        let quadrilaterals = self.outward_quadrilaterals().into_iter();
        faces.extend(quadrilaterals.flat_map(|(_, [a, b, c, d])| [[a, b, c], [a, c, d]]));
        faces
    }
}
