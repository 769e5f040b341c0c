//! A body prepared for solves: effects, unknowns and the sparsity pattern. A system is immutable and may be shared between threads; a
//! solve writes to a [`crate::statics::Workspace`], of which each thread has its own.

mod additions;
mod build;
pub(crate) mod elements;
pub mod model;
pub mod path;
mod space;

use std::sync::{Arc, OnceLock};

use nalgebra::{SMatrix, SVector};

use crate::body::{BodyError, Continuum, MeshFault};
use crate::effect::{Configuration, Effect};
use crate::geometry::{hexahedron, simplex};
use crate::limits::BeyondLimit;
use crate::material::{Coefficients, Stress};
use crate::sparse::Pattern;

pub use crate::material::Model;
pub use additions::{Additions, PrescribedDisplacement};
pub use build::are_held;
pub use model::{TissueModel, coefficients, connection_stiffness};
pub use path::StraightPath;
pub use space::{MusclesAs, SpaceModel};

use elements::{AtRest, Elements};

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    #[error(transparent)]
    Limit(#[from] BeyondLimit),
    #[error(
        "node {node} (and all that is joined to it) is joined to no bone, so it could move freely: fix at least one of its nodes"
    )]
    Loose { node: usize },
    #[error("node {node} is to be displaced with a bone, but no bone holds it; fix it in the mesh")]
    NotOnBone { node: usize },
    #[error("the mesh is faulty: {0}")]
    Mesh(#[from] MeshFault),
    #[error("the body is faulty: {0}")]
    Space(#[from] BodyError),
    /// A model or a motion that is impossible, with what to do.
    #[error("{0}")]
    Invalid(String),
}

/// The unknowns, the sets of nodes that are coupled, and the pattern that follows from both.
#[derive(Debug)]
pub struct Layout {
    is_unknown: Vec<bool>,
    stencils: Vec<Vec<usize>>,
    pattern: Pattern,
}

#[derive(Debug)]
pub struct System<const D: usize> {
    tissue: TissueModel,
    coefficients: Coefficients,
    rest: Vec<SVector<f64, D>>,
    /// Displaced nodes of bones and their positions, m.
    pub(crate) displaced: Vec<(usize, SVector<f64, D>)>,
    effects: Vec<Box<dyn Effect<D>>>,
    /// Shared by bodies that differ only in the positions of their nodes.
    layout: Arc<Layout>,
    paths: Vec<StraightPath>,
    pub(crate) continuum: Option<Arc<Continuum<D>>>,
    muscle_ends: Vec<[usize; 2]>,
    contracting: Vec<usize>,
    /// Cells with their measure at rest, m² or m³.
    pub(crate) cells: Vec<(Vec<usize>, f64)>,
    /// A number that no other system of the program has.
    pub(crate) number: u64,
    elements: OnceLock<Option<Arc<Elements>>>,
    /// The linear response of the body at rest to its muscles, made when it is first needed.
    pub(crate) at_rest: OnceLock<Option<AtRest>>,
}

impl<const D: usize> System<D> {
    pub fn tissue(&self) -> TissueModel {
        self.tissue
    }

    pub fn coefficients(&self) -> &Coefficients {
        &self.coefficients
    }

    /// Positions of all nodes at rest, m.
    pub fn rest(&self) -> &[SVector<f64, D>] {
        &self.rest
    }

    /// The position of a node of a bone, m, which may be displaced.
    pub(crate) fn bone_position(&self, node: usize) -> SVector<f64, D> {
        self.displaced.iter().find(|(n, _)| *n == node).map_or(self.rest[node], |(_, at)| *at)
    }

    pub fn held(&self) -> Vec<usize> {
        let inner = self.paths.iter().flat_map(StraightPath::inner_nodes);
        let followers = self.continuum.iter().flat_map(|c| c.followers.iter().map(|f| f.node));
        let placed: Vec<usize> = inner.chain(followers).collect();
        let is_held = |n: &usize| self.layout.pattern.unknown(*n).is_none() && !placed.contains(n);
        (0..self.rest.len()).filter(is_held).collect()
    }

    /// The layout, for [`Additions::layout`] of a body that differs only in the positions of its nodes.
    pub fn layout(&self) -> Arc<Layout> {
        Arc::clone(&self.layout)
    }

    pub fn effects(&self) -> &[Box<dyn Effect<D>>] {
        &self.effects
    }

    /// The effects as flat lists, if this is a mass-spring body in the plane; made at the first call.
    pub(crate) fn elements(&self) -> Option<&Arc<Elements>> {
        let make = || {
            let is_small = !self.layout.pattern.is_for_supernodes::<D>();
            is_small.then(|| Elements::new(self)).flatten().map(Arc::new)
        };
        self.elements.get_or_init(make).as_ref()
    }

    pub fn pattern(&self) -> &Pattern {
        &self.layout.pattern
    }

    pub fn paths(&self) -> &[StraightPath] {
        &self.paths
    }

    /// Numbers of the muscles that can contract.
    pub fn contracting(&self) -> &[usize] {
        &self.contracting
    }

    pub fn muscle_count(&self) -> usize {
        self.muscle_ends.len()
    }

    pub fn muscle_ends(&self, muscle: usize) -> [usize; 2] {
        self.muscle_ends[muscle]
    }

    pub fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.effects.iter().map(|e| e.energy(at)).sum()
    }

    /// Force on every node, N; on nodes of bones minus the reaction.
    pub fn force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        force.fill(SVector::zeros());
        self.effects.iter().for_each(|e| e.add_force(at, force));
    }

    /// Largest part (0 to 1) of `step` that all effects allow.
    pub(crate) fn step_limit(&self, at: Configuration<'_, D>, step: &[SVector<f64, D>]) -> f64 {
        self.effects.iter().map(|e| e.step_limit(at, step)).fold(1.0, f64::min)
    }

    /// The straight distance between the ends of muscle `muscle`, m.
    pub fn length(&self, positions: &[SVector<f64, D>], muscle: usize) -> f64 {
        let [a, b] = self.muscle_ends[muscle];
        (positions[b] - positions[a]).norm()
    }

    /// Lengths of all muscles, m.
    pub fn lengths(&self, positions: &[SVector<f64, D>]) -> Vec<f64> {
        (0..self.muscle_count()).map(|muscle| self.length(positions, muscle)).collect()
    }

    /// Smallest and largest ratio of a cell's measure to that at rest; `(1, 1)` without cells.
    pub fn cell_ratios(&self, positions: &[SVector<f64, D>]) -> (f64, f64) {
        extremes(self.cells.iter().map(|(cell, rest)| cell_measure(positions, cell) / rest))
    }

    /// Smallest and largest ratio of the tissue's area, in space its volume, to that at rest: in a continuum in the middle of the parts of
    /// each element, because the cells have straight sides and the elements do not, otherwise of the cells.
    pub fn tissue_ratios(&self, positions: &[SVector<f64, D>]) -> (f64, f64) {
        if self.tissue() != TissueModel::Continuum {
            return self.cell_ratios(positions);
        }
        // The ratio is the root of the determinant of FᵀF = I + 2E.
        extremes(self.stresses(positions).into_iter().map(|s| {
            let corners = simplex::of_columns(&(s.strain * 2.0 + SMatrix::identity()));
            (simplex::factorial::<D>() * simplex::measure(&corners)).max(0.0).sqrt()
        }))
    }

    /// Area, m², or volume, m³, of all cells.
    pub fn measure(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.cells.iter().map(|(cell, _)| cell_measure(positions, cell)).sum()
    }

    /// Strain and stress of every cell at these positions, m, without the stress in muscles; empty unless the body is a continuum.
    pub fn stresses(&self, positions: &[SVector<f64, D>]) -> Vec<Stress<D>> {
        let at = Configuration { positions, tensions: &[] };
        self.effects.iter().flat_map(|e| e.stresses(at)).collect()
    }

    /// Number of elements in which the barrier against inversion acts ([`crate::effect::spring`]).
    pub fn barrier_active(&self, at: Configuration<'_, D>) -> usize {
        self.effects.iter().map(|e| e.barrier_active(at)).sum()
    }

    /// Whether an effect prevents inverted cells; springs alone do not.
    pub fn keeps_cells_upright(&self) -> bool {
        self.cells.is_empty() || self.effects.iter().any(|e| e.keeps_cells_upright())
    }

    /// Places inner nodes of straight paths between the ends of their path, and nodes that follow a continuum.
    pub fn place_path_nodes(&self, positions: &mut [SVector<f64, D>]) {
        self.paths.iter().for_each(|p| p.place(positions));
        self.continuum.iter().for_each(|c| c.place_followers(positions));
    }
}

/// The smallest and the largest ratio; 1 and 1 without ratios.
fn extremes(ratios: impl Iterator<Item = f64>) -> (f64, f64) {
    ratios.map(|r| (r, r)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((1.0, 1.0))
}

/// Area, m², or volume, m³, of a triangle, tetrahedron or hexahedron.
fn cell_measure<const D: usize>(positions: &[SVector<f64, D>], cell: &[usize]) -> f64 {
    match <&[usize; hexahedron::CORNERS]>::try_from(cell) {
        Ok(corners) => hexahedron::volume(&hexahedron::corners(positions, corners)),
        Err(_) => simplex::measure(&simplex::corners(positions, cell)),
    }
}
