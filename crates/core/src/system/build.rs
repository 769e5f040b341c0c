//! Construction of a system from a mesh and a model: the effects of its tissue and muscles, or an error.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use nalgebra::SVector;

use super::{
    Additions, Layout, Model, StraightPath, System, SystemError, TissueModel, cell_measure, coefficients,
    connection_stiffness, path,
};
use crate::body::{Continuum, Mesh};
use crate::effect::spring::Spring;
use crate::effect::{
    Attachment, Connections, Effect, Fibres, Incompressibility, OrientationBarrier, QuadraticElements,
};
use crate::geometry::topology::pair;
use crate::limits::{FACTOR_ENTRIES, PLANE_NODES};
use crate::material::Coefficients;
use crate::sparse::Pattern;

/// Smallest width of a muscle that scales the barrier of its strands, m.
const LEAST_WIDTH_M: f64 = 1e-3;

/// Number of systems made so far, which is the number of the next one.
static SYSTEM_COUNT: AtomicU64 = AtomicU64::new(0);

impl<const D: usize> System<D> {
    /// A system in which the muscles `contracting` (numbers into `mesh.muscles`) can contract. All other connections are tissue.
    pub fn new(mesh: &Mesh<D>, model: &Model, contracting: &[usize]) -> Result<Self, SystemError> {
        Self::with_additions(mesh, model, contracting, Additions::default())
    }

    /// A system with a scene's changes to the model.
    #[inline(never)]
    pub fn with_additions(
        mesh: &Mesh<D>,
        model: &Model,
        contracting: &[usize],
        mut additions: Additions<D>,
    ) -> Result<Self, SystemError> {
        mesh.check()?;
        if let Some(&muscle) = contracting.iter().find(|&&m| m >= mesh.muscles.len()) {
            let count = mesh.muscles.len();
            let message = format!("muscle number {muscle} does not exist; the mesh has {count} muscles");
            return Err(SystemError::Invalid(message));
        }
        mesh.check_size()?;
        let coefficients = coefficients(mesh, model)?;
        // At a Poisson's ratio of 1/4 kappa is a rounding error in place of zero.
        let rounding = 1e-12 * coefficients.tissue_stiffness * mesh.extent().powi(2);
        if let Some(continuum) = &mesh.continuum {
            let mut effects = continuum_effects(mesh, continuum, model, &coefficients, contracting);
            effects.append(&mut additions.effects);
            return Self::assemble(mesh, coefficients, effects, additions, Vec::new(), contracting);
        }
        if additions.incompressible && coefficients.kappa < -rounding {
            return Err(SystemError::Invalid(format!(
                "Poisson's ratio {} needs a negative coefficient of incompressibility ({:e} J), with which the energy has no minimum; \
                 springs alone already have 0.25, so give at least that, or take a continuum",
                model.poisson_ratio, coefficients.kappa
            )));
        }
        let stiffness = connection_stiffness(mesh, &coefficients);
        let paths = path::find(mesh, &stiffness);
        let mut effects = effects(mesh, contracting, &coefficients, &stiffness, &paths);
        // At a Poisson's ratio of 1/4 kappa is a rounding error of either sign.
        if !mesh.cells.is_empty() && additions.incompressible && coefficients.kappa > rounding {
            effects.push(Box::new(Incompressibility::new(coefficients.kappa, &mesh.cells, &mesh.nodes)));
        }
        effects.append(&mut additions.effects);
        Self::assemble(mesh, coefficients, effects, additions, paths, contracting)
    }

    /// A system of any effects on the nodes of `mesh`, without straight paths, for bodies that [`System::new`] cannot describe: uneven
    /// stiffness, other laws. `coefficients` do not change the effects.
    #[inline(never)]
    pub fn from_effects(
        mesh: &Mesh<D>,
        coefficients: Coefficients,
        effects: Vec<Box<dyn Effect<D>>>,
        contracting: &[usize],
    ) -> Result<Self, SystemError> {
        Self::assemble(mesh, coefficients, effects, Additions::default(), Vec::new(), contracting)
    }

    pub(super) fn assemble(
        mesh: &Mesh<D>,
        coefficients: Coefficients,
        mut effects: Vec<Box<dyn Effect<D>>>,
        additions: Additions<D>,
        paths: Vec<StraightPath>,
        contracting: &[usize],
    ) -> Result<Self, SystemError> {
        let mut rest = mesh.nodes.clone();
        // Parts outside the tissue that are bent in the mesh are straight at rest.
        paths.iter().filter(|p| p.is_bent).for_each(|p| p.place(&mut rest));
        let all = mesh.cells.iter().chain(mesh.hexahedra.iter().map(|corners| &corners[..]));
        let cells = all.map(|cell| (cell.to_vec(), cell_measure(&rest, cell))).collect();
        let mut held: BTreeMap<usize, SVector<f64, D>> = mesh.fixed.iter().map(|&n| (n, rest[n])).collect();
        for &(node, position) in &additions.displaced {
            *held.get_mut(&node).ok_or(SystemError::NotOnBone { node })? = position;
        }
        let mut is_unknown = vec![true; rest.len()];
        let followers = mesh.continuum.iter().flat_map(|c| c.followers.iter().map(|f| f.node));
        let placed = paths.iter().flat_map(StraightPath::inner_nodes).chain(followers);
        placed.chain(held.keys().copied()).for_each(|n| is_unknown[n] = false);
        let displaced = held.iter().map(|(&n, &x)| (n, x)).filter(|&(n, x)| x != rest[n]).collect();
        let mut stencils = Vec::new();
        for effect in &effects {
            effect.stencils(&mut |nodes| stencils.push(nodes.to_vec()));
        }
        let are_held = are_held(rest.len(), stencils.iter(), &mesh.fixed);
        if let Some(node) = (0..rest.len()).find(|&i| is_unknown[i] && !are_held[i]) {
            return Err(SystemError::Loose { node });
        }
        if D == 2 {
            PLANE_NODES.check(rest.len() as f64)?;
        }
        let known = additions.layout.filter(|l| l.is_unknown == is_unknown && l.stencils == stencils);
        let layout = known.unwrap_or_else(|| {
            let pattern = Pattern::new(rest.len(), &is_unknown, &stencils);
            Arc::new(Layout { is_unknown, stencils, pattern })
        });
        FACTOR_ENTRIES.check(layout.pattern.factor_entries::<D>() as f64)?;
        effects.iter_mut().for_each(|e| e.bind(&layout.pattern));
        Ok(Self {
            tissue: TissueModel::of(mesh),
            coefficients,
            rest,
            displaced,
            effects,
            layout,
            paths,
            continuum: mesh.continuum.clone(),
            muscle_ends: mesh.muscles.iter().map(|m| m.ends()).collect(),
            contracting: contracting.to_vec(),
            cells,
            number: SYSTEM_COUNT.fetch_add(1, Ordering::Relaxed),
            elements: OnceLock::new(),
            at_rest: OnceLock::new(),
        })
    }
}

/// The effects of a continuum: tissue, attachment to bones and contracting muscles.
fn continuum_effects<const D: usize>(
    mesh: &Mesh<D>,
    continuum: &Continuum<D>,
    model: &Model,
    coefficients: &Coefficients,
    contracting: &[usize],
) -> Vec<Box<dyn Effect<D>>> {
    let tissue = QuadraticElements::new(model.into(), model.viscosity, continuum.elements(), &mesh.nodes);
    let (settings, (lambda, mu)) = (&continuum.settings, model.lame());
    let upright = OrientationBarrier::new(lambda, continuum.elements(), &mesh.nodes);
    let mut effects: Vec<Box<dyn Effect<D>>> = vec![Box::new(tissue), Box::new(upright)];
    if !continuum.ties.is_empty() {
        let stiffness = settings.patch_stiffness * mu / settings.patch_radius_m;
        effects.push(Box::new(Attachment::new(&continuum.ties, stiffness, &mesh.nodes)));
    }
    let contraction_time = coefficients.contractile_damping / coefficients.muscle_series_stiffness;
    // The barrier of strands is scaled by the shear modulus times the width (in space: its square) of a muscle.
    let bar = mu * settings.bundle_width_m.max(LEAST_WIDTH_M).powi(D as i32 - 1);
    for &muscle in contracting {
        let bundle = &continuum.bundles[muscle];
        effects.push(Box::new(Fibres::new(muscle, bundle, &mesh.nodes, contraction_time, bar)));
    }
    effects
}

/// Whether each of `count` nodes is joined to a held one by cliques of nodes.
pub fn are_held(
    count: usize,
    cliques: impl Iterator<Item = impl AsRef<[usize]>>,
    held: &[usize],
) -> Vec<bool> {
    let mut leader: Vec<usize> = (0..count).collect();
    fn find(leader: &mut [usize], mut i: usize) -> usize {
        while leader[i] != i {
            leader[i] = leader[leader[i]];
            i = leader[i];
        }
        i
    }
    for clique in cliques {
        for pair in clique.as_ref().windows(2) {
            let (a, b) = (find(&mut leader, pair[0]), find(&mut leader, pair[1]));
            leader[a.max(b)] = a.min(b);
        }
    }
    let mut is_safe = vec![false; count];
    for &i in held {
        let l = find(&mut leader, i);
        is_safe[l] = true;
    }
    (0..count).map(|i| is_safe[find(&mut leader, i)]).collect()
}

/// The effects of the tissue and of the contracting muscles, in this order. `stiffness` has the spring constant of every connection, N/m.
pub(super) fn effects<const D: usize>(
    mesh: &Mesh<D>,
    contracting: &[usize],
    coefficients: &Coefficients,
    stiffness: &[f64],
    paths: &[StraightPath],
) -> Vec<Box<dyn Effect<D>>> {
    // Each connection is a spring of the contracting muscle along it, otherwise of the tissue. A straight path counts as one connection in
    // place of its chain.
    let mut in_path = vec![false; mesh.nodes.len()];
    paths.iter().flat_map(StraightPath::inner_nodes).for_each(|n| in_path[n] = true);
    let mut elements: BTreeMap<[usize; 2], (f64, f64)> = BTreeMap::new();
    for (&[a, b], &k) in mesh.connections.iter().zip(stiffness) {
        if !in_path[a] && !in_path[b] {
            elements.insert([a, b], (k, (mesh.nodes[b] - mesh.nodes[a]).norm()));
        }
    }
    for p in paths {
        let [a, b] = p.ends();
        elements.insert(pair(a, b), (p.stiffness(), p.rest_length()));
    }
    let mut effects: Vec<Box<dyn Effect<D>>> = Vec::new();
    let mut pulled: BTreeMap<[usize; 2], (f64, f64)> = BTreeMap::new();
    let parallel = coefficients.muscle_parallel_stiffness / coefficients.tissue_stiffness;
    let contraction_time = coefficients.contractile_damping / coefficients.muscle_series_stiffness;
    let in_series = coefficients.muscle_series_stiffness / coefficients.tissue_stiffness;
    for &muscle in contracting {
        let chain: Vec<usize> = mesh.muscles[muscle].nodes.iter().copied().filter(|&n| !in_path[n]).collect();
        let (mut springs, mut series) = (Vec::new(), Vec::new());
        for step in chain.windows(2) {
            let key = pair(step[0], step[1]);
            // A connection of two muscles has one parallel spring and a contractile branch for each.
            let (k, q1, l0) = match (elements.remove(&key), pulled.get(&key)) {
                (Some((k, l0)), _) => (k, k * parallel, l0),
                (None, Some(&(k, l0))) => (k, 0.0, l0),
                (None, None) => continue,
            };
            pulled.insert(key, (k, l0));
            springs.push(Spring::new(key, q1, l0));
            series.push(k * in_series);
        }
        effects.push(Box::new(Connections::muscle(muscle, springs, series, contraction_time)));
    }
    let retardation = coefficients.tissue_damping / coefficients.tissue_stiffness;
    let tissue = elements.into_iter().map(|(nodes, (k, l0))| Spring::new(nodes, k, l0)).collect();
    effects.insert(0, Box::new(Connections::tissue(tissue, retardation)));
    effects
}
