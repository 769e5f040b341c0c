//! Surgery on a body in space: elements that are removed, scarred, or replaced by tissue without muscle.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::Side;
use crate::body::{Body, BodyError};
use crate::geometry::hexahedron;

/// Elements by the place of their middle, or by a muscle.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Between two opposite corners, m.
    Box([Vector3<f64>; 2]),
    /// Within a radius, m, of a point, m.
    Ball(Vector3<f64>, f64),
    /// The regions of muscles of this name.
    Muscle(String),
}

/// The tissue in operated elements. The choice decides to which side the tongue deviates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling {
    /// No tissue: the elements are removed, and what remains moves freely.
    Removed,
    /// Scar: tissue without muscle, stiffer than the tongue by this factor.
    Scar(f64),
    /// A flap: tissue without muscle, as stiff as the tongue.
    Flap,
    /// The tongue's tissue with its nerve cut, so that muscles are inactive there. Its mechanics are those of a flap.
    Silent,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Operated {
    pub body: Body<3>,
    /// The former numbers of the body's muscles, without those that lost all of their tissue.
    pub muscles: Vec<usize>,
    /// The former numbers of the operated elements.
    pub elements: BTreeSet<usize>,
    pub volume_m3: f64,
}

impl Body<3> {
    /// Numbers of the elements of a region, on one side or on both.
    pub fn elements_in(&self, region: &Region, side: Option<Side>) -> Result<BTreeSet<usize>, BodyError> {
        let middle = |element: usize| {
            let x = hexahedron::corners(&self.mesh.nodes, &self.mesh.hexahedra[element]);
            x.iter().sum::<Vector3<f64>>() / x.len() as f64
        };
        let all = 0..self.mesh.hexahedra.len();
        let (is_sound, mut found): (bool, BTreeSet<usize>) = match region {
            Region::Box([low, high]) => (
                low.iter().chain(high).all(|c| c.is_finite()) && (0..3).all(|d| low[d] < high[d]),
                all.filter(|&e| (0..3).all(|d| (low[d]..=high[d]).contains(&middle(e)[d]))).collect(),
            ),
            Region::Ball(centre, radius) => (
                centre.iter().all(|c| c.is_finite()) && radius.is_finite() && *radius > 0.0,
                all.filter(|&e| (middle(e) - centre).norm() <= *radius).collect(),
            ),
            Region::Muscle(name) => {
                let muscles = self.both_sides(name)?;
                (true, muscles.iter().flat_map(|&m| self.muscles[m].region.iter().copied()).collect())
            }
        };
        if !is_sound {
            let message = "the region has no extent or is not finite; give a box from low to high, or a positive radius";
            return Err(BodyError(message.to_owned()));
        }
        match side {
            Some(Side::Left) => found.retain(|&e| middle(e).y < 0.0),
            Some(Side::Right) => found.retain(|&e| middle(e).y > 0.0),
            _ => {}
        }
        let none =
            "no element has its middle in the region; coordinates are millimetres in the frame of the body";
        if found.is_empty() { Err(BodyError(none.to_owned())) } else { Ok(found) }
    }

    /// The body after an operation on these elements. Muscles lose their parts in them, and the rest of a region pulls with its former
    /// stress. Nodes keep their numbers; those without tissue do not move.
    pub fn operated(&self, elements: &BTreeSet<usize>, filling: Filling) -> Result<Operated, BodyError> {
        let mut body = self.clone();
        let is_cut = |e: usize| elements.contains(&e);
        let volumes: Vec<f64> = self.mesh.hexahedron_volumes().collect();
        let nodes_of = |cut: bool| -> BTreeSet<usize> {
            let all = self.mesh.hexahedra.iter().enumerate();
            all.filter(|(e, _)| is_cut(*e) == cut).flat_map(|(_, corners)| corners.iter().copied()).collect()
        };
        // Nodes of operated elements only.
        let lost: BTreeSet<usize> = nodes_of(true).difference(&nodes_of(false)).copied().collect();
        let count = self.mesh.hexahedra.len();
        let kept: Vec<usize> = (0..count).filter(|&e| !is_cut(e)).collect();
        let mut number: Vec<Option<usize>> = (0..count).map(Some).collect();
        let factor_of = |e: usize| self.factors.get(e).copied().unwrap_or(1.0);
        let factors =
            |of_cut: f64| (0..count).map(|e| if is_cut(e) { of_cut } else { factor_of(e) }).collect();
        match filling {
            Filling::Removed => {
                for bone in &self.bones {
                    let nodes = bone.nodes.iter().filter(|n| lost.contains(n)).count();
                    if nodes > 0 {
                        return Err(BodyError(format!(
                            "the region removes the tissue at {} ({nodes} of its nodes); a region may not remove a bone: \
                             make it smaller, or fill it",
                            bone.name
                        )));
                    }
                }
                number.fill(None);
                kept.iter().enumerate().for_each(|(new, &old)| number[old] = Some(new));
                body.mesh.hexahedra = kept.iter().map(|&e| self.mesh.hexahedra[e]).collect();
                body.factors = kept.iter().filter_map(|&e| self.factors.get(e).copied()).collect();
                body.mesh.fixed.extend(&lost);
                body.mesh.fixed.sort_unstable();
                body.mesh.connect();
            }
            Filling::Scar(factor) => body.factors = factors(factor),
            Filling::Flap if !self.factors.is_empty() => body.factors = factors(1.0),
            Filling::Flap | Filling::Silent => {}
        }
        let mut muscles = Vec::new();
        body.muscles.clear();
        body.mesh.muscles.clear();
        for (m, whole) in self.muscles.iter().enumerate() {
            let mut muscle = whole.clone();
            let left = |e: &&usize| !is_cut(**e);
            muscle.region = whole.region.iter().filter(left).filter_map(|&e| number[e]).collect();
            if !whole.directions.is_empty() || !elements.is_disjoint(&whole.region.iter().copied().collect())
            {
                // The directions stay those of the whole muscle.
                muscle.directions =
                    whole.region.iter().filter(left).map(|&e| self.directions(m, e)).collect();
            }
            let holds =
                |e: usize, s: &super::Segment| s.nodes.iter().all(|n| self.mesh.hexahedra[e].contains(n));
            muscle.segments.retain(|s| {
                let mut around = whole.region.iter().filter(|&&e| holds(e, s)).peekable();
                let cut = around.peek().is_some() && around.all(|&e| is_cut(e));
                !cut && !s.nodes.iter().any(|n| lost.contains(n))
            });
            if !muscle.region.is_empty() && !muscle.segments.is_empty() {
                muscles.push(m);
                body.mesh.muscles.push(self.mesh.muscles[m].clone());
                body.muscles.push(muscle);
            }
        }
        body.what = format!("{}, operated", self.what);
        let volume_m3 = elements.iter().map(|&e| volumes[e]).sum();
        Ok(Operated { body, muscles, elements: elements.clone(), volume_m3 })
    }
}
