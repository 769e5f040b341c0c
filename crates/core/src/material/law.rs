//! Constitutive laws of a continuum: energy density, stress and tangent as functions of the deformation gradient.

use nalgebra::{SMatrix, SVector};

use super::Model;

/// Number of components of a deformation gradient in space. The plane uses the first four.
const COMPONENTS: usize = 9;

/// `dP/dF`; component `(i, j)` of `F` has number `i + D j`.
pub type Moduli = SMatrix<f64, COMPONENTS, COMPONENTS>;

/// A compressible neo-Hookean solid: `W = μ/2 (tr FᵀF - D) - μ ln J + λ/2 (ln J)²` (Bonet and Wood, Nonlinear Continuum Mechanics, 2nd
/// ed., eq. 6.27).
///
/// Valid for `J > 0`; an inverted state has the energy `+∞`, so that a line search rejects it, and a stress of NaN. At small strain it is
/// linear elasticity with the same λ and μ. The plane has plane strain: the third principal stretch is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHookean {
    /// Lamé's first constant λ, Pa (2D: per metre of thickness).
    pub lambda: f64,
    /// Shear modulus μ, Pa.
    pub mu: f64,
}

#[derive(Debug, Clone, Copy)]
pub struct Deformed<const D: usize> {
    law: NeoHookean,
    /// Deformation gradient `F`.
    gradient: SMatrix<f64, D, D>,
    /// `J = det F`: the volume (in the plane: area) over that at rest.
    pub volume_ratio: f64,
    /// `ln J`.
    log: f64,
}

/// Strain and stress at a point of a continuum; they are uniform in a linear simplex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stress<const D: usize> {
    /// Green's strain `(FᵀF - I)/2`, dimensionless, in directions at rest.
    pub strain: SMatrix<f64, D, D>,
    /// Cauchy stress, Pa: force per deformed area, in directions of the deformed shape.
    pub cauchy_pa: SMatrix<f64, D, D>,
    /// Out-of-plane stress of plane strain, Pa; 0 in space.
    pub across_pa: f64,
    /// Von Mises stress, Pa; in the plane with the out-of-plane stress.
    pub von_mises_pa: f64,
}

impl<const D: usize> Stress<D> {
    fn new(strain: SMatrix<f64, D, D>, cauchy_pa: SMatrix<f64, D, D>, across_pa: f64) -> Self {
        let mean = (cauchy_pa.trace() + across_pa) / 3.0;
        let beyond = if D == 2 { (across_pa - mean).powi(2) } else { 0.0 };
        let deviator = cauchy_pa - SMatrix::<f64, D, D>::identity() * mean;
        let von_mises_pa = (1.5 * (deviator.norm_squared() + beyond)).sqrt();
        Self { strain, cauchy_pa, across_pa, von_mises_pa }
    }

    /// The mean over places of equal area or volume. The von Mises stress is that of the mean stress.
    pub fn mean(of: &[Self]) -> Self {
        let share = 1.0 / of.len().max(1) as f64;
        let [strain, cauchy] = [|s: &Self| s.strain, |s: &Self| s.cauchy_pa].map(|part| {
            let all = of.iter().map(|s| part(s) * share);
            all.fold(SMatrix::zeros(), |a, b| a + b)
        });
        match of {
            [one] => *one,
            _ => Self::new(strain, cauchy, of.iter().map(|s| s.across_pa * share).sum()),
        }
    }

    /// Pressure, Pa: minus a third of the trace of the Cauchy stress, with the out-of-plane stress in the plane.
    pub fn pressure_pa(&self) -> f64 {
        -(self.cauchy_pa.trace() + self.across_pa) / 3.0
    }

    /// Normal component of the Cauchy stress in a unit direction of the deformed shape, Pa; positive in tension.
    pub fn along(&self, direction: &SVector<f64, D>) -> f64 {
        direction.dot(&(self.cauchy_pa * direction))
    }
}

impl From<&Model> for NeoHookean {
    fn from(model: &Model) -> Self {
        let (lambda, mu) = model.lame();
        Self { lambda, mu }
    }
}

impl NeoHookean {
    /// The state at the displacement gradient `H = F - I`.
    #[inline(always)]
    pub fn displaced<const D: usize>(self, h: &SMatrix<f64, D, D>) -> Deformed<D> {
        let growth = h.trace() + beyond_trace(h);
        let (log, _) = log_and_rest(growth);
        Deformed { law: self, gradient: SMatrix::identity() + h, volume_ratio: 1.0 + growth, log }
    }

    /// Energy density `W` at the displacement gradient `H = F - I`, J/m³ of the body at rest.
    ///
    /// Every term is of second order in `H`: `μ/2 |H|² + μ ((J - 1 - ln J) - (J - 1 - tr H)) + λ/2 (ln J)²`. From `F` the energy would be
    /// a small difference of large numbers, whose rounding hides descent from a line search near rest.
    #[inline(always)]
    pub fn displaced_energy<const D: usize>(self, h: &SMatrix<f64, D, D>) -> f64 {
        let beyond = beyond_trace(h);
        let growth = h.trace() + beyond;
        // The condition is negated so that a determinant of NaN counts as inverted too.
        if !(growth > -1.0 && growth.is_finite()) {
            return f64::INFINITY;
        }
        let (log, rest) = log_and_rest(growth);
        self.mu * (0.5 * h.norm_squared() + (rest - beyond)) + 0.5 * self.lambda * log * log
    }
}

/// `det(I + H) - 1 - tr H`, the terms of higher order.
#[inline(always)]
fn beyond_trace<const D: usize>(h: &SMatrix<f64, D, D>) -> f64 {
    let minor = |i: usize, j: usize| h[(i, i)] * h[(j, j)] - h[(i, j)] * h[(j, i)];
    if D == 2 {
        return minor(0, 1);
    }
    let cofactor = |i: usize, j: usize| h[(1, i)] * h[(2, j)] - h[(1, j)] * h[(2, i)];
    let third = h[(0, 0)] * cofactor(1, 2) - h[(0, 1)] * cofactor(0, 2) + h[(0, 2)] * cofactor(0, 1);
    minor(0, 1) + minor(0, 2) + minor(1, 2) + third
}

/// `ln(1 + x)` and `x - ln(1 + x)`, the second without cancellation for small `x`: with `r = x/(2 + x)` the logarithm is
/// `2 (r + r³/3 + ..)`, and `x - 2 r` is `x r`.
#[inline(always)]
fn log_and_rest(x: f64) -> (f64, f64) {
    if x.abs() > 0.1 {
        let log = x.ln_1p();
        return (log, x - log);
    }
    let r = x / (2.0 + x);
    let s = r * r;
    let series =
        1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0 + s * (1.0 / 9.0 + s * (1.0 / 11.0 + s / 13.0))));
    let rest = x * r - 2.0 * r * s * series;
    (x - rest, rest)
}

impl<const D: usize> Deformed<D> {
    /// First Piola-Kirchhoff stress `P = μ F + (λ ln J - μ) F⁻ᵀ`, Pa, with `F⁻ᵀ` given.
    #[inline(always)]
    pub(crate) fn piola(&self, inverse_transpose: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        self.gradient * self.law.mu - inverse_transpose * self.transpose_modulus()
    }

    /// The block `μ Ga·Gb I + λ ga gbᵀ + (μ - λ ln J) gb gaᵀ` of `dP/dF` between two directions at rest `Ga`, `Gb` with `g = F⁻ᵀ G`.
    #[inline(always)]
    pub fn tangent(
        &self,
        rest: [&SVector<f64, D>; 2],
        deformed: [&SVector<f64, D>; 2],
    ) -> SMatrix<f64, D, D> {
        let NeoHookean { lambda, mu } = self.law;
        let [ga, gb] = deformed;
        SMatrix::identity() * (mu * rest[0].dot(rest[1]))
            + ga * gb.transpose() * lambda
            + gb * ga.transpose() * self.transpose_modulus()
    }

    /// The factor of `gb gaᵀ` in the tangent: `μ - λ ln J`, Pa.
    #[inline(always)]
    pub fn transpose_modulus(&self) -> f64 {
        self.law.mu - self.law.lambda * self.log
    }

    /// In the plane, a matrix `T` such that the block `(T Ga)(T Gb)ᵀ`, added to [`Deformed::tangent`], replaces a negative eigenvalue of
    /// the twist in `dP/dF` by zero; the zero matrix if it is not negative. `None` where another eigenvalue may be negative, and in space.
    ///
    /// With principal stretches `s` and `t = μ - λ ln J` the eigenvalues are `μ - t/J` of the twist `Q = R₉₀ R/√2`, `μ + t/J` of the flip,
    /// and those of the matrix with `μ + (λ + t)/sᵢ²` on the diagonal and `λ/J` beside it (Smith, De Goes and Kim 2019, 4). For `t >= 0`
    /// only the first can be negative.
    #[inline(always)]
    pub fn untwisting(&self) -> Option<SMatrix<f64, D, D>> {
        let (f, turn) = (&self.gradient, self.transpose_modulus());
        // The condition is negated so that NaN gives `None`.
        if D != 2 || !(turn >= 0.0 && self.volume_ratio > 0.0) {
            return None;
        }
        let twist = self.law.mu - turn / self.volume_ratio;
        let (a, b) = (f[(0, 0)] + f[(1, 1)], f[(1, 0)] - f[(0, 1)]);
        let size = (0.5 * (-twist).max(0.0) / (a * a + b * b)).sqrt();
        let mut turned = SMatrix::zeros();
        (turned[(0, 0)], turned[(1, 0)], turned[(0, 1)], turned[(1, 1)]) =
            (-b * size, a * size, -a * size, -b * size);
        Some(turned)
    }

    /// `dP/dF` with its negative eigenvalues set to zero (Teran, Sifakis, Irving and Fedkiw 2005, section 5).
    pub fn convex_moduli(&self) -> Moduli {
        let eigen = self.moduli().symmetric_eigen();
        let kept = eigen.eigenvalues.map(|v| v.max(0.0));
        eigen.eigenvectors * SMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose()
    }

    /// [`Deformed::convex_moduli`], or `None` if no eigenvalue is negative. In the plane only the 4 x 4 part is decomposed, which is
    /// several times as fast and rounds differently.
    pub fn nearest_convex_moduli(&self) -> Option<Moduli> {
        let mut moduli = self.moduli();
        if D != 2 {
            return moduli.cholesky().is_none().then(|| self.convex_moduli());
        }
        let plane = moduli.fixed_view::<4, 4>(0, 0).into_owned();
        if plane.cholesky().is_some() {
            return None;
        }
        let eigen = plane.symmetric_eigen();
        let kept = eigen.eigenvalues.map(|v| v.max(0.0));
        let plane = eigen.eigenvectors * SMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose();
        moduli.fixed_view_mut::<4, 4>(0, 0).copy_from(&plane);
        Some(moduli)
    }

    fn moduli(&self) -> Moduli {
        let mut moduli = Moduli::zeros();
        // A cell without area or volume has no inverse, and its energy is infinite.
        let inverse = self.gradient.try_inverse().unwrap_or_else(SMatrix::zeros);
        let NeoHookean { lambda, mu } = self.law;
        let turn = self.transpose_modulus();
        for (i, j) in indices::<D>() {
            for (k, l) in indices::<D>() {
                let mut entry =
                    lambda * inverse[(j, i)] * inverse[(l, k)] + turn * inverse[(j, k)] * inverse[(l, i)];
                if (i, j) == (k, l) {
                    entry += mu;
                }
                moduli[(i + D * j, k + D * l)] = entry;
            }
        }
        moduli
    }

    /// Strain and stress: `σ = (μ F Fᵀ + (λ ln J - μ) I)/J`, out of the plane `λ ln J / J`.
    pub fn state(&self) -> Stress<D> {
        let (NeoHookean { lambda, mu }, unit) = (self.law, SMatrix::<f64, D, D>::identity());
        let pulled = self.gradient * self.gradient.transpose() * mu;
        let cauchy_pa = (pulled + unit * (lambda * self.log - mu)) / self.volume_ratio;
        let across_pa = if D == 2 { lambda * self.log / self.volume_ratio } else { 0.0 };
        Stress::new((self.gradient.transpose() * self.gradient - unit) * 0.5, cauchy_pa, across_pa)
    }
}

fn indices<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..D).flat_map(|j| (0..D).map(move |i| (i, j)))
}

/// The stiffness block of the moduli between two shape functions with gradients `ga` and `gb`.
pub fn contract<const D: usize>(
    moduli: &Moduli,
    ga: &SVector<f64, D>,
    gb: &SVector<f64, D>,
) -> SMatrix<f64, D, D> {
    let mut block = SMatrix::zeros();
    for (i, j) in indices::<D>() {
        for (k, l) in indices::<D>() {
            block[(i, k)] += moduli[(i + D * j, k + D * l)] * ga[j] * gb[l];
        }
    }
    block
}

/// The five-constant Mooney-Rivlin solid with the two constants that were measured for tongues:
/// `W = C10 (Ī1 - 3) + C20 (Ī1 - 3)² + K/2 (J - 1)²`, `Ī1 = J^(-2/3) tr FᵀF` (Gérard, Ohayon, Luboz, Perrier and Payan 2005; Buchaillard,
/// Perrier and Payan 2009, eq. 1).
///
/// At small strain the shear modulus is `2 C10` and the bulk modulus `K`. Valid for `J > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    /// `C10`, Pa.
    pub c10: f64,
    /// `C20`, Pa.
    pub c20: f64,
    /// Bulk modulus `K`, Pa.
    pub bulk: f64,
}

impl MooneyRivlin {
    /// The tongue of Buchaillard, Perrier and Payan (2009) with `K = 482 C10`, as in ArtiSynth.
    pub const TONGUE: Self = Self { c10: 1037.0, c20: 486.0, bulk: 482.0 * 1037.0 };

    /// Poisson's ratio at small strain.
    pub fn poisson_ratio(&self) -> f64 {
        let shear = 2.0 * self.c10;
        (3.0 * self.bulk - 2.0 * shear) / (2.0 * (3.0 * self.bulk + shear))
    }

    #[inline(always)]
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { c10: self.c10 * factor, c20: self.c20 * factor, bulk: self.bulk * factor }
    }

    /// Whether the shear and bulk moduli are positive and finite and `C20` is not negative.
    pub(crate) fn is_sound(&self) -> bool {
        [self.c10, self.bulk].iter().all(|x| x.is_finite() && *x > 0.0)
            && self.c20.is_finite()
            && self.c20 >= 0.0
    }
}
