//! Deformation and moduli of the tissue at one point of a hexahedron.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::hexahedron;
use crate::material::MooneyRivlin;

pub(super) type Corners = hexahedron::Of<Vector3<f64>>;

/// The tissue at one point of an element.
#[derive(Clone, Copy)]
pub(super) struct Point {
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

impl Point {
    #[inline(always)]
    pub fn new(shape: &Corners, moved: &Corners) -> Self {
        let mut h = Matrix3::zeros();
        for (u, g) in moved.iter().zip(shape) {
            h += u * g.transpose();
        }
        let minor = |i: usize, j: usize| h[(i, i)] * h[(j, j)] - h[(i, j)] * h[(j, i)];
        let growth = h.trace() + minor(0, 1) + minor(0, 2) + minor(1, 2) + h.determinant();
        let less = (-2.0 / 3.0 * growth.ln_1p()).exp_m1();
        let beyond = 2.0 * h.trace() + h.norm_squared();
        let q = 1.0 + less;
        // Without the cancellation that q tr FᵀF - 3 has where the tissue has hardly moved.
        let distortion = 3.0 * less + q * beyond;
        Self { f: Matrix3::identity() + h, growth, distortion, q, i1: 3.0 + beyond }
    }

    /// Whether the tissue is upright here; where it is not a number it is not.
    #[inline(always)]
    pub(crate) fn is_upright(&self) -> bool {
        self.growth > -1.0 && self.growth.is_finite()
    }

    /// `det F F⁻ᵀ`.
    #[inline(always)]
    pub(crate) fn cofactors(&self) -> Matrix3<f64> {
        let f = &self.f;
        let [a, b, c] = [0, 1, 2].map(|d| f.column(d).into_owned());
        Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
    }
}

/// `x yᵀ` with coefficients that the second derivative of the energy is made of: with `f = F G` and `g = F⁻ᵀ
/// G` the block of corners a, b is `ff fa fbᵀ + fg (fa gbᵀ + ga fbᵀ) + gg ga gbᵀ + cross gb gaᵀ + unit
/// (Ga·Gb) I`.
#[derive(Clone, Copy)]
pub(super) struct Moduli {
    pub ff: f64,
    pub fg: f64,
    pub gg: f64,
    pub cross: f64,
    pub unit: f64,
}

impl Moduli {
    /// At a point under the element's pressure `p = K (V/V0 - 1)`, Pa.
    #[inline(always)]
    pub fn new(law: &MooneyRivlin, point: &Point, pressure: f64) -> Self {
        let Point { growth, distortion, q, i1, .. } = *point;
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
