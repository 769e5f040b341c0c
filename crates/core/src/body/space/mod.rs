//! A tongue in space: hexahedra, and muscles as regions with the directions of their fibres.
//!
//! Activations are from 0 to 1. A body has the strength of a muscle at 1 in two forms: the force of each segment of its fibres, N, for
//! lines between nodes, and the stress along the fibres of its region, Pa.

mod built_in;
mod half;
mod surgery;

use std::collections::BTreeMap;

use nalgebra::{Matrix3, SVector, SymmetricEigen, Vector2, Vector3};

use super::mesh::sorted;
use super::{Body, BodyError, Bone, MANDIBLE, Mesh};
use crate::choice;
use crate::geometry::hexahedron::{self, in_space};
use crate::statistics::{distinct, least_by};

pub use half::Half;
pub use surgery::{Filling, Operated, Region};

/// The side of the midsagittal plane on which a muscle lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The speaker's left, y below zero.
    Left,
    /// The speaker's right, y above zero.
    Right,
    /// A single muscle in the middle.
    Middle,
}

/// A part of a fibre between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    pub nodes: [usize; 2],
    /// Force of the segment as a line at full activation, N.
    pub force_n: f64,
    /// Whether it is outside the tissue, between the tissue and a bone.
    pub outside: bool,
}

/// A muscle of a body of hexahedra, with its fibres and its region.
#[derive(Debug, Clone, PartialEq)]
pub struct Muscle {
    /// Name with its side, such as `GGP_L`.
    pub name: String,
    /// Name of both sides, such as `GGP`.
    pub group: String,
    pub side: Side,
    /// Its fibres, cut at the nodes.
    pub segments: Vec<Segment>,
    /// Numbers of the elements that it runs through, ascending.
    pub region: Vec<usize>,
    /// Stress along the fibres of its region at full activation, Pa.
    pub stress_pa: f64,
    /// Unit directions of its fibres at the Gauss points of each element of its region; empty if they follow from its segments.
    pub directions: Vec<Directions>,
}

/// Directions at the Gauss points of an element; `None` far from every fibre.
pub type Directions = [Option<Vector3<f64>>; hexahedron::POINTS];

impl<const D: usize> Body<D> {
    /// Whether its muscles have regions and activations from 0 to 1, instead of chains and tensions.
    pub fn is_activated(&self) -> bool {
        !self.mesh.hexahedra.is_empty()
    }

    /// Half of the straight fibre of a muscle through the middle of an element, in local coordinates; it ends at the nearest face. `None`
    /// if the muscle has no direction there.
    pub fn local_fibre(&self, muscle: usize, element: usize) -> Option<Vector3<f64>> {
        let x = hexahedron::corners(&self.mesh.nodes, &self.mesh.hexahedra[element]);
        let mean = mean_axis(self.directions(muscle, element).into_iter().flatten());
        let local = hexahedron::jacobian(&x, [0.0; 3]).try_inverse()? * mean;
        (local.amax() > 0.0).then(|| local / local.amax())
    }

    /// Unit directions of the fibres of a muscle at the Gauss points of an element; `None` far from every fibre.
    pub fn directions(&self, muscle: usize, element: usize) -> Directions {
        let given = &self.muscles[muscle];
        let place = given.region.binary_search(&element).ok();
        if let Some(directions) = place.and_then(|place| given.directions.get(place)) {
            return *directions;
        }
        let Mesh { nodes, hexahedra, .. } = &self.mesh;
        let inside = given.segments.iter().filter(|s| !s.outside);
        let lines: Vec<_> = inside.map(|s| s.nodes.map(|n| in_space(&nodes[n]))).collect();
        directions_along(&lines, &hexahedron::corners(nodes, &hexahedra[element]))
    }

    /// The node at the tip: [`Body::tip_node`], or else the foremost of the midsagittal plane.
    pub fn tip(&self) -> Option<usize> {
        let (nodes, near) = (&self.mesh.nodes, 1e-6 * self.mesh.extent());
        let in_plane = (0..nodes.len()).filter(|&n| nodes[n][1].abs() <= near);
        self.tip_node.or_else(|| least_by(in_plane, |&n| nodes[n][0]))
    }

    /// The names of the muscles without their sides, each once, in the order of the body.
    pub fn groups(&self) -> Vec<String> {
        distinct(self.muscles.iter().map(|m| m.group.clone()))
    }

    /// The active muscles with their activations; both sides by their common name if their activations are equal.
    pub fn active(&self, activations: &[f64]) -> Vec<(String, f64)> {
        let all = self.muscles.iter().zip(activations).filter(|(_, a)| **a > 0.0);
        distinct(all.map(|(m, a)| {
            let mut others = self.muscles.iter().zip(activations).filter(|(other, _)| other.group == m.group);
            let is_alike = others.all(|(_, other)| other == a);
            (if is_alike { m.group.clone() } else { m.name.clone() }, *a)
        }))
    }

    /// The numbers of the muscles with a name, that of one side or of both, without regard to case.
    pub fn both_sides(&self, name: &str) -> Result<Vec<usize>, BodyError> {
        let numbers = 0..self.muscles.len();
        let mut found: Vec<usize> =
            numbers.clone().filter(|&m| self.muscles[m].name.eq_ignore_ascii_case(name)).collect();
        if found.is_empty() {
            found.extend(numbers.filter(|&m| self.muscles[m].group.eq_ignore_ascii_case(name)));
        }
        if !found.is_empty() {
            return Ok(found);
        }
        let known = self.groups();
        let hint = choice::hint(name, known.iter().map(String::as_str));
        Err(BodyError(format!("there is no muscle \"{name}\" in this body; {hint}")))
    }

    /// Activations of all muscles from those given by name; all others are 0.
    pub fn activations<N: AsRef<str>>(&self, given: &[(N, f64)]) -> Result<Vec<f64>, BodyError> {
        let mut all = vec![None; self.muscles.len()];
        for (name, value) in given {
            let name = name.as_ref();
            if !(0.0..=1.0).contains(value) {
                let message = format!("the activation of {name} is {value}; it must lie between 0 and 1");
                return Err(BodyError(message));
            }
            for m in self.both_sides(name)? {
                if all[m].replace(*value).is_some() {
                    let name = &self.muscles[m].name;
                    return Err(BodyError(format!("the activation of {name} is given twice; give it once")));
                }
            }
        }
        Ok(all.into_iter().map(|a| a.unwrap_or(0.0)).collect())
    }

    /// The smallest and the largest ratio of volume to that at rest at the Gauss points of all elements.
    pub fn volume_ratios(&self, positions: &[SVector<f64, D>]) -> [f64; 2] {
        let ratios = self.mesh.hexahedra.iter().flat_map(|corners| {
            hexahedron::points().map(|at| {
                let [here, at_rest] = [positions, &self.mesh.nodes].map(|nodes| {
                    hexahedron::jacobian(&hexahedron::corners(nodes, corners), at).determinant()
                });
                here / at_rest
            })
        });
        ratios.fold([f64::INFINITY, 0.0], |[least, most], ratio| [least.min(ratio), most.max(ratio)])
    }
}

impl Body<3> {
    pub fn check(&self) -> Result<(), BodyError> {
        let Mesh { nodes, hexahedra, fixed, .. } = &self.mesh;
        for (number, corners) in hexahedra.iter().enumerate() {
            let element = number + 1;
            if let Some(&node) = corners.iter().find(|&&n| n >= nodes.len()) {
                let (node, count) = (node + 1, nodes.len());
                return Err(BodyError(format!(
                    "element {element} refers to node {node}, but there are {count} nodes (numbered from 1 here)"
                )));
            }
            let x = hexahedron::corners(nodes, corners);
            let mut points = hexahedron::points().into_iter();
            if !points.all(|at| hexahedron::jacobian(&x, at).determinant() > 0.0) {
                return Err(BodyError(format!(
                    "element {element} (from 1) is turned inside out or flat at one of its points; list its corners around \
                     the bottom and then around the top, or repair the mesh"
                )));
            }
        }
        for m in &self.muscles {
            for (what, is_empty) in [("fibres", m.segments.is_empty()), ("elements", m.region.is_empty())] {
                if is_empty {
                    let todo = "so nothing can contract; give it some, or leave the muscle out";
                    return Err(BodyError(format!("muscle {} has no {what}, {todo}", m.name)));
                }
            }
            if let Some(s) = m.segments.iter().find(|s| nodes[s.nodes[0]] == nodes[s.nodes[1]]) {
                let ([a, b], name) = (s.nodes.map(|n| n + 1), &m.name);
                return Err(BodyError(format!(
                    "a fibre of muscle {name} has two nodes at one place (nodes {a} and {b}, from 1)"
                )));
            }
        }
        let free = "no node is on bone, so the body could move freely; say which nodes are attached";
        if fixed.is_empty() { Err(BodyError(free.to_owned())) } else { Ok(()) }
    }

    /// The body in the axes of scenes: x backwards, y upwards, z to the left of the speaker; without lines.
    pub fn in_scene(mut self) -> Self {
        self.lines.clear();
        let directions = self.muscles.iter_mut().flat_map(|m| &mut m.directions).flatten().flatten();
        let vectors = self.mesh.nodes.iter_mut().chain(directions);
        vectors.for_each(|v| *v = Vector3::new(v.x, v.z, -v.y));
        let bones = self.bones_of_the_plane();
        Self { bones, ..self }
    }

    /// The faces of hexahedra that lie in the midsagittal plane, each once.
    pub fn midsagittal(&self) -> Vec<[usize; 4]> {
        let (nodes, near) = (&self.mesh.nodes, 1e-6 * self.mesh.extent());
        let faces = self.mesh.hexahedra.iter().flat_map(|c| hexahedron::FACES.map(|f| f.map(|i| c[i])));
        let in_plane = faces.filter(|f| f.iter().all(|&n| nodes[n].y.abs() <= near));
        in_plane.map(|f| (sorted(f), f)).collect::<BTreeMap<_, _>>().into_values().collect()
    }

    /// The faces of [`Self::midsagittal`] as triangles in the plane (x backwards, y upwards), with the numbers of nodes of this body.
    pub fn midsagittal_mesh(&self) -> Mesh<2> {
        let nodes: Vec<Vector2<f64>> = self.mesh.nodes.iter().map(|p| Vector2::new(p.x, p.z)).collect();
        let mut mesh = Mesh { nodes, ..Mesh::default() };
        for [a, b, c, d] in self.midsagittal() {
            let (across, other) = (mesh.nodes[c] - mesh.nodes[a], mesh.nodes[d] - mesh.nodes[b]);
            let [a, b, c, d] = if across.perp(&other) > 0.0 { [a, b, c, d] } else { [d, c, b, a] };
            mesh.cells.push(&[a, b, c]);
            mesh.cells.push(&[a, c, d]);
        }
        mesh.connect();
        mesh
    }

    /// The midsagittal section as a body in the plane, with the bones that lie in it under their names there.
    pub fn section(&self) -> Body<2> {
        let mesh = Mesh { fixed: self.mesh.fixed.clone(), ..self.midsagittal_mesh() };
        let near = 1e-6 * self.mesh.extent();
        let mut bones = self.bones_of_the_plane();
        bones.iter_mut().for_each(|b| b.nodes.retain(|&n| self.mesh.nodes[n].y.abs() <= near));
        bones.retain(|b| !b.nodes.is_empty());
        Body { what: self.what.clone(), mesh, bones, ..Body::default() }
    }

    fn bones_of_the_plane(&self) -> Vec<Bone> {
        let mut bones = self.bones.clone();
        bones.iter_mut().filter(|b| b.name == "mandible").for_each(|b| b.name = MANDIBLE.to_owned());
        bones
    }
}

/// The sum of directions of fibres, whose signs have no meaning: each gets the sign for which it adds to the sum of those before it.
pub fn mean_axis(directions: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    directions.fold(Vector3::zeros(), |sum, d| if d.dot(&sum) < 0.0 { sum - d } else { sum + d })
}

/// Smallest distance from the middle of a segment, over its length, in the weight of the segment.
const LEAST_DISTANCE: f64 = 0.05;

/// Directions of fibres that follow these lines, m, at the Gauss points of an element with these corners, m.
pub fn directions_along(
    lines: &[[Vector3<f64>; 2]],
    corners: &hexahedron::PerCorner<Vector3<f64>>,
) -> Directions {
    hexahedron::points().map(|at| {
        let place = corners.iter().zip(hexahedron::values(at)).map(|(x, n)| x * n).sum();
        direction_at(lines, &place)
    })
}

/// The direction at a place: the eigenvector of the largest eigenvalue of `sum L d dᵀ / r⁴` over the lines, each with its length `L`, its
/// direction `d` and the distance `r` of its middle from the place. `None` without lines, or if a line has no length.
fn direction_at(lines: &[[Vector3<f64>; 2]], place: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut sum = Matrix3::zeros();
    let mut mean = Vector3::zeros();
    for [a, b] in lines {
        let way = b - a;
        let length = way.norm();
        let d = way.try_normalize(0.0)?;
        let r = (place - (a + b) * 0.5).norm().max(LEAST_DISTANCE * length);
        let weight = length / r.powi(4);
        sum += d * d.transpose() * weight;
        mean += d * weight;
    }
    let eigen = SymmetricEigen::new(sum);
    let largest = eigen.eigenvalues.imax();
    let axis: Vector3<f64> = eigen.eigenvectors.column(largest).into();
    (eigen.eigenvalues[largest] > 0.0).then(|| if axis.dot(&mean) < 0.0 { -axis } else { axis })
}
