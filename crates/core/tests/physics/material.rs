//! Matched springs, and the neo-Hookean law.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector};
use tongue_core::material::law::contract;
use tongue_core::material::{Model, NeoHookean, match_stiffness, regular_simplex};

#[test]
fn the_published_coefficients_come_out_of_an_equilateral_triangle() {
    for side in [5.5e-3, 1.0e-3, 2.0] {
        let (k, kappa) = match_stiffness::<2>(&Model::default(), &regular_simplex(side)).unwrap();
        assert!((k - 2673.6).abs() < 0.05, "{k}");
        assert!((kappa / (side / 5.5e-3).powi(2) - 1.456).abs() < 5e-4, "{kappa}");
    }
}

#[test]
fn constants_out_of_range_are_named() {
    let t = Model::default();
    for (constants, name) in [
        (Model { poisson_ratio: 0.5, ..t }, "Poisson's ratio is 0.5"),
        (Model { young_modulus: -1.0, ..t }, "Young's modulus is -1 Pa"),
        (Model { density: f64::NAN, ..t }, "the density is NaN"),
    ] {
        let error = match_stiffness::<2>(&constants, &regular_simplex(1.0)).unwrap_err();
        assert!(error.to_string().starts_with(name));
    }
}

const LAW: NeoHookean = NeoHookean { lambda: 1.1e5, mu: 2.3e3 };

fn determinant<const D: usize>(f: &SMatrix<f64, D, D>) -> f64 {
    nalgebra::DMatrix::from_column_slice(D, D, f.as_slice()).determinant()
}

#[test]
fn energies_of_displacements_are_those_of_deformations_and_keep_their_digits_when_small() {
    fn agree<const D: usize>(h: SMatrix<f64, D, D>) {
        let f = SMatrix::identity() + h;
        let (ratio, law) = (determinant(&f), LAW.displaced(&h));
        let shear = 0.5 * LAW.mu * (f.norm_squared() - D as f64);
        let direct = shear + (0.5 * LAW.lambda * ratio.ln() - LAW.mu) * ratio.ln();
        assert!((LAW.displaced_energy(&h) / direct - 1.0).abs() < 1e-11);
        assert!((law.volume_ratio - ratio).abs() < 1e-15);
        // This modulus is `μ - λ ln J`.
        let modulus = LAW.mu - LAW.lambda * ratio.ln();
        assert!((law.transpose_modulus() - modulus).abs() < 1e-15 * LAW.lambda);
        // To second order in the strain the energy is that of linear elasticity.
        for small in [1e-4, 1e-7, 1e-12] {
            let (strain, trace) = ((h + h.transpose()) * (0.5 * small), h.trace() * small);
            let linear = LAW.mu * strain.norm_squared() + 0.5 * LAW.lambda * trace * trace;
            let ratio = LAW.displaced_energy(&(h * small)) / linear;
            assert!((ratio - 1.0).abs() < 2.0 * small + 1e-13, "{small} {ratio}");
        }
    }
    agree(Matrix2::new(0.1, 0.2, -0.1, -0.05));
    agree(Matrix2::new(0.3, 0.2, -0.1, -0.25));
    agree(Matrix3::new(0.1, 0.2, 0.1, -0.1, -0.05, 0.3, 0.05, -0.2, 0.02));
    assert_eq!(LAW.displaced_energy(&Matrix2::new(-2.0, 0.0, 0.0, 0.0)), f64::INFINITY);
}

#[test]
fn the_nearest_convex_moduli_are_those_without_negative_eigenvalues() {
    let h = [[0.9, 0.1, -0.2, 0.8], [1.02, 0.3, 0.05, 1.01], [1.3, -0.4, 0.2, 1.1], [0.6, 0.5, 0.4, 1.2]];
    let mut untwisted = 0;
    for [a, b, c, d] in h {
        let f = Matrix2::new(a, b, c, d);
        let law = LAW.displaced(&(f - Matrix2::identity()));
        let (expected, turned) = (law.convex_moduli(), f.try_inverse().unwrap().transpose());
        let (ga, gb) = (SVector::from([0.3, -1.2]), SVector::from([0.7, 0.4]));
        let expected = contract(&expected, &ga, &gb);
        let plain = law.tangent([&ga, &gb], [&(turned * ga), &(turned * gb)]);
        let slow = law.nearest_convex_moduli().map_or(plain, |m| contract(&m, &ga, &gb));
        assert!((slow - expected).norm() < 1e-9 * LAW.lambda, "{slow} {expected}");
        if let Some(t) = law.untwisting() {
            let fast = plain + (t * ga) * (t * gb).transpose();
            assert!((fast - expected).norm() < 1e-9 * LAW.lambda, "{fast} {expected}");
            untwisted += usize::from(t.norm() > 0.0);
        }
    }
    assert_eq!(untwisted, 2);
}

#[test]
fn simple_shear_has_the_von_mises_stress_of_the_textbook() {
    let small = 1e-6;
    let solid = Matrix3::new(0.0, small, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let expected = 3f64.sqrt() * LAW.mu * small;
    assert!((LAW.displaced(&solid).state().von_mises_pa / expected - 1.0).abs() < 1e-5);
    let flat = Matrix2::new(0.0, small, 0.0, 0.0);
    assert!((LAW.displaced(&flat).state().von_mises_pa / expected - 1.0).abs() < 1e-5);
    let pressed = Matrix3::identity() * -0.1;
    assert!(LAW.displaced(&pressed).state().von_mises_pa < 1e-9 * LAW.lambda);
}
