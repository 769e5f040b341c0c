//! The left half of a symmetric body.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::{Directions, Segment, Side};
use crate::body::mesh::sorted;
use crate::body::{Body, MuscleChain};
use crate::statistics::least_by;

/// Nodes are mirror images to this part of the body's size. Meshes that were made by hand are not exactly symmetric (ArtiSynth's to 4 µm,
/// its styloid processes to 90 µm).
const IMAGE_TOLERANCE: f64 = 1e-3;
/// A muscle is asymmetric if it has a node whose image is farther off than this part of the body's size.
const SYMMETRIC_TOLERANCE: f64 = 1e-4;

/// Largest difference of the mean products of coordinates of fibres whose directions are the same, about 15 degrees.
const DIRECTION_TOLERANCE: f64 = 0.35;

/// The left half of a symmetric body, with the data that give the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Half {
    /// The half: nodes with y not above zero, left muscles, and the left parts of middle ones.
    pub body: Body<3>,
    /// Nodes of the half on the plane y = 0.
    pub plane: Vec<usize>,
    /// For each node of the whole its position at rest, m, the corresponding node of the half, and whether the node is the image of that.
    of_node: Vec<(Vector3<f64>, usize, bool)>,
    /// Number in the whole of each node of the half.
    pub nodes: Vec<usize>,
    /// For each muscle of the half the number of that muscle in the whole.
    pub muscles: Vec<usize>,
    /// For each muscle of the whole the corresponding muscle of the half.
    half_muscle: Vec<usize>,
    /// For each muscle of the whole whether it is asymmetric.
    asymmetric: Vec<bool>,
}

impl Half {
    /// Positions of the whole from those of the half, m.
    pub fn positions_of_whole(&self, positions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        Vec::from_iter(self.of_node.iter().map(|&(rest, n, is_image)| {
            let by = positions[n] - self.body.mesh.nodes[n];
            rest + if is_image { Vector3::new(by.x, -by.y, by.z) } else { by }
        }))
    }

    /// The node of the half that corresponds to a node of the whole, and the place that corresponds to `place`, m.
    pub fn place_on_half(&self, node: usize, place: &Vector3<f64>) -> Option<(usize, Vector3<f64>)> {
        let &(rest, of_half, is_image) = self.of_node.get(node)?;
        let by = place - rest;
        let by = if is_image { Vector3::new(by.x, -by.y, by.z) } else { by };
        Some((of_half, self.body.mesh.nodes[of_half] + by))
    }

    /// Activations of the muscles of the half, if those of the whole are symmetric and no asymmetric muscle is active.
    pub fn activations(&self, whole: &[f64]) -> Option<Vec<f64>> {
        if self.asymmetric.iter().zip(whole).any(|(asymmetric, a)| *asymmetric && *a != 0.0) {
            return None;
        }
        let same = self.half_muscle.iter().zip(whole).all(|(&m, a)| whole[self.muscles[m]] == *a);
        same.then(|| self.muscles.iter().map(|&m| whole[m]).collect())
    }
}

impl Body<3> {
    /// The left half of a body whose nodes, elements, bones and muscles, with their strengths, are symmetric; `None` for other bodies.
    pub fn half(&self) -> Option<Half> {
        // The tissue may differ between the sides.
        if !self.factors.is_empty() {
            return None;
        }
        let nodes = &self.mesh.nodes;
        let size = self.mesh.extent();
        let image = images(nodes, IMAGE_TOLERANCE * size)?;
        let is_on_plane = |n: usize| image[n] == n;
        let off = |n: usize| (nodes[image[n]] - Vector3::new(nodes[n].x, -nodes[n].y, nodes[n].z)).norm();
        let is_asymmetric = |s: &Segment| s.nodes.iter().any(|&n| off(n) > SYMMETRIC_TOLERANCE * size);
        let asymmetric = self.muscles.iter().map(|m| m.segments.iter().any(is_asymmetric)).collect();
        let mut number = vec![None; nodes.len()];
        let mut body = Body { what: format!("the left half of {}", self.what), ..Body::default() };
        let mut plane = Vec::new();
        for (n, x) in nodes.iter().enumerate().filter(|(n, _)| is_on_plane(*n) || nodes[*n].y < 0.0) {
            number[n] = Some(body.mesh.nodes.len());
            if is_on_plane(n) {
                plane.push(body.mesh.nodes.len());
            }
            body.mesh.nodes.push(*x);
        }
        let of_node = (0..nodes.len())
            .map(|n| Some((nodes[n], number[n].or(number[image[n]])?, number[n].is_none())))
            .collect::<Option<Vec<_>>>()?;
        let kept_nodes = (0..nodes.len()).filter(|&n| number[n].is_some()).collect();
        body.tip_node = self.tip_node.and_then(|n| number[n]);
        // The elements of the half are those without a node on the right; every other one must be the image of one of them.
        let mut element_number = vec![None; self.mesh.hexahedra.len()];
        for (e, corners) in self.mesh.hexahedra.iter().enumerate() {
            if let Some(all) = corners.iter().map(|&n| number[n]).collect::<Option<Vec<_>>>() {
                element_number[e] = Some(body.mesh.hexahedra.len());
                body.mesh.hexahedra.push(<[usize; 8]>::try_from(all).ok()?);
            }
        }
        let by_corners: BTreeMap<[usize; 8], usize> =
            self.mesh.hexahedra.iter().enumerate().map(|(e, corners)| (sorted(*corners), e)).collect();
        let image_of = |e: usize| by_corners.get(&sorted(self.mesh.hexahedra[e].map(|n| image[n])));
        let mut right = (0..element_number.len()).filter(|&e| element_number[e].is_none());
        if !right.all(|e| image_of(e).is_some_and(|&i| element_number[i].is_some()))
            || self.mesh.hexahedra.len() != 2 * body.mesh.hexahedra.len()
        {
            return None;
        }
        // Whether a muscle is the image of another one, or of itself, by the elements of its region and their directions.
        let mirrors = |muscle: usize, other: usize| {
            let (own, region) = (&self.muscles[muscle].region, &self.muscles[other].region);
            own.len() == region.len()
                && own.iter().all(|&e| {
                    let image = image_of(e).filter(|i| region.binary_search(i).is_ok());
                    image.is_some_and(|&i| are_alike(&self.directions(muscle, e), &self.directions(other, i)))
                })
        };
        if !self.mesh.fixed.iter().all(|&n| self.mesh.fixed.binary_search(&image[n]).is_ok()) {
            return None;
        }
        body.mesh.fixed = self.mesh.fixed.iter().filter_map(|&n| number[n]).collect();
        body.bones = self.bones.clone();
        for bone in &mut body.bones {
            bone.nodes = bone.nodes.iter().filter_map(|&n| number[n]).collect();
        }
        let (mut muscles, mut half_muscle) = (Vec::new(), Vec::new());
        for (m, muscle) in self.muscles.iter().enumerate() {
            if muscle.side != Side::Right {
                if muscle.side == Side::Middle && !mirrors(m, m) {
                    return None;
                }
                half_muscle.push(muscles.len());
                muscles.push(m);
                continue;
            }
            let other = self.muscles.iter().position(|o| o.side == Side::Left && o.group == muscle.group)?;
            let left = &self.muscles[other];
            let strongest = left.stress_pa.abs().max(muscle.stress_pa.abs());
            let as_many = left.segments.len() == muscle.segments.len();
            let as_strong = (left.stress_pa - muscle.stress_pa).abs() <= 1e-3 * strongest;
            if !as_many || !as_strong || !mirrors(m, other) {
                return None;
            }
            half_muscle.push(muscles.iter().position(|&l| l == other)?);
        }
        for &m in &muscles {
            let mut muscle = self.muscles[m].clone();
            // Directions near the plane depend on fibres of the other side too.
            let in_half = muscle.region.iter().filter(|&&e| element_number[e].is_some());
            muscle.directions = in_half.map(|&e| self.directions(m, e)).collect();
            muscle.region = muscle.region.iter().filter_map(|&e| element_number[e]).collect();
            let segments = muscle.segments.iter().filter_map(|s| {
                let [a, b] = [number[s.nodes[0]]?, number[s.nodes[1]]?];
                // One half of a middle muscle's fibre on the plane belongs to each side; each muscle of a pair has its own fibre.
                let shared = s.nodes.iter().all(|&n| is_on_plane(n)) && muscle.side == Side::Middle;
                let force_n = if shared { 0.5 * s.force_n } else { s.force_n };
                Some(Segment { nodes: [a, b], force_n, ..*s })
            });
            muscle.segments = segments.collect();
            let chain = self.mesh.muscles[m].clone();
            // The image measures a fibre of the other side.
            let nodes: Vec<usize> =
                chain.nodes.iter().filter_map(|&n| number[n].or(number[image[n]])).collect();
            body.mesh.muscles.push(MuscleChain { nodes, ..chain });
            body.muscles.push(muscle);
        }
        body.lines = self.lines.clone();
        for end in body.lines.iter_mut().flat_map(|(_, line)| &mut line.ends) {
            for (node, _) in &mut end.weights {
                *node = number[*node]?;
            }
        }
        body.mesh.connect();
        Some(Half { body, plane, of_node, nodes: kept_nodes, muscles, half_muscle, asymmetric })
    }
}

/// Whether the mean direction of fibres is the image of another, up to its sign; elements without fibres are alike.
fn are_alike(own: &Directions, other: &Directions) -> bool {
    (mean_product(own, -1.0) - mean_product(other, 1.0)).norm() < DIRECTION_TOLERANCE
}

/// The mean of the products of coordinates of directions, since the sign of a fibre has no meaning; `y` multiplies the second coordinate.
fn mean_product(all: &Directions, y: f64) -> Matrix3<f64> {
    let mirrored = all.iter().flatten().map(|d| Vector3::new(d.x, y * d.y, d.z));
    mirrored.map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / all.len() as f64
}

/// For each node its image, which is the node itself on the plane; `None` if a node has no image.
fn images(nodes: &[Vector3<f64>], near: f64) -> Option<Vec<usize>> {
    let mut by_x: Vec<usize> = (0..nodes.len()).collect();
    by_x.sort_by(|&a, &b| nodes[a].x.total_cmp(&nodes[b].x));
    let images = (0..nodes.len()).map(|n| {
        let wanted = Vector3::new(nodes[n].x, -nodes[n].y, nodes[n].z);
        let first = by_x.partition_point(|&m| nodes[m].x < wanted.x - near);
        let candidates = by_x[first..].iter().take_while(|&&m| nodes[m].x <= wanted.x + near);
        let away = |m: &usize| (nodes[*m] - wanted).norm();
        least_by(candidates.copied(), away).filter(|m| away(m) <= near)
    });
    images.collect()
}
