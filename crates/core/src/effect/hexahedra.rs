//! Tissue in space that does not lock: hexahedra with one mean volume each.

use std::array::from_fn;

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::{Configuration, Effect, Tangent};
use crate::geometry::hexahedron::{self, CORNERS, POINTS};
use crate::geometry::simplex::{self, MAX_CORNERS};
use crate::material::MooneyRivlin;
use crate::sparse::pattern::pairs;
use crate::sparse::simd::vectorised;
use crate::sparse::{BlockMatrix, Pattern, Slot};

const PAIRS: usize = CORNERS * (CORNERS + 1) / 2;

/// How contracting muscles stiffen their tissue: all constants of an element are multiplied by
/// `1 + gain min(1, sum of the activations of its muscles)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffening {
    /// Additional stiffness at full activation over the passive stiffness (ArtiSynth: 9).
    pub gain: f64,
    /// For each element the numbers of the muscles that run through it.
    pub muscles: Vec<Vec<usize>>,
}

/// The Q1/P0 element of mean dilatation (Nagtegaal, Parks and Rice 1974; Simo, Taylor and Pister 1985): the distortion
/// `C10 (Ī1 - 3) + C20 (Ī1 - 3)²` is integrated over the eight points of Gauss, and the change of volume has the energy
/// `K/2 V0 (V/V0 - 1)²` of the whole element, since with `J` at each point the element would lock.
///
/// An element that is inverted at any point has the energy `+∞`, so that a line search rejects it.
#[derive(Debug, Clone)]
pub struct Hexahedra {
    law: MooneyRivlin,
    rest: Vec<Vector3<f64>>,
    elements: Vec<HexahedronElement>,
    pub(crate) stiffening: Option<Stiffening>,
}

#[derive(Debug, Clone)]
struct HexahedronElement {
    nodes: [usize; CORNERS],
    volume: f64,
    /// Volume at rest of each point, m³.
    shares: [f64; POINTS],
    /// Gradients of the shape functions at rest at each point, 1/m.
    shapes: [HexahedronCorners; POINTS],
    /// Factor of the law's constants, not 1 in scars.
    factor: f64,
    slots: [Slot; PAIRS],
}

impl Hexahedra {
    /// Elements of a law with these positions at rest, m; `None` if one of them is inverted or has no volume.
    pub fn new(
        law: MooneyRivlin,
        hexahedra: &[[usize; CORNERS]],
        rest_positions: &[Vector3<f64>],
    ) -> Option<Self> {
        let elements = hexahedra.iter().map(|nodes| {
            let x = hexahedron::corners(rest_positions, nodes);
            let (mut shapes, mut shares) = ([[Vector3::zeros(); CORNERS]; POINTS], [0.0; POINTS]);
            for ((shape, share), at) in shapes.iter_mut().zip(&mut shares).zip(hexahedron::points()) {
                (*shape, *share) = hexahedron::gradients(&x, at)?;
            }
            let volume = shares.iter().sum();
            let slots = [Slot::UNBOUND; PAIRS];
            Some(HexahedronElement { nodes: *nodes, volume, shares, shapes, factor: 1.0, slots })
        });
        let elements = elements.collect::<Option<Vec<_>>>()?;
        Some(Self { law, rest: rest_positions.to_vec(), elements, stiffening: None })
    }

    pub(crate) fn scale(&mut self, factors: &[f64]) {
        self.elements.iter_mut().zip(factors).for_each(|(e, factor)| e.factor = *factor);
    }

    #[inline(always)]
    fn at_points(&self, e: &HexahedronElement, positions: &[Vector3<f64>]) -> [TissuePoint; POINTS] {
        let moved: HexahedronCorners = from_fn(|i| positions[e.nodes[i]] - self.rest[e.nodes[i]]);
        from_fn(|i| TissuePoint::new(&e.shapes[i], &moved))
    }

    #[inline(always)]
    fn law_of(&self, number: usize, activations: &[f64]) -> MooneyRivlin {
        let stiffer = self.stiffening.as_ref().map_or(1.0, |s| {
            let sum: f64 = s.muscles[number].iter().map(|&m| activations[m]).sum();
            1.0 + s.gain * sum.clamp(0.0, 1.0)
        });
        self.law.scaled(self.elements[number].factor * stiffer)
    }

    fn energy_of(&self, e: &HexahedronElement, law: &MooneyRivlin, positions: &[Vector3<f64>]) -> f64 {
        let points = self.at_points(e, positions);
        if !points.iter().all(|p| p.growth > -1.0 && p.growth.is_finite()) {
            return f64::INFINITY;
        }
        let distortion =
            |(p, share): (&TissuePoint, &f64)| share * p.distortion * (law.c10 + law.c20 * p.distortion);
        let shear: f64 = points.iter().zip(&e.shares).map(distortion).sum();
        shear + 0.5 * law.bulk * e.volume * e.growth(&points).powi(2)
    }

    /// The force of an element of a law on its corners, N.
    #[inline(always)]
    fn force_of(
        &self,
        e: &HexahedronElement,
        law: &MooneyRivlin,
        positions: &[Vector3<f64>],
    ) -> HexahedronCorners {
        let points = self.at_points(e, positions);
        let pressure = law.bulk * e.growth(&points);
        let mut force = [Vector3::zeros(); CORNERS];
        for ((point, shape), share) in points.iter().zip(&e.shapes).zip(&e.shares) {
            let slope = 2.0 * point.q * (law.c10 + 2.0 * law.c20 * point.distortion);
            let across = pressure - slope * point.i1 / (3.0 * (1.0 + point.growth));
            let piola = (point.f * slope + point.cofactors() * across) * *share;
            force.iter_mut().zip(shape).for_each(|(f, g)| *f -= piola * g);
        }
        force
    }

    #[inline(always)]
    fn add_blocks(&self, at: Configuration<'_, 3>, tangent: Tangent, stiffness: &mut BlockMatrix<3>) {
        for (number, e) in self.elements.iter().enumerate() {
            let law = self.law_of(number, at.tensions);
            let points = self.at_points(e, at.positions);
            let pressure = law.bulk * e.growth(&points);
            let mut blocks = [Matrix3::zeros(); PAIRS];
            let mut swelling = [Vector3::zeros(); CORNERS];
            for ((point, shape), &share) in points.iter().zip(&e.shapes).zip(&e.shares) {
                let cofactors = point.cofactors();
                let grown = shape.map(|g| cofactors * g * share);
                swelling.iter_mut().zip(&grown).for_each(|(s, g)| *s += g);
                let moduli = ModuliTerms::new(&law, point, pressure);
                match tangent {
                    Tangent::Exact => add_exact(&mut blocks, point, shape, &grown, &moduli, share),
                    Tangent::Convex => add_convex(&mut blocks, point, shape, &moduli, share),
                }
            }
            let bulk = law.bulk / e.volume;
            let mut pair = 0;
            for (a, of_a) in swelling.iter().enumerate() {
                let row = of_a * bulk;
                for of_b in &swelling[a..] {
                    blocks[pair] += row * of_b.transpose();
                    stiffness.add(e.slots[pair], &blocks[pair]);
                    pair += 1;
                }
            }
        }
    }
}

impl HexahedronElement {
    /// Mean of `J - 1`.
    #[inline(always)]
    fn growth(&self, points: &[TissuePoint; POINTS]) -> f64 {
        points.iter().zip(&self.shares).map(|(p, share)| share * p.growth).sum::<f64>() / self.volume
    }
}

/// Adds the blocks of one point for all pairs of corners; `grown` has `J share F⁻ᵀ G`.
#[inline(always)]
fn add_exact(
    blocks: &mut [Matrix3<f64>; PAIRS],
    point: &TissuePoint,
    shape: &HexahedronCorners,
    grown: &HexahedronCorners,
    m: &ModuliTerms,
    share: f64,
) {
    let scale = 1.0 / (share * (1.0 + point.growth));
    let stretched = shape.map(|g| point.f * g);
    let turned = grown.map(|g| g * scale);
    let with_f: HexahedronCorners = from_fn(|b| (stretched[b] * m.ff + turned[b] * m.fg) * share);
    let with_g: HexahedronCorners = from_fn(|b| (stretched[b] * m.fg + turned[b] * m.gg) * share);
    let crossed: HexahedronCorners = from_fn(|a| turned[a] * (m.cross * share));
    let plain: HexahedronCorners = from_fn(|a| shape[a] * (m.unit * share));
    let mut pair = 0;
    for a in 0..CORNERS {
        for b in a..CORNERS {
            let unit = plain[a].dot(&shape[b]);
            let block = &mut blocks[pair];
            for c in 0..3 {
                for r in 0..3 {
                    block[(r, c)] += stretched[a][r] * with_f[b][c]
                        + turned[a][r] * with_g[b][c]
                        + turned[b][r] * crossed[a][c];
                }
                block[(c, c)] += unit;
            }
            pair += 1;
        }
    }
}

/// Adds the blocks of one point without the negative eigenvalues of the second derivative by `F` (Smith, de Goes and Kim 2019). In the
/// axes of the principal stretches that has a 3 x 3 block for the stretches and a 2 x 2 block for each pair of axes.
#[inline(never)]
fn add_convex(
    blocks: &mut [Matrix3<f64>; PAIRS],
    point: &TissuePoint,
    shape: &HexahedronCorners,
    m: &ModuliTerms,
    share: f64,
) {
    let right = SymmetricEigen::new(point.f.transpose() * point.f);
    let s = right.eigenvalues.map(|x| x.max(f64::MIN_POSITIVE).sqrt());
    let axes = right.eigenvectors;
    let turned = Matrix3::from_columns(&[0, 1, 2].map(|i| point.f * axes.column(i) / s[i]));
    let stretch = Matrix3::from_fn(|i, j| {
        let (a, b) = (s[i], s[j]);
        let both = m.ff * a * b + m.fg * (a / b + b / a) + m.gg / (a * b);
        if i == j { both + m.unit + m.cross / (a * a) } else { both }
    });
    let eigen = SymmetricEigen::new(stretch);
    let stretch = (0..3).fold(Matrix3::zeros(), |sum, i| {
        let v = eigen.eigenvectors.column(i);
        sum + v * v.transpose() * eigen.eigenvalues[i].max(0.0)
    });
    // The stiffness of the shear of each pair of axes, and its coupling with the transposed shear.
    let mut own = Matrix3::zeros();
    let mut cross = Matrix3::zeros();
    for i in 0..3 {
        for j in (0..3).filter(|&j| j != i) {
            let coupling = m.cross / (s[i] * s[j]);
            let (sum, difference) = ((m.unit + coupling).max(0.0), (m.unit - coupling).max(0.0));
            own[(i, j)] = 0.5 * (sum + difference);
            cross[(i, j)] = 0.5 * (sum - difference);
        }
    }
    let local = shape.map(|g| axes.tr_mul(&g));
    for (sum, (a, b)) in blocks.iter_mut().zip(pairs(CORNERS)) {
        let (ga, gb) = (&local[a], &local[b]);
        let mut block = Matrix3::from_fn(|i, k| {
            let across = if i == k { 0.0 } else { cross[(i, k)] * ga[k] * gb[i] };
            stretch[(i, k)] * ga[i] * gb[k] + across
        });
        for i in 0..3 {
            block[(i, i)] += (0..3).map(|j| own[(i, j)] * ga[j] * gb[j]).sum::<f64>();
        }
        *sum += turned * block * turned.transpose() * share;
    }
}

impl Effect<3> for Hexahedra {
    fn name(&self) -> &'static str {
        "hexahedra"
    }

    fn stencils(&self, couple: &mut dyn FnMut(&[usize])) {
        self.elements.iter().for_each(|e| couple(&e.nodes));
    }

    fn bind(&mut self, pattern: &Pattern) {
        for e in &mut self.elements {
            // In the reverse order of elimination no block has to be transposed to be stored.
            let mut order: [usize; CORNERS] = from_fn(|a| a);
            order.sort_by_key(|&a| std::cmp::Reverse(pattern.unknown(e.nodes[a])));
            e.nodes = order.map(|a| e.nodes[a]);
            e.shapes = e.shapes.map(|shape| order.map(|a| shape[a]));
            e.slots.iter_mut().zip(pattern.pair_slots(&e.nodes)).for_each(|(place, slot)| *place = slot);
        }
    }

    fn energy(&self, at: Configuration<'_, 3>) -> f64 {
        let each = self.elements.iter().enumerate();
        each.map(|(number, e)| self.energy_of(e, &self.law_of(number, at.tensions), at.positions)).sum()
    }

    fn add_force(&self, at: Configuration<'_, 3>, force: &mut [Vector3<f64>]) {
        for (number, e) in self.elements.iter().enumerate() {
            let own = self.force_of(e, &self.law_of(number, at.tensions), at.positions);
            e.nodes.iter().zip(own).for_each(|(&node, f)| force[node] += f);
        }
    }

    fn add_stiffness(&self, at: Configuration<'_, 3>, tangent: Tangent, stiffness: &mut BlockMatrix<3>) {
        vectorised(
            #[inline(always)]
            || self.add_blocks(at, tangent, stiffness),
        );
    }

    /// With stiffening a muscle also acts through the tissue while the activations of an element add up to less than 1.
    fn add_force_per_tension(&self, at: Configuration<'_, 3>, muscle: usize, rate: &mut [Vector3<f64>]) {
        let Some(s) = &self.stiffening else { return };
        for (e, muscles) in self.elements.iter().zip(&s.muscles) {
            let sum: f64 = muscles.iter().map(|&m| at.tensions[m]).sum();
            if !muscles.contains(&muscle) || !(0.0..1.0).contains(&sum) {
                continue;
            }
            let own = self.force_of(e, &self.law.scaled(s.gain * e.factor), at.positions);
            e.nodes.iter().zip(own).for_each(|(&node, f)| rate[node] += f);
        }
    }

    /// Largest part for which the tissue keeps a tenth of its volume at every point.
    fn step_limit(&self, at: Configuration<'_, 3>, step: &[Vector3<f64>]) -> f64 {
        let mut limit: f64 = 1.0;
        for e in &self.elements {
            let x: HexahedronCorners = from_fn(|i| at.positions[e.nodes[i]]);
            let p: HexahedronCorners = from_fn(|i| step[e.nodes[i]]);
            for shape in &e.shapes {
                let x = as_simplex(shape, &x, 1.0);
                let p = as_simplex(shape, &p, limit);
                limit *= simplex::safe_part(&x, &p);
            }
        }
        limit
    }

    fn keeps_cells_upright(&self) -> bool {
        true
    }
}

/// The gradient, times `scale`, of a field with `values` at the corners of an element, as a tetrahedron: its first corner is at the origin,
/// the others are the columns of the gradient.
#[inline(always)]
fn as_simplex(shape: &HexahedronCorners, values: &HexahedronCorners, scale: f64) -> simplex::Corners<3> {
    let mut corners = [Vector3::zeros(); MAX_CORNERS];
    for (value, shape) in values.iter().zip(shape) {
        (0..3).for_each(|d| corners[d + 1] += value * (shape[d] * scale));
    }
    corners
}

pub(super) type HexahedronCorners = hexahedron::PerCorner<Vector3<f64>>;

/// Deformation of the tissue at one point of an element.
#[derive(Clone, Copy)]
pub(super) struct TissuePoint {
    /// `F`.
    pub f: Matrix3<f64>,
    /// `J - 1`.
    pub growth: f64,
    /// `Ī1 - 3`.
    pub distortion: f64,
    /// `J^(-2/3)`.
    pub q: f64,
    /// `tr FᵀF`.
    pub i1: f64,
}

impl TissuePoint {
    #[inline(always)]
    pub fn new(shape: &HexahedronCorners, moved: &HexahedronCorners) -> Self {
        let mut h = Matrix3::zeros();
        for (u, g) in moved.iter().zip(shape) {
            h += u * g.transpose();
        }
        let minor = |i: usize, j: usize| h[(i, i)] * h[(j, j)] - h[(i, j)] * h[(j, i)];
        let growth = h.trace() + minor(0, 1) + minor(0, 2) + minor(1, 2) + h.determinant();
        let less = (-2.0 / 3.0 * growth.ln_1p()).exp_m1();
        let beyond = 2.0 * h.trace() + h.norm_squared();
        let q = 1.0 + less;
        // This is q tr FᵀF - 3 without cancellation for small displacements.
        let distortion = 3.0 * less + q * beyond;
        Self { f: Matrix3::identity() + h, growth, distortion, q, i1: 3.0 + beyond }
    }

    /// `det F F⁻ᵀ`.
    #[inline(always)]
    pub(crate) fn cofactors(&self) -> Matrix3<f64> {
        let f = &self.f;
        let [a, b, c] = [0, 1, 2].map(|d| f.column(d).into_owned());
        Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
    }
}

/// Coefficients of the second derivative of the energy: with `f = F G` and `g = F⁻ᵀ G` the block of corners a, b is `ff fa fbᵀ + fg (fa
/// gbᵀ + ga fbᵀ) + gg ga gbᵀ + cross gb gaᵀ + unit (Ga·Gb) I`.
#[derive(Clone, Copy)]
pub(super) struct ModuliTerms {
    pub ff: f64,
    pub fg: f64,
    pub gg: f64,
    pub cross: f64,
    pub unit: f64,
}

impl ModuliTerms {
    /// The coefficients at a point under the element's pressure `p = K (V/V0 - 1)`, Pa.
    #[inline(always)]
    pub fn new(law: &MooneyRivlin, point: &TissuePoint, pressure: f64) -> Self {
        let TissuePoint { growth, distortion, q, i1, .. } = *point;
        let slope = 2.0 * q * (law.c10 + 2.0 * law.c20 * distortion);
        let curvature = 8.0 * law.c20 * q * q;
        let swelling = pressure * (1.0 + growth);
        Self {
            ff: curvature,
            fg: -curvature * i1 / 3.0 - 2.0 / 3.0 * slope,
            gg: curvature * i1 * i1 / 9.0 + 2.0 / 9.0 * slope * i1 + swelling,
            cross: slope * i1 / 3.0 - swelling,
            unit: slope,
        }
    }
}
