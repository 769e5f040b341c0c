//! Muscles as bundles: fibres over a width along a line, cut at the boundaries of the elements.

use nalgebra::SVector;

use super::locate::Locator;
use super::{ContinuumSettings, Follower, Strand};
use crate::body::{BodyError, Mesh, MuscleChain};
use crate::geometry::quadratic::gauss_legendre;

/// Number of points of each piece of a fibre.
const POINTS: usize = 2;
/// Number of fibres on each ring of the cross-section in space.
const AROUND: usize = 6;

pub(super) struct MuscleCourse<const D: usize> {
    name: String,
    points: Vec<SVector<f64, D>>,
    /// The node of the bone at each end, if there is one.
    bones: [Option<usize>; 2],
    outside: [bool; 2],
    /// Whether the tension fades out at each end, because it is in the tissue and neither on a bone nor on the surface.
    fades: [bool; 2],
    /// Whether the whole muscle is outside the tissue.
    apart: bool,
}

impl<const D: usize> MuscleCourse<D> {
    /// The course of a chain of `base` through `points`, m; `replacements` has the nodes of its bones in the continuum.
    pub fn new(
        base: &Mesh<D>,
        chain: &MuscleChain,
        points: Vec<SVector<f64, D>>,
        replacements: &[(usize, Vec<usize>)],
    ) -> Result<Self, BodyError> {
        let in_tissue = base.in_tissue();
        let inside: Vec<usize> = (0..chain.nodes.len()).filter(|&i| in_tissue[chain.nodes[i]]).collect();
        let bones = chain.ends().map(|end| {
            let found = replacements.iter().find(|(bone, _)| *bone == end);
            found.and_then(|(_, nodes)| nodes.first().copied())
        });
        let outside = chain.ends().map(|end| !in_tissue[end]);
        let surface = base.surface_nodes();
        let fades = [0, 1].map(|i| bones[i].is_none() && surface.binary_search(&chain.ends()[i]).is_err());
        if (0..2).any(|i| outside[i] && bones[i].is_none()) {
            return Err(unattached(&chain.name));
        }
        let leaves =
            "leaves the tissue between its ends; only a part from a bone to the tissue may be outside";
        let leaves = || BodyError(format!("muscle {} {leaves}", chain.name));
        let (Some(first), Some(last)) = (inside.first(), inside.last()) else { return Err(leaves()) };
        let apart = first == last;
        if last - first + 1 != inside.len() || (apart && outside[0] == outside[1]) {
            return Err(leaves());
        }
        Ok(Self { name: chain.name.clone(), points, bones, outside, fades, apart })
    }

    fn length(&self) -> f64 {
        self.points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }

    pub fn strands(
        &self,
        locator: &Locator<'_, D>,
        settings: &ContinuumSettings,
    ) -> Result<Vec<Strand>, BodyError> {
        if self.apart {
            // The end in the tissue is the one that is not outside.
            let (bone, inner) = if self.outside[0] { (0, 1) } else { (1, 0) };
            let at = if inner == 0 { self.points[0] } else { self.points[self.points.len() - 1] };
            let mean =
                locator.mean(&at, 0.5 * settings.bundle_width_m).ok_or_else(|| unattached(&self.name))?;
            return self.bone_to(bone, mean, 1.0).map(|strand| vec![strand]);
        }
        let mut strands = Vec::new();
        for (offset, share) in profile::<D>(settings) {
            let fibre = self.fibre(&offset, settings.bundle_width_m);
            let ends = self.embed(&fibre, share, locator, settings, &mut strands);
            for bone in (0..2).filter(|&i| self.outside[i]) {
                // A fibre that misses the tissue has no entry.
                let Some(entry) = ends.map(|ends| ends[bone]) else { continue };
                let mean = locator.mean(&entry, 0.0).ok_or_else(|| unattached(&self.name))?;
                strands.push(self.bone_to(bone, mean, share)?);
            }
        }
        Ok(strands)
    }

    /// The straight strand from the bone at an end to a weighted mean of nodes.
    fn bone_to(&self, end: usize, mean: Vec<(usize, f64)>, weight: f64) -> Result<Strand, BodyError> {
        let bone = self.bones[end].ok_or_else(|| unattached(&self.name))?;
        let (mut nodes_of, mut coefficients): (Vec<usize>, Vec<f64>) = mean.into_iter().unzip();
        nodes_of.push(bone);
        coefficients.push(-1.0);
        Ok(Strand { nodes: nodes_of, coefficients, weight })
    }

    /// The line displaced laterally by `offset` half widths, and by half of that at a bone.
    fn fibre(&self, offset: &[f64; 2], width: f64) -> Vec<SVector<f64, D>> {
        let (length, last) = (self.length(), self.points.len() - 1);
        let mut way = 0.0;
        let mut normals: Option<[SVector<f64, D>; 2]> = None;
        let mut fibre = Vec::with_capacity(self.points.len());
        for (i, point) in self.points.iter().enumerate() {
            if i > 0 {
                way += (point - self.points[i - 1]).norm();
            }
            let along = (self.points[(i + 1).min(last)] - self.points[i.saturating_sub(1)]).normalize();
            let across = across(&along, normals.as_ref());
            normals = Some(across);
            let wide = 0.5 * width * self.wide(way / length);
            fibre.push(point + (across[0] * offset[0] + across[1] * offset[1]) * wide);
        }
        fibre
    }

    /// The width at a part of the length, over the whole width.
    fn wide(&self, part: f64) -> f64 {
        match [self.bones[0].is_some(), self.bones[1].is_some()] {
            [false, false] => 1.0,
            [true, false] => 0.5 + 0.5 * part,
            [false, true] => 1.0 - 0.5 * part,
            [true, true] => 1.0 - (part - 0.5).abs(),
        }
    }

    /// The part of the tension that acts at a distance along the line, m; it fades out over one width to an end in the tissue.
    fn ramp(&self, way: f64, length: f64, width: f64) -> f64 {
        let fade = |distance: f64| {
            let t = if width > 0.0 { (distance / width).clamp(0.0, 1.0) } else { 1.0 };
            t * t * (3.0 - 2.0 * t)
        };
        (if self.fades[0] { fade(way) } else { 1.0 }) * (if self.fades[1] { fade(length - way) } else { 1.0 })
    }

    /// Adds the strands of a fibre. Returns where it enters the tissue and where it leaves it.
    fn embed(
        &self,
        fibre: &[SVector<f64, D>],
        share: f64,
        locator: &Locator<'_, D>,
        settings: &ContinuumSettings,
        strands: &mut Vec<Strand>,
    ) -> Option<[SVector<f64, D>; 2]> {
        let length = self.length();
        let mut ends: Option<[SVector<f64, D>; 2]> = None;
        let mut before = 0.0;
        for (piece, on_line) in fibre.windows(2).zip(self.points.windows(2)) {
            let (way, own_length) = (piece[1] - piece[0], (on_line[1] - on_line[0]).norm());
            let along = way.normalize();
            for (element, [from, to]) in locator.cut(&piece[0], &piece[1]) {
                let [first, last] = [from, to].map(|t| piece[0] + way * t);
                ends = Some([ends.map_or(first, |e| e[0]), last]);
                for (x, w) in gauss_legendre(POINTS) {
                    let t = from + (to - from) * 0.5 * (1.0 + x);
                    let at = piece[0] + way * t;
                    let ramp = self.ramp(before + own_length * t, length, settings.bundle_width_m);
                    strands.push(Strand {
                        nodes: locator.elements[element].clone(),
                        coefficients: locator.slopes(element, &at, &along),
                        weight: share * ramp * 0.5 * w * (to - from) * way.norm(),
                    });
                }
            }
            before += own_length;
        }
        ends
    }

    /// The nodes of the muscle in the continuum: its bones, and points that follow the tissue, about `spacing`, m, apart.
    pub fn chain(
        &self,
        locator: &Locator<'_, D>,
        nodes: &mut Vec<SVector<f64, D>>,
        followers: &mut Vec<Follower<D>>,
        settings: &ContinuumSettings,
        spacing: f64,
    ) -> Result<Vec<usize>, BodyError> {
        let mut follow = |at: SVector<f64, D>, weights: Vec<(usize, f64)>| {
            if let Some(same) = followers.iter().find(|f| nodes[f.node] == at && f.weights == weights) {
                return same.node;
            }
            let mean: SVector<f64, D> = weights.iter().map(|&(n, w)| nodes[n] * w).sum();
            nodes.push(at);
            followers.push(Follower { node: nodes.len() - 1, offset: at - mean, weights });
            nodes.len() - 1
        };
        let last = self.points.len() - 1;
        let mut end = |i: usize| match self.bones[i] {
            Some(bone) => Ok(bone),
            None => {
                let at = self.points[i * last];
                let mean =
                    locator.mean(&at, 0.5 * settings.bundle_width_m).ok_or_else(|| unattached(&self.name))?;
                Ok(follow(at, mean))
            }
        };
        let ends = [end(0)?, end(1)?];
        let mut chain = vec![ends[0]];
        for piece in self.points.windows(2) {
            let way = piece[1] - piece[0];
            let count = if self.apart { 1 } else { (way.norm() / spacing).round().max(1.0) as usize };
            for step in 1..=count {
                let at = piece[0] + way * (step as f64 / count as f64);
                let is_end = step == count && piece[1] == self.points[last];
                if let Some(mean) = locator.mean(&at, 0.0).filter(|_| !is_end) {
                    chain.push(follow(at, mean));
                }
            }
        }
        chain.push(ends[1]);
        Ok(chain)
    }
}

fn unattached(muscle: &str) -> BodyError {
    let problem = "ends outside the tissue and on no bone, so it has no attachment there; fix its end";
    BodyError(format!("muscle {muscle} {problem}"))
}

/// Offsets of the fibres in the cross-section, in half widths, and their shares of the tension: Gauss points with the weights `(1 - t²)²`,
/// in space on rings.
fn profile<const D: usize>(settings: &ContinuumSettings) -> Vec<([f64; 2], f64)> {
    let count = if settings.bundle_width_m > 0.0 { settings.fibres } else { 1 };
    let mut fibres: Vec<([f64; 2], f64)> = Vec::new();
    if D == 2 || count == 1 {
        fibres.extend(gauss_legendre(count).into_iter().map(|(t, w)| ([t, 0.0], w * fibre_weight(t))));
    } else {
        for (ring, (x, w)) in gauss_legendre(count.div_ceil(AROUND)).into_iter().enumerate() {
            let r = 0.5 * (1.0 + x);
            for i in 0..AROUND {
                let angle = std::f64::consts::TAU * (i as f64 + 0.5 * (ring % 2) as f64) / AROUND as f64;
                fibres.push(([r * angle.cos(), r * angle.sin()], w * r * fibre_weight(r)));
            }
        }
    }
    let all: f64 = fibres.iter().map(|f| f.1).sum();
    fibres.iter_mut().for_each(|f| f.1 /= all);
    fibres
}

/// Weight of a fibre at this part of the distance from the middle of a muscle to its edge.
fn fibre_weight(t: f64) -> f64 {
    (1.0 - t * t).powi(2)
}

/// Unit vectors across a direction: in the plane the one to its left, in space two that are as near as possible to those before.
fn across<const D: usize>(
    along: &SVector<f64, D>,
    before: Option<&[SVector<f64, D>; 2]>,
) -> [SVector<f64, D>; 2] {
    let mut first = SVector::zeros();
    if D == 2 {
        (first[0], first[1]) = (-along[1], along[0]);
        return [first, SVector::zeros()];
    }
    let least = (0..D).min_by(|&i, &j| along[i].abs().total_cmp(&along[j].abs())).unwrap_or(0);
    let mut unit = SVector::<f64, D>::zeros();
    unit[least] = 1.0;
    let start = before.map_or(unit, |b| b[0]);
    let [start, unit] = [start, unit].map(|v| v - along * along.dot(&v));
    let first = start.try_normalize(1e-6).unwrap_or_else(|| unit.normalize());
    let mut second = SVector::zeros();
    for d in 0..3 {
        second[d] = along[(d + 1) % 3] * first[(d + 2) % 3] - along[(d + 2) % 3] * first[(d + 1) % 3];
    }
    [first, second]
}
