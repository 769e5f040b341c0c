//! Attachment of the tissue to bones: a patch of the surface around each point of bone.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::SVector;

use super::{ContinuumSettings, ReplacedBones, Tie};
use crate::body::Mesh;
use crate::geometry::quadratic::{self, gauss_legendre};
use crate::geometry::simplex::{self, MAX_CORNERS};
use crate::geometry::topology;
use crate::statistics::least_by;

/// Number of pieces of a surface edge, and of Gauss points on each piece. Pieces are needed because a patch may end within a surface edge.
const PIECES: usize = 8;
const POINTS: usize = 6;

/// Adds the bones of `base` to the nodes of `mesh`, which has these elements; `number` has the new numbers of the nodes of `base`.
pub(super) fn bones<const D: usize>(
    base: &Mesh<D>,
    mesh: &mut Mesh<D>,
    elements: &[Vec<usize>],
    number: &[Option<usize>],
    settings: &ContinuumSettings,
) -> (ReplacedBones, Vec<Tie>) {
    let faces = topology::surface(elements.iter().map(|element| &element[..=D]));
    let fixed: BTreeSet<usize> = base.fixed.iter().filter_map(|&n| number[n]).collect();
    let mut held: BTreeSet<usize> = BTreeSet::new();
    for (_, &[element, opposite]) in
        faces.iter().filter(|(corners, _)| corners.iter().all(|n| fixed.contains(n)))
    {
        held.extend(on_face::<D>(opposite).map(|i| elements[element][i]));
    }
    // Bones within the tissue, and all bones if patches have no extent, hold their node.
    let surface_nodes: BTreeSet<usize> = faces.keys().flatten().copied().collect();
    let is_centre =
        |n: &usize| !held.contains(n) && surface_nodes.contains(n) && settings.patch_radius_m > 0.0;
    let centres: Vec<usize> = fixed.iter().copied().filter(is_centre).collect();
    held.extend(fixed.iter().filter(|n| !centres.contains(n)));

    let mut patches = Patches { mesh, copies: BTreeMap::new(), ties: Vec::new() };
    for &centre in &centres {
        patches.copy(centre, centre);
    }
    for &[element, opposite] in faces.values() {
        patches.tie(&elements[element], opposite, &centres, settings.patch_radius_m);
    }
    let Patches { copies, ties, .. } = patches;
    mesh.fixed = held.iter().copied().chain(copies.values().copied()).collect();
    let mut replacements = Vec::new();
    for &bone in &base.fixed {
        let nodes = match number[bone] {
            Some(n) if centres.contains(&n) => {
                let own = copies[&(n, n)];
                let others = copies.iter().filter(|((centre, _), copy)| *centre == n && **copy != own);
                std::iter::once(own).chain(others.map(|(_, copy)| *copy)).collect()
            }
            Some(n) => vec![n],
            None => {
                mesh.nodes.push(base.nodes[bone]);
                mesh.fixed.push(mesh.nodes.len() - 1);
                vec![mesh.nodes.len() - 1]
            }
        };
        replacements.push((bone, nodes));
    }
    mesh.fixed.sort_unstable();
    (replacements, ties)
}

/// The places in an element's list of the nodes on the face opposite to a corner, its `D` corners first.
fn on_face<const D: usize>(opposite: usize) -> impl Iterator<Item = usize> {
    let corners = (0..=D).filter(move |&i| i != opposite);
    let middles = quadratic::edges::<D>().iter().enumerate();
    let middles = middles.filter(move |(_, edge)| !edge.contains(&opposite)).map(|(n, _)| D + 1 + n);
    corners.chain(middles)
}

struct Patches<'a, const D: usize> {
    mesh: &'a mut Mesh<D>,
    /// The node of the bone that was added at a node of the surface, by the centre of the patch and that node.
    copies: BTreeMap<(usize, usize), usize>,
    ties: Vec<Tie>,
}

impl<const D: usize> Patches<'_, D> {
    fn copy(&mut self, centre: usize, node: usize) -> usize {
        *self.copies.entry((centre, node)).or_insert_with(|| {
            self.mesh.nodes.push(self.mesh.nodes[node]);
            self.mesh.nodes.len() - 1
        })
    }

    /// Ties the face of an element that is opposite to one of its corners to the centres within the radius, each place to the nearest
    /// centre.
    fn tie(&mut self, element: &[usize], opposite: usize, centres: &[usize], radius: f64) {
        let corners = simplex::corners(&self.mesh.nodes, &element[..=D]);
        let on_face: Vec<usize> = on_face::<D>(opposite).collect();
        let nodes: Vec<usize> = on_face.iter().map(|&i| element[i]).collect();
        let mut forms: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        let measure = face_size(&nodes, &self.mesh.nodes);
        let size = nodes.len() + D;
        for (at, share) in face_points::<D>(opposite) {
            let place: SVector<f64, D> = corners.iter().zip(at).map(|(x, l)| x * l).sum();
            let away = |c: &usize| (self.mesh.nodes[*c] - place).norm();
            let nearest = least_by(centres.iter().copied(), away);
            let Some(centre) = nearest.filter(|c| away(c) < radius) else { continue };
            let profile = (1.0 - (away(&centre) / radius).powi(2)).powi(2);
            // The displacement of the tissue minus that of the bone at the place.
            let shapes = quadratic::values::<D>(&at);
            let tissue = on_face.iter().map(|&i| shapes[i]);
            let bone = on_face[..D].iter().map(|&i| -at[i]);
            let gap: Vec<f64> = tissue.chain(bone).collect();
            let form = forms.entry(centre).or_insert_with(|| vec![0.0; size * size]);
            for (row, a) in form.chunks_exact_mut(size).zip(&gap) {
                row.iter_mut().zip(&gap).for_each(|(c, b)| *c += profile * share * measure * a * b);
            }
        }
        for (centre, form) in forms {
            let on_bone = nodes[..D].iter().map(|&node| self.copy(centre, node));
            let nodes = nodes.iter().copied().chain(on_bone).collect();
            self.ties.push(Tie { nodes, form });
        }
    }
}

/// Length of an edge, m, or area of a triangle, m²: the face of a [`Tie`] with nodes at these positions, m.
pub(super) fn face_size<const D: usize>(tie: &[usize], positions: &[SVector<f64, D>]) -> f64 {
    let a = positions[tie[1]] - positions[tie[0]];
    if D == 2 {
        return a.norm();
    }
    let b = positions[tie[2]] - positions[tie[0]];
    0.5 * (a.norm_squared() * b.norm_squared() - a.dot(&b).powi(2)).max(0.0).sqrt()
}

/// Barycentric coordinates of integration points on a face, and their shares of it.
fn face_points<const D: usize>(opposite: usize) -> Vec<([f64; MAX_CORNERS], f64)> {
    let corners: Vec<usize> = (0..=D).filter(|&i| i != opposite).collect();
    let mut points = Vec::new();
    let n = PIECES as f64;
    let mut add = |parts: &[f64], share: f64| {
        let mut at = [0.0; MAX_CORNERS];
        corners.iter().zip(parts).for_each(|(&i, part)| at[i] = *part);
        points.push((at, share));
    };
    if D == 2 {
        for piece in 0..PIECES {
            for (x, w) in gauss_legendre(POINTS) {
                let t = (piece as f64 + 0.5 * (1.0 + x)) / n;
                add(&[1.0 - t, t], 0.5 * w / n);
            }
        }
        return points;
    }
    // The triangle is divided into PIECES² similar ones, half of them reversed, with three points each.
    for i in 0..PIECES {
        for j in 0..PIECES - i {
            for turned in [false, true] {
                if turned && i + j + 1 == PIECES {
                    continue;
                }
                for at in quadratic::points::<2>() {
                    let (s, t) = if turned { (1.0 - at[0], 1.0 - at[1]) } else { (at[0], at[1]) };
                    let (u, v) = ((i as f64 + s) / n, (j as f64 + t) / n);
                    add(&[u, v, 1.0 - u - v], 1.0 / (3.0 * n * n));
                }
            }
        }
    }
    points
}
