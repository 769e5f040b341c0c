//! Tissue and muscles on the connections of a mesh.

use std::collections::BTreeMap;

use super::StraightPath;
use crate::body::Mesh;
use crate::effect::spring::Spring;
use crate::effect::{Connections, Effect};
use crate::geometry::topology::pair;
use crate::material::Coefficients;

/// The tissue and the contracting muscles, in this order. `stiffness` has the spring constant of every
/// connection, N/m.
pub(super) fn effects<const D: usize>(
    mesh: &Mesh<D>,
    contracting: &[usize],
    coefficients: &Coefficients,
    stiffness: &[f64],
    paths: &[StraightPath],
) -> Vec<Box<dyn Effect<D>>> {
    // Every connection, or straight path in place of several, goes to the contracting muscle that runs along
    // it, else to the tissue.
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
            // A connection that two muscles share keeps one parallel spring; each has its own contractile
            // branch.
            let (k, q1, l0) = match (elements.remove(&key), pulled.get(&key)) {
                (Some((k, l0)), _) => (k, k * parallel, l0),
                (None, Some(&(k, l0))) => (k, 0.0, l0),
                (None, None) => continue,
            };
            pulled.insert(key, (k, l0));
            springs.push(Spring::new(key, q1, l0));
            series.push(Spring::new(key, k * in_series, l0));
        }
        effects.push(Box::new(Connections::muscle(muscle, springs, series, contraction_time)));
    }
    let retardation = coefficients.tissue_damping / coefficients.tissue_stiffness;
    let tissue = elements.into_iter().map(|(nodes, (k, l0))| Spring::new(nodes, k, l0)).collect();
    effects.insert(0, Box::new(Connections::tissue(tissue, retardation)));
    effects
}
