//! A body whose answers converge as its mesh is refined: quadratic elements, muscles of finite width, bones that hold patches.
//!
//! The displacement under a point load in a plane grows with the logarithm of one over the mesh spacing, so that tensions that are fitted
//! with lines as muscles and points as bones depend on the mesh. Here each muscle is a bundle of fibres over a width, cut at the
//! boundaries of the elements, and each bone holds a patch of the surface by springs. Widths, patches and their stiffness are chosen, not
//! measured ([`ContinuumSettings`]).

mod attach;
mod bundle;
pub mod locate;

use std::collections::BTreeMap;

use nalgebra::SVector;
use serde::Serialize;

use super::{BodyError, Cells, Mesh, MuscleChain};
use crate::geometry::quadratic;
use crate::geometry::topology::pair;
use crate::limits;
use bundle::MuscleCourse;
use locate::Locator;

const MOST_FIBRES: usize = 256;

/// Widths of muscles and attachment to bones. They are chosen, not measured, and never tuned on data for validation. `results/continuum`
/// has their effect on the answers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContinuumSettings {
    /// Width of a muscle, m; half of it at a bone. With 0 it is a line, for bodies whose muscles are given fibre by fibre.
    pub bundle_width_m: f64,
    /// Number of fibres over the width on meshes with a spacing of a third of the width or more; on finer ones at least three for each
    /// spacing.
    pub fibres: usize,
    /// Radius of the patch around a point of bone, m. With 0 the bone holds its node alone, which does not converge.
    pub patch_radius_m: f64,
    /// Stiffness of the patch: `k` in `κ = k μ/r (1 - d²/r²)²` at the distance `d` from the point.
    pub patch_stiffness: f64,
}

impl Default for ContinuumSettings {
    fn default() -> Self {
        Self { bundle_width_m: 6e-3, fibres: 9, patch_radius_m: 10e-3, patch_stiffness: 50.0 }
    }
}

impl std::fmt::Display for ContinuumSettings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "muscles {} mm wide; bones hold {} mm around their points with {} mu/r; chosen, not measured",
            1e3 * self.bundle_width_m,
            1e3 * self.patch_radius_m,
            self.patch_stiffness
        )
    }
}

impl ContinuumSettings {
    pub fn check(&self) -> Result<(), BodyError> {
        within("width of a muscle (m)", self.bundle_width_m, 0.0, 1.0)?;
        within("number of fibres of a muscle", self.fibres as f64, 1.0, MOST_FIBRES as f64)?;
        within("radius of a bone's patch (m)", self.patch_radius_m, 0.0, 1.0)?;
        within("stiffness of a bone's patch", self.patch_stiffness, 1e-6, 1e6)
    }
}

fn within(name: &str, value: f64, low: f64, high: f64) -> Result<(), BodyError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(BodyError(format!("the {name} is {value}; give {low} to {high}")))
    }
}

/// The data that make a [`Mesh`] a continuum, whose cells are then the linear parts of the elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuum<const D: usize> {
    pub settings: ContinuumSettings,
    /// Nodes of the elements, one after another ([`Continuum::elements`]).
    elements: Vec<usize>,
    /// Nodes that are no unknowns because they follow the tissue, such as ends and points of muscles, in ascending order.
    pub followers: Vec<Follower<D>>,
    /// The strands of every muscle of the mesh.
    pub bundles: Vec<Vec<Strand>>,
    /// The attachment to bones, for `μ/r · k = 1` N/m³.
    pub ties: Vec<Tie>,
}

impl<const D: usize> Continuum<D> {
    /// The nodes of each element: the corners, then the middles of [`quadratic::edges`].
    pub fn elements(&self) -> std::slice::ChunksExact<'_, usize> {
        self.elements.chunks_exact(quadratic::nodes::<D>())
    }

    /// For every cell the direction of the fibres in its element at these positions, of the first of several muscles.
    pub fn fibres(&self, positions: &[SVector<f64, D>]) -> Vec<Option<SVector<f64, D>>> {
        let mut along: BTreeMap<&[usize], (usize, SVector<f64, D>)> = BTreeMap::new();
        for (muscle, strands) in self.bundles.iter().enumerate() {
            for strand in strands {
                let y: SVector<f64, D> =
                    strand.nodes.iter().zip(&strand.coefficients).map(|(&n, c)| positions[n] * *c).sum();
                let (first, sum) = along.entry(&strand.nodes).or_insert((muscle, SVector::zeros()));
                if *first == muscle {
                    *sum += y * strand.weight;
                }
            }
        }
        let parts = quadratic::parts::<D>().len();
        let fibres =
            self.elements().map(|element| along.get(element).and_then(|(_, sum)| sum.try_normalize(0.0)));
        fibres.flat_map(|fibre| std::iter::repeat_n(fibre, parts)).collect()
    }

    pub fn place_followers(&self, positions: &mut [SVector<f64, D>]) {
        for f in &self.followers {
            positions[f.node] = f.offset + f.mean(positions);
        }
    }

    /// Computes velocities or other motions of the followers from those of the nodes.
    pub fn move_followers(&self, motion: &mut [SVector<f64, D>]) {
        for f in &self.followers {
            motion[f.node] = f.mean(motion);
        }
    }

    /// Moves the forces on followers to the nodes that they follow.
    pub fn carry_loads(&self, load: &mut [SVector<f64, D>]) {
        for f in &self.followers {
            let own = std::mem::replace(&mut load[f.node], SVector::zeros());
            f.weights.iter().for_each(|&(node, weight)| load[node] += own * weight);
        }
    }

    /// The continuum with another shape at rest, in which muscles and patches move with the tissue. `nodes` has the new positions of all
    /// nodes at rest, m, and gets those of the middles of edges; `before` has the old ones.
    pub fn moved(&self, before: &[SVector<f64, D>], nodes: &mut [SVector<f64, D>]) -> Self {
        for element in self.elements() {
            for (&[i, j], &middle) in quadratic::edges::<D>().iter().zip(&element[D + 1..]) {
                nodes[middle] = (nodes[element[i]] + nodes[element[j]]) * 0.5;
            }
        }
        let mut moved = self.clone();
        for tie in &mut moved.ties {
            // The stiffness of the attachment per area of the surface stays the same.
            let longer = attach::face_size(&tie.nodes, nodes) / attach::face_size(&tie.nodes, before);
            tie.form.iter_mut().for_each(|c| *c *= longer);
        }
        for f in &mut moved.followers {
            f.offset = nodes[f.node] - f.mean(nodes);
        }
        // Strands need no change: coefficients inversely and weights directly proportional to the length at rest would give the same
        // energy.
        moved
    }
}

/// A node that moves by the mean displacement of others.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower<const D: usize> {
    pub node: usize,
    /// The nodes that it follows, with weights whose sum is 1.
    pub weights: Vec<(usize, f64)>,
    /// Its position minus the mean at rest, m.
    pub offset: SVector<f64, D>,
}

impl<const D: usize> Follower<D> {
    fn mean(&self, of_nodes: &[SVector<f64, D>]) -> SVector<f64, D> {
        self.weights.iter().map(|&(node, weight)| of_nodes[node] * weight).sum()
    }
}

/// A part of a muscle that pulls along a vector `y = sum c_a x_a` of the positions of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Strand {
    pub nodes: Vec<usize>,
    /// The coefficient of each node: 1/m for a point of a fibre in the tissue, 1 for a part outside it.
    pub coefficients: Vec<f64>,
    /// Weight of the lengthening: m for a point of a fibre, 1 for a part outside the tissue.
    pub weight: f64,
}

/// A quadratic form in the positions of nodes of the tissue and of a bone.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    pub nodes: Vec<usize>,
    /// The symmetric matrix, row by row; m (in space m²), for a stiffness in N/m³.
    pub form: Vec<f64>,
}

/// For every fixed node of a mesh the nodes that replace it in the continuum, that with its position first.
pub type ReplacedBones = Vec<(usize, Vec<usize>)>;

/// Makes a mesh of linear cells a continuum: a node in the middle of every edge, a bundle of fibres along every muscle, and a patch around
/// every bone that is a point of the surface. Bones that hold whole edges (in space: faces) of the surface are unchanged. `lines` has the
/// courses of muscles, m, if the chains of the mesh do not give them.
#[inline(never)]
pub fn from_mesh<const D: usize>(
    base: &Mesh<D>,
    lines: Option<&[Vec<SVector<f64, D>>]>,
    settings: &ContinuumSettings,
) -> Result<(Mesh<D>, ReplacedBones), BodyError> {
    settings.check()?;
    if base.continuum.is_some() {
        return Err(BodyError("the mesh is a continuum already".to_owned()));
    }
    if base.cells.is_empty() {
        let message =
            "the mesh has no triangles or tetrahedra, so it cannot be a continuum; take --body springs";
        return Err(BodyError(message.to_owned()));
    }
    limits::CONTINUUM_ELEMENTS
        .check(base.cells.len() as f64)
        .map_err(|beyond| BodyError(beyond.to_string()))?;
    let (mut mesh, elements, number) = quadratic(base);
    let (bones, ties) = attach::bones(base, &mut mesh, &elements, &number, settings);
    let locator = Locator::new(&mesh.nodes, &elements);
    let edges = base.cells.edges();
    let spacing = edges.keys().map(|&edge| base.distance(edge)).sum::<f64>() / edges.len().max(1) as f64;
    // With elements smaller than the gaps between fibres, each fibre would be a load without width.
    let many = (3.0 * settings.bundle_width_m / spacing).ceil() as usize;
    let settings = &ContinuumSettings { fibres: settings.fibres.max(many.min(MOST_FIBRES)), ..*settings };
    let (mut followers, mut bundles, mut muscles) = (Vec::new(), Vec::new(), Vec::new());
    for (nth, chain) in base.muscles.iter().enumerate() {
        let course = match lines.and_then(|l| l.get(nth)) {
            Some(points) => points.clone(),
            None => chain.nodes.iter().map(|&n| base.nodes[n]).collect(),
        };
        let line = MuscleCourse::new(base, chain, course, &bones)?;
        bundles.push(line.strands(&locator, settings)?);
        let nodes = line.chain(&locator, &mut mesh.nodes, &mut followers, settings, spacing)?;
        muscles.push(MuscleChain { name: chain.name.clone(), nodes });
    }
    mesh.muscles = muscles;
    mesh.connect();
    let elements = elements.concat();
    let continuum = Continuum { settings: *settings, elements, followers, bundles, ties };
    mesh.continuum = Some(continuum.into());
    Ok((mesh, bones))
}

/// The tissue of a mesh with nodes in the middle of its edges: the mesh of its nodes and of the linear parts of the elements, the
/// elements, and the new number of every node in the tissue.
fn quadratic<const D: usize>(base: &Mesh<D>) -> (Mesh<D>, Vec<Vec<usize>>, Vec<Option<usize>>) {
    let mut nodes = Vec::new();
    let number: Vec<Option<usize>> =
        Vec::from_iter(base.in_tissue().iter().zip(&base.nodes).map(|(inside, at)| {
            inside.then(|| {
                nodes.push(*at);
                nodes.len() - 1
            })
        }));
    let mut middles: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let (mut elements, mut cells) = (Vec::new(), Cells::new());
    for cell in base.cells.iter() {
        let mut element: Vec<usize> = cell.iter().filter_map(|&n| number[n]).collect();
        for &[i, j] in quadratic::edges::<D>() {
            let [a, b] = pair(element[i], element[j]);
            element.push(*middles.entry([a, b]).or_insert_with(|| {
                nodes.push((nodes[a] + nodes[b]) * 0.5);
                nodes.len() - 1
            }));
        }
        for part in quadratic::parts::<D>() {
            let part: Vec<usize> = part.iter().map(|&i| element[i]).collect();
            cells.push(&part);
        }
        elements.push(element);
    }
    (Mesh { nodes, cells, ..Mesh::default() }, elements, number)
}
