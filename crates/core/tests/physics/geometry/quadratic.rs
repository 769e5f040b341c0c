//! Quadratic simplices and Gauss's rules.

use nalgebra::SVector;
use tongue_core::geometry::quadratic::{self, edges, gauss_legendre, gradients, parts, points, values};
use tongue_core::geometry::simplex::{self, Corners, MAX_CORNERS};

fn corners<const D: usize>() -> Corners<D> {
    let mut x = [SVector::zeros(); MAX_CORNERS];
    for (i, corner) in x.iter_mut().enumerate().take(D + 1) {
        for d in 0..D {
            corner[d] = if i == d + 1 { 1.0 } else { 0.0 } + 0.1 * ((3 * i + 5 * d) as f64).sin();
        }
    }
    x
}

fn all_nodes<const D: usize>(x: &Corners<D>) -> Vec<SVector<f64, D>> {
    let middles = edges::<D>().iter().map(|&[i, j]| (x[i] + x[j]) * 0.5);
    x[..=D].iter().copied().chain(middles).collect()
}

fn are_what_they_should_be<const D: usize>() {
    let x = corners::<D>();
    let nodes = all_nodes(&x);
    assert_eq!(nodes.len(), quadratic::nodes::<D>());
    // Shape functions reproduce a quadratic field and its gradient exactly.
    let field = |p: &SVector<f64, D>| 1.0 + 2.0 * p[0] - p[1] + 3.0 * p[0] * p[1] - p[1] * p[1];
    let slope = |p: &SVector<f64, D>| {
        let mut g = SVector::<f64, D>::zeros();
        (g[0], g[1]) = (2.0 + 3.0 * p[1], -1.0 + 3.0 * p[0] - 2.0 * p[1]);
        g
    };
    let measure = simplex::measure(&x);
    let coordinates = simplex::gradient(&x).map(|g| g / measure);
    let (mut first, mut second) = (0.0, 0.0);
    for at in points::<D>() {
        let p: SVector<f64, D> = x.iter().zip(at).map(|(x, l)| x * *l).sum();
        let (n, g) = (values::<D>(at), gradients(at, &coordinates));
        let value: f64 = nodes.iter().zip(n).map(|(node, n)| n * field(node)).sum();
        let gradient: SVector<f64, D> = nodes.iter().zip(g).map(|(node, g)| g * field(node)).sum();
        assert!((value - field(&p)).abs() < 1e-13 && (gradient - slope(&p)).norm() < 1e-12);
        first += at[0] / points::<D>().len() as f64;
        second += at[0] * at[1] / points::<D>().len() as f64;
    }
    let d = D as f64;
    assert!((first - 1.0 / (d + 1.0)).abs() < 1e-15);
    assert!((second - 1.0 / ((d + 1.0) * (d + 2.0))).abs() < 1e-15);
    let parts = parts::<D>().iter().map(|part| simplex::measure(&simplex::corners(&nodes, part)));
    for part in parts {
        assert!((part / measure * (1 << D) as f64 - 1.0).abs() < 1e-12, "{part} {measure}");
    }
}

#[test]
fn quadratic_fields_are_met_and_the_parts_fill_the_cell() {
    are_what_they_should_be::<2>();
    are_what_they_should_be::<3>();
}

#[test]
fn powers_are_integrated_exactly_as_far_as_promised() {
    for count in 1..=9 {
        let rule = gauss_legendre(count);
        for power in 0..2 * count {
            let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
            let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
            assert!((sum - exact).abs() < 1e-14, "{count} points, power {power}: {sum}");
        }
    }
}
