//! The physical constants of tissue and their ranges (Kato 2014, table 4.1), and the coefficients of springs and area terms that follow
//! from them (3.3.4 and table 4.2).
//!
//! By the stiffness matching of Lloyd, Székely and Harders (2007), `k` and `kappa` minimise `|K_CST - k K_springs - kappa K_measure|²`:
//! the stiffness matrix of a simplex of springs, with a term for its area or volume, approximates that of the linear finite element of the
//! same shape.

use nalgebra::{SMatrix, SVector};
use serde::Serialize;

use crate::geometry::simplex::{self, Corners};
use crate::limits::{self, BeyondLimit};
use crate::system::SystemError;

/// Coefficients of the model; in the plane per metre of thickness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Coefficients {
    /// Spring constant k of a tissue connection, N/m.
    pub tissue_stiffness: f64,
    /// Damping b of a tissue connection, N s/m.
    pub tissue_damping: f64,
    /// kappa_s (area) or kappa_v (volume) of a cell, J.
    pub kappa: f64,
    /// Spring constant k1 of the spring Q1 of a contracting connection, N/m.
    pub muscle_parallel_stiffness: f64,
    /// Spring constant k2 of the spring Q2, in series with the contractile element, N/m.
    pub muscle_series_stiffness: f64,
    /// Damping b_cc of the contractile element, N s/m.
    pub contractile_damping: f64,
    /// Mass of a node, kg.
    pub node_mass: f64,
}

/// k of each edge, N/m, and kappa, J, of one cell (2D: per metre of thickness): eq. 3.49, with `l0²` in eq. 3.44 and `1/S0²` in eq. 3.48
/// (misprints of the thesis, docs/model.md).
///
/// The plane has plane strain (eqs. 3.38-3.42), space the full elasticity matrix. On an equilateral triangle the match is exact. In space
/// the cell is a regular tetrahedron with the mesh's mean connection length. A block of cubes cut into tetrahedra, which are not regular,
/// has 4 % more than the given Young's modulus, a bulk modulus half as large again, and a shear modulus 29 % smaller (ν = 0.49).
pub fn match_stiffness<const D: usize>(model: &Model, cell: &Corners<D>) -> Result<(f64, f64), SystemError> {
    model.check()?;
    let measure = simplex::measure(cell);
    if !(measure.is_finite() && measure > 0.0) {
        let message = format!("the cell to match has measure {measure}; it must be positive");
        return Err(SystemError::Invalid(message));
    }
    let (lambda, mu) = model.lame();
    let gradient = simplex::gradient(cell);
    // The shape function of corner a has the gradient (dS/da)/S; the block of corners a, b of the linear element is S (λ ga gbᵀ + μ (ga·gb
    // I + gb gaᵀ)).
    let element = |a: usize, b: usize| {
        let (ga, gb) = (gradient[a] / measure, gradient[b] / measure);
        (ga * gb.transpose() * lambda + (SMatrix::identity() * ga.dot(&gb) + gb * ga.transpose()) * mu)
            * measure
    };
    let springs = |a: usize, b: usize| -> SMatrix<f64, D, D> {
        let line = |i: usize, j: usize| {
            let n = (cell[j] - cell[i]).normalize();
            n * n.transpose()
        };
        if a != b {
            return -line(a, b);
        }
        (0..=D).filter(|&c| c != a).map(|c| line(a, c)).sum()
    };
    let keep = |a: usize, b: usize| gradient[a] * gradient[b].transpose() / (measure * measure);

    // Normal equations of the least squares over all entries of the matrices.
    let (mut ss, mut sc, mut cc, mut es, mut ec) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for a in 0..=D {
        for b in 0..=D {
            let (e, s, c) = (element(a, b), springs(a, b), keep(a, b));
            ss += s.dot(&s);
            sc += s.dot(&c);
            cc += c.dot(&c);
            es += e.dot(&s);
            ec += e.dot(&c);
        }
    }
    let determinant = ss * cc - sc * sc;
    Ok(((es * cc - ec * sc) / determinant, (ec * ss - es * sc) / determinant))
}

/// An equilateral triangle or a regular tetrahedron with edges of length `side`, m.
pub fn regular_simplex<const D: usize>(side: f64) -> Corners<D> {
    let mut corners = [SVector::zeros(); simplex::MAX_CORNERS];
    corners[1][0] = side;
    corners[2][0] = 0.5 * side;
    corners[2][1] = side * 0.75f64.sqrt();
    if D == 3 {
        corners[3][0] = 0.5 * side;
        corners[3][1] = side * (1.0f64 / 12.0).sqrt();
        corners[3][2] = side * (2.0f64 / 3.0).sqrt();
    }
    corners
}

impl Coefficients {
    /// Coefficients of a body with connections of the mean length `side`, m, cells of the total area or volume `measure`, m² or m³, and
    /// tissue of `nodes` nodes (thesis 4.1.1).
    pub fn new<const D: usize>(
        model: &Model,
        side: f64,
        measure: f64,
        nodes: usize,
    ) -> Result<Self, SystemError> {
        let (stiffness, kappa) = match_stiffness::<D>(model, &regular_simplex(side))?;
        // b = eta in the plane is per metre of thickness; in space a connection is about as thick as it is long.
        let damping = model.viscosity * if D == 2 { 1.0 } else { side };
        Ok(Self {
            tissue_stiffness: stiffness,
            tissue_damping: damping,
            kappa,
            muscle_parallel_stiffness: stiffness,
            // The thesis takes k2 = b "to avoid divergence"; at equilibrium k2 has no effect.
            muscle_series_stiffness: damping,
            contractile_damping: damping,
            node_mass: model.density * measure / nodes as f64,
        })
    }
}

/// The constants of the tissue, by which a mesh becomes a system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Model {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Young's modulus E, Pa.
    pub young_modulus: f64,
    /// Poisson's ratio ν.
    pub poisson_ratio: f64,
    /// Viscosity η, N s/m².
    pub viscosity: f64,
}

impl Default for Model {
    /// Table 4.1 of the thesis (after Fujita 2008).
    fn default() -> Self {
        Self { density: 1.0e3, young_modulus: 6.9e3, poisson_ratio: 0.49, viscosity: 3.0e3 }
    }
}

impl Model {
    pub fn check(&self) -> Result<(), BeyondLimit> {
        limits::YOUNG_MODULUS.check(self.young_modulus)?;
        limits::POISSON_RATIO.check(self.poisson_ratio)?;
        limits::DENSITY.check(self.density)?;
        limits::VISCOSITY.check(self.viscosity)
    }

    /// Lamé's constants (λ, μ), Pa.
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young_modulus, self.poisson_ratio);
        (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)))
    }
}
