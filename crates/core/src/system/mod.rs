//! A body ready to be solved: effects, unknowns and the sparsity pattern. They are made once and then only
//! read.
//!
//! A system is immutable and may be shared between threads. A solve writes into a
//! [`crate::statics::Workspace`], of which each thread has its own.

mod additions;
mod bones;
mod connections;
pub(crate) mod elements;
mod error;
pub mod locking;
mod model;
pub mod path;
mod space;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use nalgebra::{SVector, Vector3};

use crate::body::{Continuum, Mesh};
use crate::compiled::Entries;
use crate::effect::{
    Attachment, Configuration, Effect, Fibres, FiniteElements, Incompressibility, QuadraticElements, Upright,
};
use crate::geometry::{hexahedron, simplex};
use crate::material::{Coefficients, Stress};
use crate::sparse::Pattern;

pub use additions::Additions;
pub use bones::Carried;
pub use error::SystemError;
pub use model::{Model, TissueModel, coefficients, connection_stiffness};
pub use path::{OutsidePath, StraightPath};
pub use space::{MusclesAs, SpaceModel};

use elements::{AtRest, Elements};

/// The width that is assumed for muscles without a width, m.
const LEAST_WIDTH_M: f64 = 1e-3;

/// Number of systems that were made, from which each gets its own number.
static MADE: AtomicU64 = AtomicU64::new(0);

/// A body ready to be solved.
#[derive(Debug)]
pub struct System<const D: usize> {
    tissue: TissueModel,
    coefficients: Coefficients,
    rest: Vec<SVector<f64, D>>,
    /// Bone nodes that are displaced from rest, and their new positions, m.
    carried: Vec<(usize, SVector<f64, D>)>,
    effects: Vec<Box<dyn Effect<D>>>,
    pattern: Pattern,
    paths: Vec<StraightPath>,
    continuum: Option<Arc<Continuum<D>>>,
    muscle_ends: Vec<[usize; 2]>,
    contracting: Vec<usize>,
    /// Cells with their measure at rest, m² or m³.
    cells: Vec<(Vec<usize>, f64)>,
    /// A number that no other system of the program has.
    number: u64,
    entries: Entries<D>,
    elements: OnceLock<Option<Arc<Elements>>>,
    at_rest: OnceLock<Option<AtRest>>,
}

impl<const D: usize> System<D> {
    /// A system in which the muscles `contracting` (numbers into `mesh.muscles`) can pull. Every other
    /// connection is plain tissue.
    ///
    /// # Errors
    /// [`SystemError`] for bad constants, muscles that do not exist, faulty meshes ([`Mesh::check`]), bodies
    /// given in millimetres, and parts without bone.
    pub fn new(mesh: &Mesh<D>, model: &Model, contracting: &[usize]) -> Result<Self, SystemError> {
        Self::with(mesh, model, contracting, Additions::default())
    }

    /// As [`System::new`], with a scene's additions to the plain model and removals from it.
    ///
    /// # Errors
    /// As [`System::new`], and [`SystemError::NotOnBone`] for a node to be carried that no bone holds.
    pub fn with(
        mesh: &Mesh<D>,
        model: &Model,
        contracting: &[usize],
        additions: Additions<D>,
    ) -> Result<Self, SystemError> {
        match Entries::of_dimension() {
            Some(entries) => (entries.build)(mesh, model, contracting, additions),
            None => Err(SystemError::Dimension { dimension: D }),
        }
    }

    /// As [`System::with`], compiled for the dimension where it is called; see [`crate::compiled`].
    pub(crate) fn build(
        mesh: &Mesh<D>,
        model: &Model,
        contracting: &[usize],
        additions: Additions<D>,
    ) -> Result<Self, SystemError> {
        mesh.check()?;
        if let Some(&muscle) = contracting.iter().find(|&&m| m >= mesh.muscles.len()) {
            return Err(SystemError::NoSuchMuscle { muscle, count: mesh.muscles.len() });
        }
        mesh.check_size()?;
        let coefficients = coefficients(mesh, model)?;
        // At exactly 1/4 the matching gives rounding error in place of zero.
        let rounding = 1e-12 * coefficients.tissue_stiffness * mesh.extent().powi(2);
        if let Some(continuum) = &mesh.continuum {
            let effects = continuum_effects(mesh, continuum, model, &coefficients, contracting)
                .chain(additions.effects)
                .collect();
            let tissue = TissueModel::Continuum;
            return Self::assemble(
                mesh,
                tissue,
                coefficients,
                effects,
                &additions.carried,
                Vec::new(),
                contracting,
            );
        }
        let incompressible = model.tissue == TissueModel::MassSpring && additions.incompressible;
        if incompressible && coefficients.kappa < -rounding {
            let poisson_ratio = model.constants.poisson_ratio;
            return Err(SystemError::NegativeKappa { kappa: coefficients.kappa, poisson_ratio });
        }
        let stiffness = connection_stiffness(mesh, &coefficients);
        let paths = match model.outside {
            OutsidePath::Straight => path::find(mesh, &stiffness),
            OutsidePath::Chain => Vec::new(),
        };
        // Connections whose springs the continuum replaces.
        let continuum = match model.tissue {
            TissueModel::MassSpring => BTreeMap::new(),
            TissueModel::FiniteElement => mesh.cells.edges(),
            TissueModel::Continuum | TissueModel::Hexahedra => return Err(SystemError::NotAContinuum),
        };
        let replaced = |nodes: &[usize; 2]| continuum.contains_key(nodes);
        let mut effects =
            connections::effects(mesh, contracting, &coefficients, &stiffness, &paths, replaced);
        match model.tissue {
            _ if mesh.cells.is_empty() => {}
            // At exactly 1/4 the coefficient of the area term is rounding error of either sign.
            TissueModel::MassSpring if !incompressible || coefficients.kappa <= rounding => {}
            TissueModel::MassSpring => {
                effects.push(Box::new(Incompressibility::new(coefficients.kappa, &mesh.cells, &mesh.nodes)));
            }
            TissueModel::FiniteElement => {
                effects.push(Box::new(FiniteElements::new(
                    (&model.constants).into(),
                    model.constants.viscosity,
                    &mesh.cells,
                    &mesh.nodes,
                )));
            }
            TissueModel::Continuum | TissueModel::Hexahedra => {}
        }
        effects.extend(additions.effects);
        Self::assemble(mesh, model.tissue, coefficients, effects, &additions.carried, paths, contracting)
    }

    /// A system of given effects on the nodes of `mesh`, with no straight paths, for bodies that
    /// [`System::new`] cannot describe: uneven stiffness, other laws. `coefficients` are only carried along.
    ///
    /// # Errors
    /// [`SystemError::Loose`] for parts without bone.
    pub fn from_effects(
        mesh: &Mesh<D>,
        coefficients: Coefficients,
        effects: Vec<Box<dyn Effect<D>>>,
        contracting: &[usize],
    ) -> Result<Self, SystemError> {
        match Entries::of_dimension() {
            Some(entries) => (entries.build_from_effects)(mesh, coefficients, effects, contracting),
            None => Err(SystemError::Dimension { dimension: D }),
        }
    }

    /// As [`System::from_effects`], compiled where it is called; see [`crate::compiled`].
    pub(crate) fn build_from_effects(
        mesh: &Mesh<D>,
        coefficients: Coefficients,
        effects: Vec<Box<dyn Effect<D>>>,
        contracting: &[usize],
    ) -> Result<Self, SystemError> {
        let tissue = TissueModel::MassSpring;
        Self::assemble(mesh, tissue, coefficients, effects, &[], Vec::new(), contracting)
    }

    fn assemble(
        mesh: &Mesh<D>,
        tissue: TissueModel,
        coefficients: Coefficients,
        mut effects: Vec<Box<dyn Effect<D>>>,
        carried: &[(usize, SVector<f64, D>)],
        paths: Vec<StraightPath>,
        contracting: &[usize],
    ) -> Result<Self, SystemError> {
        let rest = mesh.nodes.clone();
        let all = mesh.cells.iter().chain(mesh.hexahedra.iter().map(|corners| &corners[..]));
        let cells = all.map(|cell| (cell.to_vec(), cell_measure(&rest, cell))).collect();
        let mut held: BTreeMap<usize, SVector<f64, D>> = mesh.fixed.iter().map(|&n| (n, rest[n])).collect();
        for &(node, position) in carried {
            *held.get_mut(&node).ok_or(SystemError::NotOnBone { node })? = position;
        }
        let mut is_unknown = vec![true; rest.len()];
        let followers = mesh.continuum.iter().flat_map(|c| c.followers.iter().map(|f| f.node));
        paths
            .iter()
            .flat_map(StraightPath::inner_nodes)
            .chain(followers)
            .chain(held.keys().copied())
            .for_each(|n| is_unknown[n] = false);
        let carried = held.iter().map(|(&n, &x)| (n, x)).filter(|&(n, x)| x != rest[n]).collect();
        let mut cliques = Vec::new();
        for effect in &effects {
            effect.stencils(&mut |nodes| cliques.push(nodes.to_vec()));
        }
        if let Some(node) = loose_node(rest.len(), &cliques, &is_unknown, &mesh.fixed) {
            return Err(SystemError::Loose { node });
        }
        let pattern = Pattern::new(rest.len(), &is_unknown, cliques);
        effects.iter_mut().for_each(|e| e.bind(&pattern));
        Ok(Self {
            tissue,
            coefficients,
            rest,
            carried,
            effects,
            pattern,
            paths,
            continuum: mesh.continuum.clone(),
            muscle_ends: mesh.muscles.iter().map(|m| m.ends()).collect(),
            contracting: contracting.to_vec(),
            cells,
            number: MADE.fetch_add(1, Ordering::Relaxed),
            entries: Entries::here(),
            elements: OnceLock::new(),
            at_rest: OnceLock::new(),
        })
    }

    /// Model of the tissue.
    pub fn tissue(&self) -> TissueModel {
        self.tissue
    }

    /// Coefficients in use.
    pub fn coefficients(&self) -> &Coefficients {
        &self.coefficients
    }

    /// Positions at rest, m, bones included.
    pub fn rest(&self) -> &[SVector<f64, D>] {
        &self.rest
    }

    /// Bone nodes that are carried away from where they are at rest, and where to, m.
    pub fn carried(&self) -> &[(usize, SVector<f64, D>)] {
        &self.carried
    }

    /// Nodes that bones hold.
    pub fn held(&self) -> Vec<usize> {
        let inner = self.paths.iter().flat_map(StraightPath::inner_nodes);
        let followers = self.continuum.iter().flat_map(|c| c.followers.iter().map(|f| f.node));
        let placed: Vec<usize> = inner.chain(followers).collect();
        let is_held = |n: &usize| self.pattern.unknown(*n).is_none() && !placed.contains(n);
        (0..self.rest.len()).filter(is_held).collect()
    }

    /// The effects that are simulated.
    pub fn effects(&self) -> &[Box<dyn Effect<D>>] {
        &self.effects
    }

    /// A number that tells this system from all others.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The functions that are compiled for this dimension.
    pub(crate) fn entries(&self) -> &Entries<D> {
        &self.entries
    }

    /// The effects as flat lists, if this is a plain body of the plane; made at the first call.
    pub(crate) fn elements(&self) -> Option<&Arc<Elements>> {
        let make = || {
            let is_small = !self.pattern.is_for_supernodes::<D>();
            is_small.then(|| Elements::new(self)).flatten().map(Arc::new)
        };
        self.elements.get_or_init(make).as_ref()
    }

    /// The linear response of the body at rest to its muscles; computed at the first call.
    pub(crate) fn at_rest(&self, make: impl FnOnce() -> Option<AtRest>) -> Option<&AtRest> {
        self.at_rest.get_or_init(make).as_ref()
    }

    /// Unknowns and sparsity.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Straight elements in place of chains outside the tissue.
    pub fn paths(&self) -> &[StraightPath] {
        &self.paths
    }

    /// Numbers of the muscles that can pull.
    pub fn contracting(&self) -> &[usize] {
        &self.contracting
    }

    /// Number of muscles of the mesh, contracting or not.
    pub fn muscle_count(&self) -> usize {
        self.muscle_ends.len()
    }

    /// End nodes of muscle number `muscle`.
    pub fn muscle_ends(&self, muscle: usize) -> [usize; 2] {
        self.muscle_ends[muscle]
    }

    /// Potential energy, J.
    pub fn energy(&self, at: Configuration<'_, D>) -> f64 {
        self.effects.iter().map(|e| e.energy(at)).sum()
    }

    /// Force on every node, N; on bone nodes minus the reaction of the bone.
    pub fn force(&self, at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        force.fill(SVector::zeros());
        self.effects.iter().for_each(|e| e.add_force(at, force));
    }

    /// Length of muscle `muscle`: the straight distance between its ends, m.
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
        self.cells.iter().fold((f64::INFINITY, 0.0), |(lo, hi): (f64, f64), (cell, rest)| {
            let ratio = cell_measure(positions, cell) / rest;
            (lo.min(ratio), hi.max(ratio))
        })
    }

    /// Nodes of all cells, one cell after another.
    pub(crate) fn cell_nodes(&self) -> impl Iterator<Item = usize> + '_ {
        self.cells.iter().flat_map(|(cell, _)| cell.iter().copied())
    }

    /// Area, m², or volume, m³, of all cells together.
    pub fn measure(&self, positions: &[SVector<f64, D>]) -> f64 {
        self.cells.iter().map(|(cell, _)| cell_measure(positions, cell)).sum()
    }

    /// Strain and stress of every cell at the given positions, m; empty unless the cells are finite
    /// elements. Stress in the muscle lines is not included.
    pub fn stresses(&self, positions: &[SVector<f64, D>]) -> Vec<Stress<D>> {
        let at = Configuration { positions, tensions: &[] };
        self.effects.iter().flat_map(|e| e.stresses(at)).collect()
    }

    /// Number of elements in which the barrier against inversion acts ([`crate::effect::barrier`]).
    pub fn guarded(&self, at: Configuration<'_, D>) -> usize {
        self.effects.iter().map(|e| e.guarded(at)).sum()
    }

    /// Whether an effect keeps every cell from turning over; springs alone do not.
    pub fn keeps_cells_upright(&self) -> bool {
        self.cells.is_empty() || self.effects.iter().any(|e| e.keeps_cells_upright())
    }

    /// Places the nodes that are not unknowns: inner nodes of straight paths go between the ends of their
    /// path, and nodes that follow a continuum go with it.
    pub fn place_path_nodes(&self, positions: &mut [SVector<f64, D>]) {
        self.paths.iter().for_each(|p| p.place(positions));
        self.continuum.iter().for_each(|c| c.place_followers(positions));
    }

    /// Computes the motion of the inner nodes of straight paths from that of their ends, at these positions.
    pub fn move_path_nodes(&self, positions: &[SVector<f64, D>], motion: &mut [SVector<f64, D>]) {
        self.paths.iter().for_each(|p| p.carry(positions, motion));
    }

    /// Moves the forces on nodes that follow a continuum to the nodes that they follow.
    pub fn carry_loads(&self, load: &mut [SVector<f64, D>]) {
        self.continuum.iter().for_each(|c| c.carry_loads(load));
    }

    /// Computes the motion of the nodes that follow a continuum from that of the unknowns.
    pub fn move_followers(&self, motion: &mut [SVector<f64, D>]) {
        self.continuum.iter().for_each(|c| c.move_followers(motion));
    }
}

/// Area, m², or volume, m³, of a triangle, tetrahedron or hexahedron.
fn cell_measure<const D: usize>(positions: &[SVector<f64, D>], cell: &[usize]) -> f64 {
    match <&[usize; hexahedron::CORNERS]>::try_from(cell) {
        Ok(corners) => {
            let place = |n: usize| Vector3::from_fn(|d, _| positions[n].get(d).copied().unwrap_or(0.0));
            hexahedron::volume(&corners.map(place))
        }
        Err(_) => simplex::measure(&simplex::corners(positions, cell)),
    }
}

/// The effects of a continuum: the tissue, the attachment to bones, and the muscles that contract.
fn continuum_effects<const D: usize>(
    mesh: &Mesh<D>,
    continuum: &Continuum<D>,
    model: &Model,
    coefficients: &Coefficients,
    contracting: &[usize],
) -> impl Iterator<Item = Box<dyn Effect<D>>> {
    let tissue = QuadraticElements::new(
        (&model.constants).into(),
        model.constants.viscosity,
        continuum.elements(),
        &mesh.nodes,
    );
    let (settings, (lambda, mu)) = (&continuum.settings, model.constants.lame());
    let upright = Upright::new(lambda, continuum.elements(), &mesh.nodes);
    let mut effects: Vec<Box<dyn Effect<D>>> = vec![Box::new(tissue), Box::new(upright)];
    if !continuum.ties.is_empty() {
        let stiffness = settings.patch_stiffness * mu / settings.patch_radius_m;
        effects.push(Box::new(Attachment::new(&continuum.ties, stiffness, &mesh.nodes)));
    }
    let contraction_time = coefficients.contractile_damping / coefficients.muscle_series_stiffness;
    // The barrier against collapsing strands is scaled by the force that the tissue bears over the width of
    // a muscle.
    let bar = mu * settings.bundle_width_m.max(LEAST_WIDTH_M).powi(D as i32 - 1);
    for &muscle in contracting {
        let bundle = &continuum.bundles[muscle];
        effects.push(Box::new(Fibres::new(muscle, bundle, &mesh.nodes, contraction_time, bar)));
    }
    effects.into_iter()
}

/// A node of a part of the body that is joined to no held node, if there is one.
fn loose_node(nodes: usize, cliques: &[Vec<usize>], is_unknown: &[bool], held: &[usize]) -> Option<usize> {
    let mut leader: Vec<usize> = (0..nodes).collect();
    fn find(leader: &mut [usize], mut i: usize) -> usize {
        while leader[i] != i {
            leader[i] = leader[leader[i]];
            i = leader[i];
        }
        i
    }
    for clique in cliques {
        for pair in clique.windows(2) {
            let (a, b) = (find(&mut leader, pair[0]), find(&mut leader, pair[1]));
            leader[a.max(b)] = a.min(b);
        }
    }
    let mut safe = vec![false; nodes];
    for &i in held {
        let l = find(&mut leader, i);
        safe[l] = true;
    }
    (0..nodes).find(|&i| is_unknown[i] && !safe[find(&mut leader, i)])
}
